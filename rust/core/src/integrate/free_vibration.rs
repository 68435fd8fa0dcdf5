//! Free vibration of a preloaded body under a constant excitation: near its equilibrium by exact steps of the linearised equations.

use super::long_step::has_intervals;
use super::method::Method;
use super::step_control::StepControl;
use super::step_loop::Runner;
use crate::contacts::SwitchedEquations;
use crate::equations::{Equations, LONG_STEP, Linearized, LongStepBounds};
use crate::excitation::{Excitation, Forcing};
use crate::numeric::simd::dispatch;
use crate::system::State;

/// Linearised equations are prepared only if the excitation stays constant for so many long steps: preparing them takes as long as some hundred
/// steps.
const LEAST_LONG_STEPS: usize = 8;

/// Whether free vibration is tried at sample `k`: for all scenes at the same samples, so that those that run side by side are free together.
#[inline(always)]
pub(super) fn is_tried_at(k: usize) -> bool {
    k % LONG_STEP == 1
}

/// Most long steps at once: at most some milliseconds, so that a run can be stopped.
const MOST_LONG_STEPS: usize = 256;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Moves a body from sample `k`, at which `state` is, as far as the linearised equations hold; returns the sample reached, to which
    /// `state` then belongs. Those up to it are recorded. Which samples these are does not depend on the record.
    #[inline(always)]
    pub(super) fn vibrate_freely(&mut self, forcing: &Forcing, k: usize, state: &mut State) -> usize {
        let excitation = self.recorder.excitation;
        // Without a load scale no error counts.
        if !is_tried_at(k) || k + LONG_STEP >= excitation.count() || self.summary.load_scale == 0.0 {
            return k;
        }
        let h = excitation.interval(k);
        if !is_constant(excitation, forcing, k, h) {
            return k;
        }
        dispatch!(vibrate(self, forcing, k, h, state))
    }
}

/// Whether the excitation is constant over a long step from sample `k` on, in intervals of `h` s. False if fewer are left.
#[inline(always)]
fn is_constant(excitation: &Excitation, forcing: &Forcing, k: usize, h: f64) -> bool {
    has_intervals(excitation, k, h) && forcing.is_constant(excitation, k..k + LONG_STEP + 1)
}

/// [`Runner::vibrate_freely`].
#[inline(always)]
fn vibrate<M: Method, C: SwitchedEquations>(
    runner: &mut Runner<M, C>,
    forcing: &Forcing,
    mut k: usize,
    h: f64,
    state: &mut State,
) -> usize {
    let Runner { method, memory, equations, steps, recorder, summary, .. } = runner;
    let (excitation, equations) = (recorder.excitation, equations.equations());
    let mut values = [0.0; 9];
    forcing.sample(excitation, k, &mut values);
    let mut prepares = true;
    for long_step in 1..LEAST_LONG_STEPS {
        prepares = prepares && is_constant(excitation, forcing, k + long_step * LONG_STEP, h);
    }
    let excited = (forcing, &values);
    let Some(linearized) = method.linearized(memory, equations, excited, h, state, prepares) else {
        return k;
    };
    let leaves_out = !recorder.record.needs_all();
    let mut bounds = steps.linear_bounds(linearized, equations, h, state);
    let last = k + MOST_LONG_STEPS * LONG_STEP;
    while let Some(known) = bounds
        && k < last
        && is_constant(excitation, forcing, k, h)
    {
        let left_out = leaves_out && recorder.leave_out(LONG_STEP - 1, &known.samples);
        if left_out {
            *state = linearized.long_step(state);
            recorder.sample(k + LONG_STEP, state);
            summary.steps += 1;
        } else {
            let states = linearized.steps(state);
            recorder.samples(k + 1, &states);
            *state = states[LONG_STEP - 1];
            summary.steps += LONG_STEP;
        }
        k += LONG_STEP;
        // After a refusal narrower bounds may be agreed to.
        if !left_out || !linearized.holds(&known, state) {
            bounds = steps.linear_bounds(linearized, equations, h, state);
        }
    }
    k
}

impl StepControl {
    /// Bounds on the states at the next samples, if the linearised `equations` are accurate enough within them.
    #[inline(always)]
    fn linear_bounds<E: Equations>(
        &self,
        linearized: &Linearized,
        equations: &E,
        h: f64,
        state: &State,
    ) -> Option<LongStepBounds> {
        let (controller, time) = (self.controller.as_ref()?, LONG_STEP as f64 * h);
        // Over longer intervals a body may swing out and back, of which the samples show nothing.
        if !controller.allows(h) {
            return None;
        }
        let bounds = linearized.bounds(state);
        let force_error = linearized.force_error(equations, &bounds);
        let mut error = [0.0; 12];
        for i in 0..6 {
            error[6 + i] = time * force_error[i];
        }
        // Not for NaN.
        if self.norm.of(&error) <= controller.most_linearization_error(time) { Some(bounds) } else { None }
    }
}
