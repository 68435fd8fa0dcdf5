//! Long steps over many samples at once, where the record needs none of those in between and no contact can change. Only with `std`.

use super::long_step_plan::LongStepPlan;
use super::method::Method;
use super::step_loop::Runner;
use crate::contacts::SwitchedEquations;
use crate::equations::{LONG_STEP, LongStepSamples};
use crate::excitation::{Excitation, Forcing, Values};
use crate::numeric::simd::dispatch;
use crate::system::State;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Long steps from sample `k`, at which `state` is, if possible; returns the sample reached, to which `state` and `values` then belong.
    #[inline(never)]
    pub(super) fn long_step(
        &mut self,
        plan: &mut LongStepPlan,
        forcing: &Forcing,
        k: usize,
        [state, next]: [&mut &mut State; 2],
        values: &mut Values,
    ) -> Option<usize> {
        let excitation = self.recorder.excitation;
        let h = excitation.interval(k);
        let long_steps = if !has_intervals(excitation, k, h) || self.budget.is_due(self.work()) {
            0
        } else {
            dispatch!(long_steps(self, &mut plan.samples, forcing, k, h, state, next))
        };
        let reached = k + long_steps * LONG_STEP;
        plan.note(k, reached);
        if long_steps == 0 {
            return None;
        }
        core::mem::swap(state, next);
        forcing.sample(excitation, reached, values);
        self.recorder.sample(reached, state);
        self.summary.steps += long_steps;
        Some(reached)
    }
}

/// Whether the intervals of a long step from sample `k` have the length `h`; false if fewer are left.
#[inline(always)]
pub(super) fn has_intervals(excitation: &Excitation, k: usize, h: f64) -> bool {
    if k + LONG_STEP >= excitation.count() {
        return false;
    }
    let mut equal = true;
    for k in k..k + LONG_STEP {
        equal &= excitation.interval(k) == h;
    }
    equal
}

/// Most long steps at once: some microseconds, so that a run can be stopped.
const MOST_LONG_STEPS: usize = 64;

/// Long steps from sample `k` into `next`; returns their number, 0 if none is possible.
#[inline(always)]
fn long_steps<M: Method, C: SwitchedEquations>(
    runner: &mut Runner<M, C>,
    samples: &mut LongStepSamples,
    forcing: &Forcing,
    k: usize,
    h: f64,
    state: &State,
    next: &mut State,
) -> usize {
    let Runner { method, memory, equations, recorder, .. } = runner;
    let Some(long_step) = method.long_step(memory, equations.equations(), forcing, h) else { return 0 };
    let excitation = recorder.excitation;
    forcing.samples(excitation, k, samples);
    let bounds = long_step.bounds(equations.equations(), forcing, samples, state);
    // The record is asked last: one that agrees counts these samples as passed. It gets the last one, after which parts between samples
    // count again.
    if !equations.stays_over(&bounds) || !recorder.leave_out(LONG_STEP - 1, &bounds.samples) {
        return 0;
    }
    *next = long_step.apply(samples, state);
    equations.invalidate_bounds();
    // Under a constant excitation, these bounds often hold for the next long steps too. Their excitation has the same effect.
    let (mut long_steps, mut last) = (1, *next);
    if forcing.is_constant(excitation, k..k + LONG_STEP + 1) && long_step.holds(&bounds, &last) {
        let effect = long_step.apply(samples, &[0.0; 12]);
        while long_steps < MOST_LONG_STEPS
            && has_intervals(excitation, k + long_steps * LONG_STEP, h)
            && forcing
                .is_constant(excitation, k + long_steps * LONG_STEP..k + (long_steps + 1) * LONG_STEP + 1)
            && long_step.holds(&bounds, &last)
        {
            last = long_step.repeat(&effect, &last);
            long_steps += 1;
        }
    }
    if long_steps > 1 && recorder.leave_out((long_steps - 1) * LONG_STEP, &bounds.samples) {
        *next = last;
        return long_steps;
    }
    1
}
