//! A fast path: intervals of equal length without a contact change, and with no step error or a small one, by one prepared step each.

use super::exact_steps::{BLOCK, Block, FIRST_BLOCK};
use super::method::{Method, Output};
use super::step_loop::Runner;
use crate::contacts::SwitchedEquations;
use crate::equations::Equations;
use crate::error::RunError;
use crate::excitation::{Forcing, Instant, Ramp, Values};
use crate::system::State;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Steps from sample to sample, from sample `k` with `state` on, up to sample `until`, as far as the method has an exact step ready and
    /// the equations do not change; returns the sample reached, to which `state` and the values `from` then belong. The states are those of
    /// [`Runner::step_over`] up to rounding; its preparations for steps that end within an interval are left out.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn step_equal_intervals(
        &mut self,
        forcing: &Forcing,
        mut k: usize,
        until: usize,
        [state, next]: [&mut &mut State; 2],
        [from, to]: [&mut &mut Values; 2],
    ) -> usize {
        let work = self.work();
        let Self { method, memory, equations, recorder, budget, summary, .. } = self;
        let excitation = recorder.excitation;
        let (key, h) = (equations.equations().key(), excitation.interval(k));
        let Some(steps) = method.exact_steps(memory, h, key) else { return k };
        let (first, last) = (k, usize::min(until, excitation.count() - 1));
        // The caller looks up the budget.
        let until = usize::min(last, k + budget.pause.saturating_sub(work));
        let mut length = FIRST_BLOCK;
        while k < until && excitation.interval(k) == h {
            // Pairs begin at even samples, so that rounding depends little on where a step_equal_intervals begins.
            if let Some(two) = steps.two
                && k.is_multiple_of(2)
            {
                let intervals = k..usize::min(last, k + length);
                let count = steps.block.fill(two, excitation, forcing, h, intervals, state);
                if count > 0 {
                    let block = &*steps.block;
                    let done = steps_that_stay(*equations, forcing, h, (k, state), block, count);
                    if done > 0 {
                        recorder.samples(k + 1, &block.states[..done]);
                        (**state, **from) = (block.states[done - 1], block.values[done]);
                        k += done;
                    }
                    if done < count {
                        break;
                    }
                    length = usize::min(2 * length, BLOCK);
                    continue;
                }
            }
            forcing.sample(excitation, k + 1, to);
            **next = steps.one.apply(state, from, to);
            let begin = Instant { first: k, until: k + 1, since: 0.0 };
            if !equations.stays(&Ramp::whole(h, [&**from, &**to], forcing, begin), state, next) {
                break;
            }
            core::mem::swap(state, next);
            core::mem::swap(from, to);
            k += 1;
            recorder.sample(k, state);
        }
        summary.steps += k - first;
        k
    }

    /// Steps from sample `k`, at which `state` and the values `from` are, to the next, if a single step has a small enough error; true if it
    /// does. For methods with a step error whose steps are cheapest where their length recurs.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn whole_interval(
        &mut self,
        forcing: &Forcing,
        k: usize,
        [state, next]: [&mut &mut State; 2],
        [from, to]: [&mut &mut Values; 2],
    ) -> Result<bool, RunError> {
        let excitation = self.recorder.excitation;
        let h = excitation.interval(k);
        if !self.may_be_whole(h) {
            return Ok(false);
        }
        self.look_up_budget(k, state)?;
        forcing.sample(excitation, k + 1, to);
        let begin = Instant { first: k, until: k + 1, since: 0.0 };
        let ramp = Ramp::whole(h, [&**from, &**to], forcing, begin);
        let error;
        (**next, error) = self.method.step(self.equations.equations(), self.memory, &ramp, state);
        let error = self.steps.norm.of(&error);
        if !self.is_whole(h, error) {
            return Ok(false);
        }
        core::mem::swap(state, next);
        core::mem::swap(from, to);
        self.recorder.sample(k + 1, state);
        Ok(true)
    }

    /// Whether a single step over an interval of `h` s is worth trying: after one over which more were needed, if the step size allows it.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn may_be_whole(&mut self, h: f64) -> bool {
        match (&mut self.steps.controller, self.recorder.output) {
            (Some(controller), Output::Samples) => {
                controller.allows(h) && (self.steps.was_whole || controller.split(h) == 1.0)
            }
            _ => false,
        }
    }

    /// Whether a single step over an interval of `h` s is accepted with this error; counts it.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn is_whole(&mut self, h: f64, error: f64) -> bool {
        let Some(controller) = &mut self.steps.controller else { return false };
        // Not for NaN either.
        self.steps.was_whole = error <= controller.most_error(h);
        if self.steps.was_whole {
            self.summary.steps += 1;
        } else {
            controller.accept(h, error, false, || 0.0);
            self.summary.rejected += 1;
        }
        self.steps.was_whole
    }

    /// Looks up the budget at sample `k`, if that is due.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn look_up_budget(&mut self, k: usize, state: &State) -> Result<(), RunError> {
        let steps = self.summary.steps + self.summary.rejected;
        let work = self.work();
        if self.budget.is_due(work) {
            let excitation = self.recorder.excitation;
            let (at, other) = ([excitation.time(k), excitation.interval(k)], self.steps.other);
            self.budget.pause = self.budget.look_up(work, steps, self.recorder.record, state, at, other)?;
        }
        Ok(())
    }
}

/// Number of steps from the start of a block, at sample `first` and in `state`, without a contact change. The block has `count` steps.
#[inline(always)]
fn steps_that_stay<C: SwitchedEquations>(
    equations: &mut C,
    forcing: &Forcing,
    h: f64,
    (first, state): (usize, &State),
    block: &Block,
    count: usize,
) -> usize {
    let (values, states) = (&block.values[..=count], &block.states[..count]);
    let mut done = 0;
    loop {
        done += equations.steps_without_change(h, forcing, &values[done..], &states[done..]);
        if done == count {
            return count;
        }
        let begin = Instant { first: first + done, until: first + done + 1, since: 0.0 };
        let ramp = Ramp::whole(h, [&values[done], &values[done + 1]], forcing, begin);
        let before = if done == 0 { state } else { &states[done - 1] };
        if !equations.stays(&ramp, before, &states[done]) {
            return done;
        }
        done += 1;
    }
}
