//! Derivatives of the integrals of a power of the equivalent load by the loads at both ends of an interval.

use super::equivalent_load::{COMPONENTS, EquivalentLoad, Preload};
use super::rows::{SIX_NODES, for_each_part, loaded_row};
use super::travel::{Cuts, Interval, between};
use crate::numeric::float::{pow, sqrt};

impl EquivalentLoad {
    /// Derivatives of `∫ P^p |v| dt` over an interval by the components Fy, Fz, Mx, My, Mz at both ends; see [`EquivalentLoad::integrals`]. Without the
    /// jump of 1 % that the effect of a [`Preload::Power`] has at its opening.
    pub fn integral_weights(
        &self,
        exponent: f64,
        travel: &Interval,
        loads: [&[f64; COMPONENTS]; 2],
    ) -> [[f64; COMPONENTS]; 2] {
        let mut out = [[0.0; COMPONENTS]; 2];
        let mut cuts = travel.turns_in_order();
        for component in 0..COMPONENTS {
            let (first, last) = (loads[0][component], loads[1][component]);
            if first * last < 0.0 && self.counts(component) {
                cuts.insert(first / (first - last));
            }
        }
        cuts.for_each_piece(|from, to| {
            for (from, to) in self.pieces(loads, from, to) {
                // Of six nodes: on a piece the integrand is a polynomial of degree 5 for an exponent of 3, and nearly one for 10/3.
                let mut add = |[from, to]: [f64; 2]| {
                    for [x, weight] in SIX_NODES {
                        let s = 0.5 * (from + to) + 0.5 * (to - from) * x;
                        let there = between(loads, s);
                        let speed =
                            travel.speed(s).abs() * travel.length * 0.5 * f64::abs(to - from) * weight;
                        for (component, slope) in
                            self.slopes_of_power(exponent, &there).into_iter().enumerate()
                        {
                            out[0][component] += (1.0 - s) * speed * slope;
                            out[1][component] += s * speed * slope;
                        }
                    }
                };
                let share = |s: f64| self.without_preload(&between(loads, s)) / self.preload.opening();
                match self.preload {
                    Preload::Rows { .. } if share(0.5 * (from + to)) < 1.0 => {
                        let ends = [share(from), share(to)].map(|share| f64::min(share, 1.0));
                        for_each_part([from, to], ends, |part, _| add(part));
                    }
                    _ => add([from, to]),
                }
            }
        });
        out
    }

    /// The pieces of a piece on which both groups are linear, cut where they are equal and where the preload begins to act.
    fn pieces(&self, loads: [&[f64; COMPONENTS]; 2], from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let mut cuts = Cuts::new();
        let fraction = |at: f64, before: f64, after: f64, end: f64| {
            if before * after < 0.0 { at + before / (before - after) * (end - at) } else { f64::NAN }
        };
        let difference = |s: f64| {
            let [first, second] = self.groups(&between(loads, s));
            first - second
        };
        let equal = fraction(from, difference(from), difference(to), to);
        let above = |s: f64| self.without_preload(&between(loads, s)) - self.preload.opening();
        if self.minor != 1.0 {
            cuts.insert(equal);
        }
        let middle = if self.minor != 1.0 && equal > from { equal } else { to };
        if !matches!(self.preload, Preload::None) {
            cuts.insert(fraction(from, above(from), above(middle), middle));
            cuts.insert(fraction(middle, above(middle), above(to), to));
        }
        let mut ends = [f64::NAN; 5];
        let mut count = 0;
        cuts.for_each_piece(|_, end| {
            ends[count] = if end == 1.0 { to } else { end };
            count += 1;
        });
        let mut start = from;
        ends.into_iter().take(count).map(move |end| (core::mem::replace(&mut start, end), end))
    }

    /// Derivatives of `P^p` by the components of a load.
    fn slopes_of_power(&self, exponent: f64, load: &[f64; COMPONENTS]) -> [f64; COMPONENTS] {
        let plain = self.without_preload(load);
        let opening = self.preload.opening();
        let (effective, slope) = match self.preload {
            Preload::Power(force) if plain < opening => {
                let raised = plain / opening + 1.0;
                (force * raised * sqrt(raised), 1.5 * force * sqrt(raised) / opening)
            }
            Preload::Linear(force) if plain < opening => (force + 2.0 / 3.0 * plain, 2.0 / 3.0),
            Preload::Rows { force, exponent } if plain < opening => {
                let [row, slope] = loaded_row(plain / force, exponent);
                (force * row, slope)
            }
            _ => (plain, 1.0),
        };
        let factor = exponent * pow(effective, exponent - 1.0) * slope;
        let [first, second] = self.groups(load);
        let shares = if first >= second { [1.0, self.minor] } else { [self.minor, 1.0] };
        core::array::from_fn(|component| {
            let side = usize::from(load[component] < 0.0);
            let sign = if side == 1 { -1.0 } else { 1.0 };
            let weight = |group: usize| shares[group] * self.weights[group][component][side];
            factor * sign * (weight(0) + weight(1))
        })
    }
}
