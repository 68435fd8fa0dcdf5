//! How far a value of a load may bow away from the chords between the instants of a block.

use super::between::{Between, Piece, Place};
use super::extremes::{Extremes, Goal};
use super::loads::Wrench;
use crate::numeric::float::fma;
use crate::numeric::simd::{Kernel, dispatch_wide};
use crate::system::State;

/// Instants of a block: few, so that a block in which a load passes its extremes is a short part of the run, but enough that bounds pay.
pub(super) const BLOCK: usize = 32;

/// One number at each instant of a block.
pub(super) type Values = [f64; BLOCK];

/// How far a value bows away from the chord between two instants, over what the larger second difference quotient at them says. For six
/// instants per period of a vibration it is 1.3.
const BOW: f64 = 2.0;

/// Gain of a value between two instants, over the largest of its load, that is rounding.
const ROUNDING: f64 = 1e-12;

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
    /// Infinite for a piece whose bow is not known: at one end a load may jump, or at neither a second difference quotient is known, as
    /// between two jumps of the excitation. Else zero.
    unknown: Values,
}

impl Bows {
    /// Before the first block.
    pub(super) const NONE: Self = Self {
        lengths: [0.0; BLOCK],
        inverses: [0.0; BLOCK],
        quotients: [0.0; BLOCK],
        bows: [0.0; BLOCK],
        unknown: [0.0; BLOCK],
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
            self.quotients[k] = if h > 0.0 && before > 0.0 { 2.0 / (h + before) } else { 0.0 };
            self.bows[k] = BOW * 0.125 * h * h;
        }
        for k in 0..BLOCK - 1 {
            if self.quotients[k] == 0.0 && self.quotients[k + 1] == 0.0 {
                self.unknown[k] = f64::INFINITY;
            }
        }
    }
}

/// The pieces of a block between its instants, with a value of a load at these.
pub(super) struct Pieces<'a> {
    pub places: &'a [Place; BLOCK],
    pub states: &'a [State; BLOCK],
    pub bows: &'a Bows,
    pub values: &'a Values,
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
        let Self { bows, values, .. } = self;
        let mut most = [0.0; BLOCK];
        for largest in [true, false] {
            if value >= 6 && !largest {
                return;
            }
            let goal = Goal { load, value, largest };
            let (sign, rounding) =
                (if largest { 1.0 } else { -1.0 }, ROUNDING * extremes[load].size_of(value));
            let least = extremes[load].of(goal) + rounding;
            let kernel = BowKernel { bows, values, sign, least, most: &mut most };
            if !dispatch_wide(kernel) {
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

/// Estimates the largest value in each piece of a block, or with the `sign` -1 the largest negative value. Whether one passes `least`.
struct BowKernel<'a> {
    bows: &'a Bows,
    values: &'a Values,
    sign: f64,
    least: f64,
    most: &'a mut Values,
}

impl Kernel for BowKernel<'_> {
    type Output = bool;

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> bool {
        let Self { bows: Bows { inverses, quotients, bows, unknown, .. }, values, sign, least, most } = self;
        let (mut slopes, mut curvatures) = ([0.0; BLOCK], [0.0; BLOCK]);
        for k in 0..BLOCK - 1 {
            slopes[k] = sign * (values[k + 1] - values[k]) * inverses[k];
        }
        // Only where a value bows upwards is it higher than at the ends.
        for k in 1..BLOCK - 1 {
            curvatures[k] = (slopes[k - 1] - slopes[k]) * quotients[k];
        }
        let mut passes = false;
        for k in 0..BLOCK - 1 {
            let (a, b) = (sign * values[k], sign * values[k + 1]);
            let (high, bend) = (if a > b { a } else { b }, curvatures[k]);
            let bend = if curvatures[k + 1] > bend { curvatures[k + 1] } else { bend };
            most[k] = fma(bows[k], if bend > 0.0 { bend } else { 0.0 }, high) + unknown[k];
            passes |= most[k] > least;
        }
        passes
    }
}
