//! Slow movement, of single counts.
//!
//! The motion that is estimated from one count swings to and fro, and the machine vibrates with it: neither is of the axis. The travel of slow
//! movement is therefore that between its ends, and its load that of the mean state.

use guideload_life::Real;

/// Periods of which the mean is taken at most, so that the sum keeps its digits in f32.
const MOST_PERIODS: u32 = 4096;

/// Slow movement that is not in the totals yet.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
pub(crate) struct Slow<T, const S: usize> {
    /// Sum of the states of its periods.
    states: [T; S],
    /// m.
    moved: T,
    periods: u32,
}

impl<T: Real, const S: usize> Slow<T, S> {
    pub(crate) const NONE: Self = Self { states: [T::ZERO; S], moved: T::ZERO, periods: 0 };

    /// Whether there is any.
    pub(crate) fn is_going_on(&self) -> bool {
        self.periods > 0
    }

    /// Takes one period: its movement, m, and the state at its end.
    #[inline(always)]
    pub(crate) fn take(&mut self, moved: T, state: &[T; S]) {
        self.moved += moved;
        self.states = core::array::from_fn(|i| self.states[i] + state[i]);
        self.periods = self.periods.saturating_add(1);
    }

    /// Whether the vibration of a count, which decays within `settling` periods, is in the mean from start to end.
    pub(crate) fn is_complete(&self, settling: u32) -> bool {
        self.periods >= settling.min(MOST_PERIODS)
    }

    /// Its travel, m, and the mean state; begins again.
    pub(crate) fn end(&mut self) -> (T, [T; S]) {
        let Self { states, moved, periods } = core::mem::replace(self, Self::NONE);
        let share = T::ONE / T::from_i32(periods as i32);
        (moved.abs(), states.map(|sum| sum * share))
    }
}
