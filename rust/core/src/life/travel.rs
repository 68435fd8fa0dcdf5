//! Integrals over one interval of the motion, exact for loads linear in time and a speed quadratic in time.

use super::equivalent_load::{COMPONENTS, EquivalentLoad, Preload};
use super::power_of_linear::{mean_of_product, power};
use super::rows::{for_each_part, nodes};
use crate::numeric::float::{copysign, sqrt};

/// The travel between two instants: the acceleration is linear in time, so the velocity is quadratic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// s.
    pub length: f64,
    /// Velocity at both ends, m/s.
    pub velocity: [f64; 2],
    /// Acceleration at both ends, m/s².
    pub acceleration: [f64; 2],
}

/// Integrals over the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals {
    /// `∫ P^p |v| dt`, N^p m.
    pub power: f64,
    /// `∫ |v| dt`, m.
    pub path: f64,
}

/// Instants of an interval at which a linear or quadratic function changes its sign: two turns of the velocity, one zero of each component.
const MOST_CUTS: usize = 2 + COMPONENTS;

impl Interval {
    /// Velocity at a fraction s of the length, m/s.
    #[cfg(feature = "std")]
    pub(super) fn speed(&self, s: f64) -> f64 {
        let [start, change, bend] = self.quadratic();
        start + s * (change + bend * (s - 1.0))
    }

    /// `v = start + s (change + bend (s - 1))`.
    fn quadratic(&self) -> [f64; 3] {
        let [start, end] = self.velocity;
        [start, end - start, 0.5 * self.length * (self.acceleration[1] - self.acceleration[0])]
    }

    /// Fractions of the length at which the velocity is zero; some are NaN or outside of (0, 1).
    fn turns(&self) -> [f64; 2] {
        let [start, change, bend] = self.quadratic();
        let linear = change - bend;
        let large = -0.5 * (linear + copysign(sqrt(linear * linear - 4.0 * bend * start), linear));
        [large / bend, start / large]
    }

    /// Coefficients of 1, x, x² of the velocity between the fractions `from` and `to`, x from -1 to 1.
    fn on_piece(&self, from: f64, to: f64) -> [f64; 3] {
        let [start, change, bend] = self.quadratic();
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let slope = change + bend * (2.0 * middle - 1.0);
        [start + middle * (change + bend * (middle - 1.0)), half * slope, half * half * bend]
    }

    /// `∫ |v| dt`, m.
    pub fn path(&self) -> f64 {
        self.path_between(&self.turns_in_order())
    }

    fn path_between(&self, turns: &Cuts) -> f64 {
        let mut path = 0.0;
        turns.for_each_piece(|from, to| {
            let [even, _, bend] = self.on_piece(from, to);
            path += f64::abs(even + bend / 3.0) * (to - from);
        });
        path * self.length
    }

    /// `∫ |v| x^k dt` with x from -1 to 1, m.
    #[cfg(feature = "std")]
    pub(crate) fn moment(&self, k: u32) -> f64 {
        let coefficients = self.on_piece(0.0, 1.0);
        let antiderivative = |x: f64| {
            let (mut power, mut order, mut sum) = (1.0, f64::from(k), 0.0);
            for _ in 0..k {
                power *= x;
            }
            for coefficient in coefficients {
                (power, order) = (power * x, order + 1.0);
                sum += coefficient * power / order;
            }
            sum
        };
        let mut sum = 0.0;
        self.turns_in_order().for_each_piece(|from, to| {
            let of_piece = antiderivative(2.0 * to - 1.0) - antiderivative(2.0 * from - 1.0);
            sum += copysign(1.0, self.speed(0.5 * (from + to))) * of_piece;
        });
        0.5 * self.length * sum
    }

    /// Coefficients of `|v| length = c0 + s (c1 + c2 (s - 1))` at a fraction s of the length, m; none if v changes its sign.
    #[cfg(feature = "std")]
    pub(crate) fn one_way(&self) -> Option<[f64; 3]> {
        let length = copysign(self.length, self.speed(0.5));
        (self.turns_in_order().count == 0).then(|| self.quadratic().map(|coefficient| length * coefficient))
    }

    pub(super) fn turns_in_order(&self) -> Cuts {
        let mut cuts = Cuts::new();
        let [start, change, bend] = self.quadratic();
        // The velocity deviates from a straight line by at most a quarter of the bend.
        let nearest = f64::min(f64::abs(start), f64::abs(start + change));
        if start * (start + change) > 0.0 && f64::abs(bend) < 4.0 * nearest {
            return cuts;
        }
        for turn in self.turns() {
            cuts.insert(turn);
        }
        cuts
    }
}

/// Ascending fractions in (0, 1).
pub(super) struct Cuts {
    at: [f64; MOST_CUTS],
    count: usize,
}

impl Cuts {
    pub(super) fn new() -> Self {
        Self { at: [0.0; MOST_CUTS], count: 0 }
    }

    /// Adds a fraction; NaN, or one outside of (0, 1), is none.
    pub(super) fn insert(&mut self, fraction: f64) {
        if fraction > 0.0 && fraction < 1.0 && self.count < MOST_CUTS {
            let mut place = self.count;
            while place > 0 && self.at[place - 1] > fraction {
                self.at[place] = self.at[place - 1];
                place -= 1;
            }
            self.at[place] = fraction;
            self.count += 1;
        }
    }

