//! The quick way over intervals that need nothing but the exact step of a recurring length: no contact changes in them, and no step error.

use super::method::{Method, Output};
use super::step_loop::Runner;
use super::switched::SwitchedEquations;
use crate::equations::Equations;
use crate::excitation::{Forcing, Ramps, Values};
use crate::system::State;

/// Steps made one after the other before any is tested: the next step need not wait for the test of the last one.
const TOGETHER: usize = 8;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Steps from sample to sample, from sample `k` with `state` and the values `from` on, as far as the method has an exact step ready and
    /// the equations do not change; returns the sample reached, to which `state` and `from` then belong. The states are those of
    /// [`Runner::step_over`], to the last bit, without its preparations for steps that end within an interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn glide(
        &mut self,
        forcing: &Forcing,
        mut k: usize,
        state: &mut State,
        from: &mut Values,
    ) -> usize {
        let excitation = self.recorder.excitation;
        let (key, h) = (self.equations.equations().key(), excitation.interval(k));
        let Output::Samples = self.recorder.output else { return k };
        let Some(propagator) = self.method.propagator(self.memory, h, key) else { return k };
        // The loop of all steps looks up the budget.
        let work = M::WORK * (self.summary.steps + self.summary.rejected) + self.equations.searched();
        let first = k;
        let last = k + usize::min(self.budget.pause.saturating_sub(work), excitation.count() - 1 - k);
        let (mut values, mut states) = ([*from; TOGETHER + 1], [*state; TOGETHER + 1]);
        let mut staying = TOGETHER;
        while staying == TOGETHER {
            let mut steps = 0;
            while steps < TOGETHER && k + steps < last && excitation.interval(k + steps) == h {
                steps += 1;
                forcing.sample(excitation, k + steps, &mut values[steps]);
            }
            propagator.apply_in_turn(&values[..=steps], &mut states[..=steps]);
            let ramps = Ramps { h, values: &values[..=steps], forcing, first: k };
            staying = self.equations.staying(&ramps, &states[..=steps]);
            for step in 1..=staying {
                self.recorder.sample(k + step, &states[step]);
            }
            k += staying;
            (values[0], states[0]) = (values[staying], states[staying]);
        }
        (*from, *state) = (values[0], states[0]);
        self.summary.steps += k - first;
        k
    }
}
