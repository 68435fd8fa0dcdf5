//! How far a value of a load may bow away from the chords between the instants of a block.

use core::ops::Add;

use super::between::{Between, Piece, Place};
use super::block_values::{BLOCK, Values};
use super::extremes::{Extremes, Goal};
use super::loads::Wrench;
use crate::numeric::float::{add_columns, fma, sqrt};
use crate::numeric::simd::dispatch_wide;
use crate::system::State;

/// How far a value bows away from the chord between two instants, over what the larger second difference quotient at them says. For six
/// instants per period of a vibration it is 1.3.
pub(crate) const BOW: f64 = 2.0;

/// Gain of a value between two instants, over the largest of its load, that is rounding.
const LEAST_GAIN: f64 = 1e-12;

/// The pieces from each instant of a block to the next.
#[derive(Debug)]
pub(super) struct Bows {
    /// s; zero where there is none.
    pub lengths: Values,
    /// Inverse of the length.
    inverses: Values,
    /// Inverse of the time from the middle of the piece before to that of this one.
    quotients: Values,
    /// Bow over the larger second difference quotient, s².
    bows: Values,
    /// Infinite for a piece whose bow is not known: a load may jump at one end, or see [`is_unknown`]. Else zero.
    unknown: Values,
    /// Curvature per unit of the effects of the excitation that second differences do not show; see [`Bows::hidden`].
    kinks: [[f64; 2]; 9],
    /// The largest bow over the range of a value in the block, that over a curvature, s², and infinity if one is unknown, else zero.
    most: [f64; 3],
}

impl Bows {
    /// Before the first block.
    pub(super) const NONE: Self = Self {
        lengths: [0.0; BLOCK],
        inverses: [0.0; BLOCK],
        quotients: [0.0; BLOCK],
        bows: [0.0; BLOCK],
        unknown: [0.0; BLOCK],
        kinks: [[0.0; 2]; 9],
        most: [0.0; 3],
    };

    /// Takes the pieces between these places.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn measure(&mut self, between: &Between, places: &[Place; BLOCK]) {
        for k in 0..BLOCK - 1 {
            let ends = [places[k], places[k + 1]];
            self.lengths[k] = between.length(ends);
            self.unknown[k] = if between.jumps_at(ends) { f64::INFINITY } else { 0.0 };
        }
        for k in 0..BLOCK {
            let h = self.lengths[k];
            let before = if k > 0 { self.lengths[k - 1] } else { 0.0 };
            self.inverses[k] = if h > 0.0 { 1.0 / h } else { 0.0 };
            // A load has a corner at a contact change.
            let is_smooth = h > 0.0 && before > 0.0 && places[k].is_some_and(|(_, since)| since == 0.0);
            self.quotients[k] = if is_smooth { 2.0 / (h + before) } else { 0.0 };
            self.bows[k] = BOW * 0.125 * h * h;
        }
        let count = self.quotients.iter().filter(|quotient| **quotient > 0.0).count();
        for k in 0..BLOCK - 1 {
            if is_unknown([self.quotients[k] > 0.0, self.quotients[k + 1] > 0.0], count) {
                self.unknown[k] = f64::INFINITY;
            }
        }
        self.most = [0.0; 3];
        // The largest second difference quotient at each instant over the range of a value, and at all.
        let (mut quotient, mut largest) = ([0.0; BLOCK], 0.0);
        for k in 1..BLOCK {
            quotient[k] = self.quotients[k] * (self.inverses[k - 1] + self.inverses[k]);
            largest = f64::max(largest, quotient[k]);
        }
        for k in 0..BLOCK - 1 {
            let is_known = self.quotients[k] > 0.0 && self.quotients[k + 1] > 0.0;
            let ends = f64::max(quotient[k], quotient[k + 1]);
            let bend = if is_known { ends } else { beyond(ends, largest) };
            let numbers = [self.bows[k] * bend, self.bows[k], self.unknown[k]];
            for (most, number) in self.most.iter_mut().zip(numbers) {
                *most = f64::max(*most, number);
            }
        }
        self.kinks = [[0.0; 2]; 9];
        for k in 1..BLOCK - 1 {
            if let Some((sample, _)) = places[k]
                && self.quotients[k] > 0.0
            {
                let larger = f64::max(self.lengths[k - 1], self.lengths[k]);
                let factors = [0.5 * larger * self.quotients[k], self.quotients[k]];
                let inverses = between.inverses(
                    sample,
                    [self.lengths[k - 1], self.lengths[k]],
                    [self.inverses[k - 1], self.inverses[k]],
                );
                for (kinks, (component, _)) in self.kinks.iter_mut().zip(between.influences()) {
                    let change = between.change_of_rate(sample, component, inverses).abs();
                    for (most, factor) in kinks.iter_mut().zip(factors) {
                        *most = f64::max(*most, factor * change);
                    }
                }
            }
        }
    }

    /// How far a value may pass its range in the block, with this hidden curvature, between its instants.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn reach(&self, [low, high]: [f64; 2], hidden: f64) -> f64 {
        let [by_range, by_curvature, unknown] = self.most;
        fma(by_range, high - low, fma(by_curvature, hidden, unknown))
    }

    /// The curvature of each value of a load in a piece that second differences do not show: at a sample the rate of the excitation changes,
    /// and with it the curvature of a load, by its dampers, or its slope. The second difference there is that of the mean curvature on both
    /// sides.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn hidden(&self, between: &Between, load: &Wrench) -> [f64; 8] {
        let mut hidden = [0.0; 8];
        for ((component, influence), kinks) in between.influences().zip(self.kinks) {
            let mut by_rate = [0.0; 6];
            add_columns(&mut by_rate, &load.linear.by_state[6..], influence);
            for row in 0..6 {
                hidden[row] = fma(by_rate[row].abs(), kinks[0], hidden[row]);
                hidden[row] = fma(load.linear.by_input[component][row].abs(), kinks[1], hidden[row]);
            }
            for link in load.nonlinear.as_slice() {
                let mut damped = 0.0;
                for (own, factor) in link.row.damping.iter().zip(influence) {
                    damped = fma(*own, *factor, damped);
                }
                for row in 0..6 {
                    hidden[row] = fma((link.damping[row] * damped).abs(), kinks[0], hidden[row]);
                }
            }
        }
        let [_, y, z, mx, my, mz, ..] = hidden;
        hidden[6] = sqrt(fma(y, y, z * z));
        hidden[7] = sqrt(fma(mx, mx, fma(my, my, mz * mz)));
        hidden
    }

    /// Estimates the largest value in each piece of a block, or with the `sign` -1 the largest negative value; -∞ where it is at an end. Whether
    /// one passes `least`.
    #[cfg_attr(feature = "std", inline(always))]
    fn estimate(&self, values: &Values, hidden: f64, sign: f64, least: f64, most: &mut Values) -> bool {
        let Self { inverses, quotients, bows, unknown, .. } = self;
        // Curvatures from one instant before the block on.
        let (mut slopes, mut curvatures) = ([0.0; BLOCK], [0.0; BLOCK + 1]);
        for k in 0..BLOCK - 1 {
            slopes[k] = sign * (values[k + 1] - values[k]) * inverses[k];
        }
        for k in 1..BLOCK - 1 {
            curvatures[k + 1] = (slopes[k - 1] - slopes[k]) * quotients[k];
        }
        let (mut largest, mut may_pass) = (0.0, false);
        for curvature in &curvatures {
            largest = if curvature.abs() > largest { curvature.abs() } else { largest };
        }
        for k in 0..BLOCK - 1 {
            let [start, end] = [curvatures[k + 1], curvatures[k + 2]];
            let at_start = if quotients[k] > 0.0 { start } else { beyond(end.abs(), largest) };
            let at_end = if quotients[k + 1] > 0.0 { end } else { beyond(start.abs(), largest) };
            let bend = if at_start > at_end { at_start } else { at_end };
            most[k] = fma(bows[k], (if bend > 0.0 { bend } else { 0.0 }) + hidden, unknown[k]);
            let (a, b) = (sign * values[k], sign * values[k + 1]);
            may_pass |= (if a > b { a } else { b }) + most[k] > least;
        }
        // No piece is higher than its higher end and its bow. Most blocks need no division.
        if !may_pass {
            return false;
        }
        let mut passes = false;
        for k in 0..BLOCK - 1 {
            let (a, b, bow) = (sign * values[k], sign * values[k + 1], most[k]);
            let (change, middle) = (b - a, 0.5 * (a + b));
            // The parabola with this bow over the middle of the chord.
            let top = middle + bow + change * change / (16.0 * bow);
            most[k] = if change.abs() < 4.0 * bow { top } else { f64::NEG_INFINITY };
            passes |= most[k] > least;
        }
        passes
    }
}