    pub(super) fn for_each_piece(&self, mut piece: impl FnMut(f64, f64)) {
        let mut from = 0.0;
        for &to in self.at[..self.count].iter().chain(&[1.0]) {
            if to > from {
                piece(from, to);
            }
            from = to;
        }
    }
}

impl EquivalentLoad {
    /// The integrals over an interval, for the components Fy, Fz, Mx, My, Mz of the load at both ends, N and N m, linear between them.
    pub fn integrals(&self, exponent: f64, travel: &Interval, loads: [&[f64; COMPONENTS]; 2]) -> Integrals {
        let mut cuts = travel.turns_in_order();
        let path = travel.path_between(&cuts);
        if path == 0.0 {
            return Integrals { power: 0.0, path };
        }
        for component in 0..COMPONENTS {
            let (first, last) = (loads[0][component], loads[1][component]);
            if first * last < 0.0 && self.counts(component) {
                cuts.insert(first / (first - last));
            }
        }
        let mut sum = 0.0;
        let mut groups = self.groups(loads[0]);
        cuts.for_each_piece(|from, to| {
            let last = self.groups(&between(loads, to));
            sum += self.groups_linear(exponent, travel, [from, to], [groups, last]);
            groups = last;
        });
        Integrals { power: sum * travel.length, path }
    }

    /// Integral over a piece on which both groups are linear, over the length of the interval.
    fn groups_linear(
        &self,
        exponent: f64,
        travel: &Interval,
        [from, to]: [f64; 2],
        [first, last]: [[f64; 2]; 2],
    ) -> f64 {
        let (before, after) = (first[0] - first[1], last[0] - last[1]);
        let ends = [self.combined(first), self.combined(last)];
        if self.minor == 1.0 || before * after >= 0.0 {
            return self.load_linear(exponent, travel, [from, to], ends);
        }
        let share = before / (before - after);
        let (cut, even) = (from + share * (to - from), first[0] + share * (last[0] - first[0]));
        let middle = self.combined([even, even]);
        self.load_linear(exponent, travel, [from, cut], [ends[0], middle])
            + self.load_linear(exponent, travel, [cut, to], [middle, ends[1]])
    }

    /// Integral over a piece on which P without preload is linear, over the length of the interval.
    fn load_linear(
        &self,
        exponent: f64,
        travel: &Interval,
        [from, to]: [f64; 2],
        [first, last]: [f64; 2],
    ) -> f64 {
        let opening = self.preload.opening();
        let (before, after) = (first - opening, last - opening);
        if before * after >= 0.0 {
            return self.one_branch(exponent, travel, [from, to], [first, last], before + after < 0.0);
        }
        let cut = from + before / (before - after) * (to - from);
        self.one_branch(exponent, travel, [from, cut], [first, opening], before < 0.0)
            + self.one_branch(exponent, travel, [cut, to], [opening, last], after < 0.0)
    }

    /// Integral over a piece on which the preload acts everywhere or nowhere: `P^p` is a power of a linear load.
    fn one_branch(
        &self,
        exponent: f64,
        travel: &Interval,
        [from, to]: [f64; 2],
        ends: [f64; 2],
        raised: bool,
    ) -> f64 {
        let ([first, last], exponent) = match self.preload {
            Preload::Power(force) if raised => {
                // F^p L^(3 p/2) with L = P/(2.8 F) + 1 is (F^(2/3) L)^(3 p/2).
                let factor = crate::numeric::float::pow(force, 2.0 / 3.0);
                (ends.map(|load| factor * (load / self.preload.opening() + 1.0)), 1.5 * exponent)
            }
            Preload::Linear(force) if raised => (ends.map(|load| force + 2.0 / 3.0 * load), exponent),
            Preload::Rows { .. } if raised => return self.row_loads(exponent, travel, [from, to], ends),
            _ => (ends, exponent),
        };
        f64::abs(mean_of_product(first, last, travel.on_piece(from, to), exponent)) * (to - from)
    }

    /// Integral over a piece on which both rows carry load, by nodes.
    #[inline(never)]
    fn row_loads(&self, exponent: f64, travel: &Interval, piece: [f64; 2], ends: [f64; 2]) -> f64 {
        let opening = self.preload.opening();
        let mut sum = 0.0;
        for_each_part(piece, ends.map(|load| load / opening), |[from, to], [first, last]| {
            let [even, odd, bend] = travel.on_piece(from, to);
            let mut mean = 0.0;
            for [x, weight] in nodes([first, last]) {
                let load = 0.5 * opening * ((1.0 - x) * first + (1.0 + x) * last);
                mean += weight * power(self.preload.raised(load), exponent) * (even + x * (odd + x * bend));
            }
            sum += 0.5 * f64::abs(mean * (to - from));
        });
        sum
    }
}

/// Components of the load at a fraction of the interval.
pub(super) fn between(loads: [&[f64; COMPONENTS]; 2], s: f64) -> [f64; COMPONENTS] {
    let mut out = *loads[1];
    if s < 1.0 {
        for (value, (first, last)) in out.iter_mut().zip(loads[0].iter().zip(loads[1])) {
            *value = (1.0 - s) * first + s * last;
        }
    }
    out
}
