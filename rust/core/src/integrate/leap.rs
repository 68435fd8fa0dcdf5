//! Leaps over many samples at once, where the record needs none of those in between and no contact can change. Only with `std`.

use super::leap_plan::LeapPlan;
use super::method::Method;
use super::step_loop::Runner;
use crate::contacts::SwitchedEquations;
use crate::equations::{LEAP, LeapSamples};
use crate::excitation::{Excitation, Forcing, Values};
use crate::numeric::simd::dispatch;
use crate::system::State;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Leaps from sample `k`, at which `state` is, if possible; returns the sample reached, to which `state` and `values` then belong.
    #[inline(never)]
    pub(super) fn leap(
        &mut self,
        plan: &mut LeapPlan,
        forcing: &Forcing,
        k: usize,
        [state, next]: [&mut &mut State; 2],
        values: &mut Values,
    ) -> Option<usize> {
        let excitation = self.recorder.excitation;
        let h = excitation.interval(k);
        let leaps = if !has_intervals(excitation, k, h) || self.budget.is_due(self.work()) {
            0
        } else {
            dispatch!(leaps(self, &mut plan.samples, forcing, k, h, state, next))
        };
        let reached = k + leaps * LEAP;
        plan.note(k, reached);
        if leaps == 0 {
            return None;
        }
        core::mem::swap(state, next);
        forcing.sample(excitation, reached, values);
        self.recorder.sample(reached, state);
        self.summary.steps += leaps;
        Some(reached)
    }
}

/// Whether the intervals of a leap from sample `k` have the length `h`; false if fewer are left.
#[inline(always)]
pub(super) fn has_intervals(excitation: &Excitation, k: usize, h: f64) -> bool {
    if k + LEAP >= excitation.count() {
        return false;
    }
    let mut equal = true;
    for k in k..k + LEAP {
        equal &= excitation.interval(k) == h;
    }
    equal
}

/// Most leaps at once: some microseconds, so that a run can be stopped.
const MOST_LEAPS: usize = 64;

/// Leaps from sample `k` into `next`; returns their number, 0 if none is possible.
#[inline(always)]
fn leaps<M: Method, C: SwitchedEquations>(
    runner: &mut Runner<M, C>,
    samples: &mut LeapSamples,
    forcing: &Forcing,
    k: usize,
    h: f64,
    state: &State,
    next: &mut State,
) -> usize {
    let Runner { method, memory, equations, recorder, .. } = runner;
    let Some(leap) = method.leap(memory, equations.equations(), forcing, h) else { return 0 };
    let excitation = recorder.excitation;
    forcing.samples(excitation, k, samples);
    let bounds = leap.bounds(equations.equations(), forcing, samples, state);
    // The record is asked last: one that agrees counts these samples as passed. It gets the last one, after which parts between samples
    // count again.
    if !equations.stays_over(&bounds) || !recorder.leave_out(LEAP - 1, &bounds.samples) {
        return 0;
    }
    *next = leap.apply(samples, state);
    equations.leapt();
    // Under a constant excitation, these bounds often hold for the next leaps too. Their excitation has the same effect.
    let (mut leaps, mut last) = (1, *next);
    if forcing.is_constant(excitation, k..k + LEAP + 1) && leap.holds(&bounds, &last) {
        let effect = leap.apply(samples, &[0.0; 12]);
        while leaps < MOST_LEAPS
            && has_intervals(excitation, k + leaps * LEAP, h)
            && forcing.is_constant(excitation, k + leaps * LEAP..k + (leaps + 1) * LEAP + 1)
            && leap.holds(&bounds, &last)
        {
            last = leap.repeat(&effect, &last);
            leaps += 1;
        }
    }
    if leaps > 1 && recorder.leave_out((leaps - 1) * LEAP, &bounds.samples) {
        *next = last;
        return leaps;
    }
    1
}
