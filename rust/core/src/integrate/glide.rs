//! The quick way over intervals that need nothing but the exact step of a recurring length: no contact changes in them, and no step error.

use super::method::{Method, Output};
use super::step_loop::Runner;
use super::switched::SwitchedEquations;
use crate::equations::Equations;
use crate::excitation::{Forcing, Instant, Ramp, Values};
use crate::system::State;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Steps from sample to sample, from sample `k` with `state` on, as far as the method has an exact step ready and the equations do not
    /// change; returns the sample reached, to which `state` and the values `from` then belong. The states are those of
    /// [`Runner::step_over`], to the last bit, without its preparations for steps that end within an interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn glide(
        &mut self,
        forcing: &Forcing,
        mut k: usize,
        [state, next]: [&mut &mut State; 2],
        [from, to]: [&mut &mut Values; 2],
    ) -> usize {
        let excitation = self.recorder.excitation;
        let (key, h) = (self.equations.equations().key(), excitation.interval(k));
        let Output::Samples = self.recorder.output else { return k };
        let Some(propagator) = self.method.propagator(self.memory, h, key) else { return k };
        // The loop of all steps looks up the budget.
        let work = M::WORK * (self.summary.steps + self.summary.rejected) + self.equations.searched();
        let most = usize::min(self.budget.pause.saturating_sub(work), excitation.count() - 1 - k);
        let first = k;
        while k < first + most && excitation.interval(k) == h {
            forcing.sample(excitation, k + 1, to);
            **next = propagator.apply(state, from, to);
            let begin = Instant { first: k, until: k + 1, since: 0.0 };
            if !self.equations.stays(&Ramp::whole(h, [&**from, &**to], forcing, begin), state, next) {
                break;
            }
            core::mem::swap(state, next);
            core::mem::swap(from, to);
            k += 1;
            self.recorder.sample(k, state);
        }
        self.summary.steps += k - first;
        k
    }
}