/// Fewest second difference quotients of a block by which one that is not known can be bounded.
const FEWEST: usize = 6;

/// Whether the bow of a piece is not known, by whether the quotients at its ends are, as between two jumps of the excitation, and the number of
/// those that are in the block.
pub(crate) fn is_unknown(known: [bool; 2], count: usize) -> bool {
    known == [false; 2] || (known != [true; 2] && count < FEWEST)
}

/// Bound on the second difference quotient at an end of a piece where it is not known, by that at the other end and the largest one in the
/// block. (Those of a vibration at equal distances h are `c = 2 cos(ω h) c' - c''`.)
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn beyond<T: Copy + Add<Output = T>>(at_other_end: T, largest: T) -> T {
    at_other_end + at_other_end + largest
}

/// The pieces of a block between its instants, with a value of a load at these.
pub(super) struct Pieces<'a> {
    pub places: &'a [Place; BLOCK],
    pub states: &'a [State; BLOCK],
    pub bows: &'a Bows,
    pub values: &'a Values,
    /// Smallest and largest of them.
    pub range: [f64; 2],
    /// See [`Bows::hidden`].
    pub hidden: f64,
}

impl Pieces<'_> {
    /// Lets those wait in which the value may pass its extremes; of a magnitude only the largest is sought.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn wait(
        &self,
        between: &mut Between,
        (load, value): (usize, usize),
        loads: &[Wrench],
        extremes: &mut [Extremes],
    ) {
        let Self { bows, values, range, hidden, .. } = self;
        let mut most = [0.0; BLOCK];
        let reach = bows.reach(*range, *hidden);
        for largest in [true, false] {
            if value >= 6 && !largest {
                return;
            }
            let goal = Goal { load, value, largest };
            let (sign, rounding) =
                (if largest { 1.0 } else { -1.0 }, LEAST_GAIN * extremes[load].size_of(value));
            let least = extremes[load].of(goal) + rounding;
            let high = if largest { range[1] } else { -range[0] };
            // Not for NaN.
            if high + reach <= least {
                continue;
            }
            if !dispatch_wide!(bows.estimate(values, *hidden, sign, least, &mut most)) {
                continue;
            }
            for k in 0..BLOCK - 1 {
                if let Some((sample, since)) = self.places[k]
                    && most[k] > extremes[load].of(goal) + rounding
                    && bows.lengths[k] > 0.0
                {
                    let ends = [self.states[k], self.states[k + 1]];
                    let piece = Piece { goal, sample, since, h: bows.lengths[k], ends, most: most[k] };
                    between.wait(piece, loads, extremes);
                }
            }
        }
    }
}
