//! The quick way over intervals that need nothing but one step of a recurring length: no contact changes in them, and no step error or a
//! small one.

use super::method::{Method, Output};
use super::step_loop::Runner;
use super::switched::SwitchedEquations;
use crate::equations::Equations;
use crate::excitation::{Forcing, Instant, Ramp, Values};
use crate::system::State;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Steps from sample to sample, from sample `k` with `state` on, as far as a single step is enough and the equations do not
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
        // The loop of all steps looks up the budget.
        let work = M::WORK * (self.summary.steps + self.summary.rejected) + self.equations.searched();
        let most = usize::min(self.budget.pause.saturating_sub(work), excitation.count() - 1 - k);
        if M::ERROR_ORDER.is_some() {
            return self.glide_by_steps(forcing, k..k + most, [state, next], [from, to]);
        }
        let Some(propagator) = self.method.propagator(self.memory, h, key) else { return k };
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

    /// [`Runner::glide`] of a method with a step error, over intervals in which the error of a single step is small enough.
    #[cfg_attr(feature = "std", inline(always))]
    fn glide_by_steps(
        &mut self,
        forcing: &Forcing,
        samples: core::ops::Range<usize>,
        [state, next]: [&mut &mut State; 2],
        [from, to]: [&mut &mut Values; 2],
    ) -> usize {
        let (excitation, mut k) = (self.recorder.excitation, samples.start);
        let h = excitation.interval(k);
        let Some(controller) = &mut self.steps.controller else { return k };
        let most_error = controller.most_error(h);
        while k < samples.end && excitation.interval(k) == h {
            forcing.sample(excitation, k + 1, to);
            let begin = Instant { first: k, until: k + 1, since: 0.0 };
            let ramp = Ramp::whole(h, [&**from, &**to], forcing, begin);
            let error;
            (**next, error) = self.method.step(self.equations.equations(), self.memory, &ramp, state);
            let error = self.steps.norm.of(&error);
            // Not for NaN either.
            let accurate = error <= most_error;
            if !accurate {
                controller.accept(h, error, false, || 0.0);
                self.summary.rejected += 1;
                break;
            }
            core::mem::swap(state, next);
            core::mem::swap(from, to);
            k += 1;
            self.recorder.sample(k, state);
        }
        self.summary.steps += k - samples.start;
        k
    }
}
