//! Ranges of the entries of some states, which bound every linear combination of them.

use super::state::State;
use crate::numeric::float::fma;

/// Ranges of the entries of some states: a run asks a [`crate::Record`] whether it needs states within them.
#[derive(Debug, Clone, Copy)]
pub struct StateBox {
    low: State,
    high: State,
    pub(crate) middle: State,
    /// Half of each range, and more than rounding can add to a sum of some twenty terms.
    pub(crate) radius: State,
}

/// Rounding of a sum of some twenty terms over the sum of their sizes is far below this.
pub(crate) const SUM_ROUNDING: f64 = 1e-13;

/// The middle between two bounds, and half their distance.
pub(crate) type Bounded = [f64; 2];

/// The smallest and the largest of each entry.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn range_of<const M: usize, const N: usize>(all: &[[f64; M]; N]) -> [[f64; M]; 2] {
    let (mut low, mut high) = (all[0], all[0]);
    for entries in all {
        for j in 0..M {
            low[j] = if entries[j] < low[j] { entries[j] } else { low[j] };
            high[j] = if entries[j] > high[j] { entries[j] } else { high[j] };
        }
    }
    [low, high]
}

impl StateBox {
    /// A box without states.
    pub(crate) const NOTHING: Self = Self {
        low: [f64::INFINITY; 12],
        high: [f64::NEG_INFINITY; 12],
        middle: [0.0; 12],
        radius: [f64::INFINITY; 12],
    };

    /// The box of some states.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn of<const N: usize>(states: &[State; N]) -> Self {
        let [low, high] = range_of(states);
        Self::between(low, high)
    }

    /// The box between these bounds.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn between(low: State, high: State) -> Self {
        let (mut middle, mut radius) = ([0.0; 12], [0.0; 12]);
        for j in 0..12 {
            middle[j] = 0.5 * (low[j] + high[j]);
            radius[j] = fma(SUM_ROUNDING, low[j].abs() + high[j].abs(), 0.5 * (high[j] - low[j]));
        }
        Self { low, high, middle, radius }
    }

    /// The box with the same middle and twice the width.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn widened(&self) -> Self {
        let (mut low, mut high) = (self.low, self.high);
        for j in 0..12 {
            let half = 0.5 * (high[j] - low[j]);
            (low[j], high[j]) = (low[j] - half, high[j] + half);
        }
        Self::between(low, high)
    }

    /// Whether this box is a part of the other. False for NaN.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn is_within(&self, other: &Self) -> bool {
        let mut within = true;
        for j in 0..12 {
            within &= (self.low[j] >= other.low[j]) & (self.high[j] <= other.high[j]);
        }
        within
    }

    /// Whether a state is in the box. False for NaN.
    pub fn contains(&self, state: &State) -> bool {
        (0..12).all(|j| state[j] >= self.low[j] && state[j] <= self.high[j])
    }
}
