//! Derivatives of the integrals of a power of the equivalent load by the loads at both ends of an interval.

use std::cell::Cell;

use guideload_life::{COMPONENTS, Interval, Piece, Power, Rule};

use super::equivalent_load::EquivalentLoad;
use super::power::{LoadPower, MAX_EXPONENT, SIX_NODES, for_each_part};
use crate::numeric::float::pow;

impl EquivalentLoad {
    /// Derivatives of `∫ P^p |v| dt` over an interval by the components Fy, Fz, Mx, My, Mz at both ends; see [`EquivalentLoad::integrals`]. Without the
    /// jump of 1 % that the effect of a [`crate::Preload::Power`] has at its opening.
    ///
    /// # Panics
    /// As [`EquivalentLoad::integrals`].
    pub fn integral_weights(
        &self,
        exponent: f64,
        travel: &Interval,
        loads: [&[f64; COMPONENTS]; 2],
    ) -> [[f64; COMPONENTS]; 2] {
        assert!(LoadPower::new(exponent).is_some(), "exponent: expected 1 to {MAX_EXPONENT}, got {exponent}");
        let rule = self.rule();
        let slopes = Slopes { rule, exponent, loads, sums: Cell::default() };
        rule.integrals(&slopes, travel, loads);
        slopes.sums.get().map(|sums| sums.map(|sum| travel.length * sum))
    }
}

/// Adds up the derivatives over the pieces of an interval.
struct Slopes<'a> {
    rule: Rule<f64>,
    exponent: f64,
    loads: [&'a [f64; COMPONENTS]; 2],
    sums: Cell<[[f64; COMPONENTS]; 2]>,
}

impl Power<f64> for Slopes<'_> {
    fn linear(&self, piece: &Piece<f64>, _: [f64; 2]) -> f64 {
        self.add(piece, [0.0, 1.0]);
        0.0
    }

    fn with_preload(&self, rule: &Rule<f64>, piece: &Piece<f64>, ends: [f64; 2]) -> f64 {
        for_each_part(ends.map(|load| load / rule.opening), |part, _| self.add(piece, part));
        0.0
    }
}

impl Slopes<'_> {
    /// Adds a part of a piece by six nodes: the integrand is a polynomial of degree 5 for an exponent of 3, and nearly one for 10/3.
    fn add(&self, piece: &Piece<f64>, [from, to]: [f64; 2]) {
        let ([start, middle, end], mut sums) = (piece.speed, self.sums.get());
        for [x, weight] in SIX_NODES {
            let share = 0.5 * ((1.0 - x) * from + (1.0 + x) * to);
            let s = piece.from + share * (piece.to - piece.from);
            let speed = (1.0 - share) * ((1.0 - share) * start + 2.0 * share * middle) + share * share * end;
            let factor = 0.5 * weight * f64::abs((to - from) * speed) * (piece.to - piece.from);
            let there = core::array::from_fn(|k| (1.0 - s) * self.loads[0][k] + s * self.loads[1][k]);
            for (component, slope) in self.slopes_of_power(&there).into_iter().enumerate() {
                sums[0][component] += (1.0 - s) * factor * slope;
                sums[1][component] += s * factor * slope;
            }
        }
        self.sums.set(sums);
    }

    /// Derivatives of `P^p` by the components of a load.
    fn slopes_of_power(&self, load: &[f64; COMPONENTS]) -> [f64; COMPONENTS] {
        let plain = self.rule.combined(self.rule.weigh(load).groups);
        let factor =
            self.exponent * pow(self.rule.with_preload(plain), self.exponent - 1.0) * self.rule.slope(plain);
        self.rule.gradient(load).map(|slope| factor * slope)
    }
}
