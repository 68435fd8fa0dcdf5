//! Exact steps that a method has ready: over one interval between samples, and, with `std`, blocks of many, two at once.

#[cfg(feature = "std")]
use core::ops::Range;

use crate::equations::Propagator;
#[cfg(feature = "std")]
use crate::equations::TwoSteps;
#[cfg(feature = "std")]
use crate::excitation::{Excitation, Forcing, Values};
#[cfg(feature = "std")]
use crate::system::State;

/// Exact steps over intervals of one length by one set of equations.
#[derive(Debug)]
pub struct ExactSteps<'m> {
    pub(super) one: &'m Propagator,
    #[cfg(feature = "std")]
    pub(super) two: &'m TwoSteps,
    #[cfg(feature = "std")]
    pub(super) block: &'m mut Block,
}

/// Most steps in a block, and steps in the first one of a glide, which may end after a few.
#[cfg(feature = "std")]
pub(super) const BLOCK: usize = 32;
#[cfg(feature = "std")]
pub(super) const SHORTEST_BLOCK: usize = 4;

/// Steps one after the other that are made before they are tested.
#[cfg(feature = "std")]
#[derive(Debug, Clone)]
pub struct Block {
    /// Values of the excitation at the start of each step, and at the end of the last.
    pub(super) values: [Values; BLOCK + 1],
    /// The state at the end of each step.
    pub(super) states: [State; BLOCK],
}

#[cfg(feature = "std")]
impl Block {
    pub(super) const EMPTY: Self = Self { values: [[0.0; 9]; BLOCK + 1], states: [[0.0; 12]; BLOCK] };

    /// Fills the block with steps from `state` over those of the `intervals` that are `h` s long, up to the first that is not; returns their
    /// number, which is even. At most [`BLOCK`] intervals.
    #[inline(always)]
    pub(super) fn fill(
        &mut self,
        steps: &TwoSteps,
        excitation: &Excitation,
        forcing: &Forcing,
        h: f64,
        intervals: Range<usize>,
        state: &State,
    ) -> usize {
        let first = intervals.start;
        // Not in a closure, which would be compiled for the oldest processor.
        let mut count = 0;
        while count < intervals.len() && excitation.interval(first + count) == h {
            count += 1;
        }
        count -= count % 2;
        if count > 0 {
            let values = &mut self.values[..=count];
            for (i, values) in values.iter_mut().enumerate() {
                forcing.sample(excitation, first + i, values);
            }
            steps.follow(state, values, &mut self.states[..count]);
        }
        count
    }
}
