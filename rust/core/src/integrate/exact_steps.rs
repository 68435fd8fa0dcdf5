//! Exact steps that a method has prepared: single ones and, with `std`, blocks of up to 32, computed in pairs.

use core::ops::Range;

use crate::equations::{Propagator, TwoSteps};
use crate::excitation::{Excitation, Forcing, Values};
use crate::system::State;

/// Exact steps over intervals of one length by one set of equations.
#[derive(Debug)]
pub struct ExactSteps<'m> {
    pub(super) one: &'m Propagator,
    /// None without `std`.
    pub(super) two: Option<&'m TwoSteps>,
    pub(super) block: &'m mut Block,
}

/// Most steps in a block.
pub(super) const BLOCK: usize = if cfg!(feature = "std") { 32 } else { 0 };
/// Steps in the first block of a series of equal intervals, which may end after a few; each further block has twice as many.
pub(super) const FIRST_BLOCK: usize = 4;

/// Consecutive steps, computed first and tested for contact changes afterwards.
#[derive(Debug, Clone)]
pub struct Block {
    /// Values of the excitation at the start of each step, and at the end of the last.
    pub(super) values: [Values; BLOCK + 1],
    /// The state at the end of each step.
    pub(super) states: [State; BLOCK],
}

impl Block {
    pub(super) const EMPTY: Self = Self { values: [[0.0; 9]; BLOCK + 1], states: [[0.0; 12]; BLOCK] };

    /// Computes steps from `state` over the first of the `intervals`, at most [`BLOCK`], as far as these are `h` s long; returns their number,
    /// rounded down to even.
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
