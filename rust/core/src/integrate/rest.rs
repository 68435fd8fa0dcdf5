//! A body at rest under a constant excitation: its state is recorded without computing steps.

use super::method::Method;
use super::step_loop::Runner;
use super::switched::SwitchedEquations;
use crate::excitation::Forcing;
use crate::system::State;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Records a body that is at rest at sample `k` as long as it stays so; returns the last sample recorded. `before`: the state at the
    /// sample before.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn rest(&mut self, forcing: &Forcing, k: usize, before: &State, state: &State) -> usize {
        let until = self.rests_until(forcing, k, before, state);
        for at in k + 1..=until {
            self.recorder.sample(at, state);
        }
        until
    }

    /// The last sample up to which the body stays at rest from sample `k` on; `k` if it moves. A body is at rest if its state hardly changed
    /// over the last interval, from `before` to `state`. It stays so while the excitation is constant and the intervals have the same length.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn rests_until(&self, forcing: &Forcing, k: usize, before: &State, state: &State) -> usize {
        if k % REST_INTERVALS != 1 {
            return k;
        }
        let excitation = self.recorder.excitation;
        let h = excitation.interval(k - 1);
        let rests = match &self.steps.controller {
            Some(controller) if forcing.is_constant(excitation, k - 1..k + 1) => {
                let mut change = *state;
                for i in 0..12 {
                    change[i] -= before[i];
                }
                // False for NaN. Without loads the scale is zero, and so is the norm of any change.
                self.summary.load_scale > 0.0
                    && self.steps.norm.of(&change) <= controller.most_change_at_rest(h)
            }
            _ => false,
        };
        let last = if rests { usize::min(k - 1 + REST_INTERVALS, excitation.count() - 1) } else { k };
        let mut until = k;
        while until < last
            && excitation.interval(until) == h
            && forcing.is_constant(excitation, until..until + 2)
        {
            until += 1;
        }
        until
    }
}

/// Intervals between two tests whether a body is at rest. All scenes are tested at the same samples, so that those that run side by side are
/// at rest together.
const REST_INTERVALS: usize = 32;
