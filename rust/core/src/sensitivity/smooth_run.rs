//! The run of a system with preloaded links and its derivatives side by side, by the explicit method of order 8 of Dormand and Prince.
//!
//! Each step is as short as the state and each of the derivatives need it. The derivatives cost nothing in steps that the state alone
//! rejects.

use super::error::SensitivityError;
use super::order_8::{ERROR_3, ERROR_5, NODES, STAGE, STAGES, STEP};
use super::smooth::{NonlinearResiduals, SmoothSystem};
use super::system::VariedSystem;
use crate::error::{OtherMethod, RunError, Stopped};
use crate::excitation::{Excitation, between};
use crate::numeric::float::{add_scaled, norm};
use crate::numeric::simd::dispatch;
use crate::numeric::watch::Watch;
use crate::system::{Input, State, energy_norm, finite};

/// Error of a step relative to the largest state, or derivative of it, so far.
pub(super) const TOLERANCE: f64 = 1e-11;

/// Shortest step, as a fraction of its interval: in so short a time no slope matters.
const SHORTEST: f64 = 1e-9;

/// Part of the largest derivative that the terms of its equation could cause, below which it may be rounding.
const ROUNDING_MAY_BE: f64 = 1e-4;

/// Smallest change of the step size.
const LEAST_FACTOR: f64 = 0.2;

/// Work that every run may take, some ten seconds. A step takes one for each column, and as much as STATE columns for the state.
const MOST_WORK: usize = 4_000_000;
const STATE: usize = 10;

/// Steps for each interval between samples beside that.
const STEPS_PER_INTERVAL: usize = 100;

/// Steps of the shortest length after which an interval is given up: edges take some tens of them.
const MOST_SHORTEST_STEPS: usize = 10_000;

/// Longest step that damped modes allow, in radians of the fastest: the stability limit of the method on the real axis, 6.1, rounded up.
const MOST_RADIANS_PER_STEP: f64 = 7.0;

/// Steps between two looks at the watch.
const BETWEEN: usize = 64;

/// A run at the samples of an excitation.
pub(super) struct SmoothRun<'a> {
    pub smooth: &'a SmoothSystem,
    pub varied: &'a VariedSystem,
    pub excitation: &'a Excitation<'a>,
    pub watch: Watch<'a>,
}

impl SmoothRun<'_> {
    /// The states at the samples from the first one on, and their derivatives by each column (column, sample).
    ///
    /// # Errors
    /// [`RunError`], [`Stopped`].
    pub(super) fn run(
        &self,
        start: State,
        quasi_static: bool,
    ) -> Result<(Vec<State>, Vec<State>), SensitivityError> {
        let count = self.excitation.count();
        self.check_length()?;
        let mut out = (vec![start; count], vec![[0.0; 12]; self.smooth.columns.len() * count]);
        let mut integrator = IntegratorState::new(self, start);
        if quasi_static {
            let input = self.excitation.input(0);
            self.smooth.set_residuals(self.varied, &start, &mut integrator.residuals[0]);
            for (column, tangent) in integrator.tangents.iter_mut().enumerate() {
                let fixed = self.smooth.rate_derivative(
                    (self.varied, column),
                    &integrator.residuals[0],
                    &start,
                    &input,
                );
                *tangent = self.smooth.balanced(&integrator.residuals[0], &fixed);
                out.1[column * count] = *tangent;
            }
        }
        for k in 0..count - 1 {
            dispatch!(pass_interval(self, &mut integrator, k))?;
            out.0[k + 1] = integrator.state;
            for (column, tangent) in integrator.tangents.iter().enumerate() {
                out.1[column * count + k + 1] = *tangent;
            }
        }
        if !out.1.iter().all(finite) {
            return Err(RunError::OutOfRange.into());
        }
        Ok(out)
    }

    /// Most steps.
    fn most_steps(&self) -> usize {
        MOST_WORK / (STATE + self.smooth.columns.len()) + STEPS_PER_INTERVAL * self.excitation.count()
    }

    /// Refuses a motion that cannot be passed in the number of steps that it may take.
    fn check_length(&self) -> Result<(), RunError> {
        let system = &self.varied.system;
        // An overdamped mode decays at a rate of about its damping.
        let rate = |i: usize| {
            f64::max(system.frequencies()[i], system.modal_damping()[(i, i)] - system.frequencies()[i])
        };
        let fastest = (0..6).map(rate).fold(0.0, f64::max);
        let duration = self.excitation.duration();
        let (steps, most) = (duration * fastest / MOST_RADIANS_PER_STEP, self.most_steps() as f64);
        if steps > most {
            return Err(RunError::TooLong { duration, steps, most, fastest, other: OtherMethod::None });
        }
        Ok(())
    }
}

/// A state and its derivatives on their way.
struct IntegratorState {
    state: State,
    tangents: Vec<State>,
    /// Of both, the largest size so far.
    scale: f64,
    scales: Vec<f64>,
    /// Length of the next step, s, if no sample comes before.
    step: f64,
    steps: usize,
    // Of each stage of the last step.
    residuals: Vec<NonlinearResiduals>,
    states: [State; STAGES],
    inputs: [Input; STAGES],
    rates: [State; STAGES],
    next_tangents: Vec<State>,
}

impl IntegratorState {
    fn new(run: &SmoothRun, state: State) -> Self {
        let system = &run.varied.system;
        let fastest = f64::max(system.highest_frequency(), f64::MIN_POSITIVE);
        let peak = run.excitation.peak();
        let effect = |influence: &[[f64; 8]; 9]| -> f64 {
            influence.iter().zip(&peak).map(|(column, value)| norm(column) * value).sum()
        };
        // At rest, and of a preload near it, the terms of a nonlinear link cancel, up to their rounding.
        let rows = || run.smooth.links.iter().map(|&link| (link, &system.rows()[link]));
        let loads: f64 = rows().map(|(_, row)| norm(&row.rate) * row.load.abs()).sum();
        let scale = ROUNDING_MAY_BE * (effect(system.influence()) + loads) / fastest;
        let moved = effect(system.influence()) / fastest;
        let scales = run.smooth.columns.iter().zip(&run.varied.derivatives).map(|(of, by)| {
            let equations = &of.linear;
            let matrix = norm(equations.matrix.as_flattened());
            let terms = rows().map(|(link, row)| {
                let by = &by.links[link];
                let (law, load) =
                    (row.link.law(), row.load.abs() + row.stiffness * moved * norm(&row.deflection));
                let own =
                    law.force_derivative(row.rest, &by.law).abs() + law.cancelling_derivative(&by.law) * load;
                norm(&row.rate) * ((row.stiffness * by.rest).abs() + by.load.abs() + own)
            });
            let links = terms.sum::<f64>();
            ROUNDING_MAY_BE * (effect(&equations.influence) + links + matrix * scale / ROUNDING_MAY_BE)
                / fastest
        });
        Self {
            state,
            tangents: vec![[0.0; 12]; run.smooth.columns.len()],
            scale: f64::max(scale, energy_norm(&state)),
            scales: scales.collect(),
            step: f64::INFINITY,
            steps: 0,
            residuals: vec![NonlinearResiduals::default(); STAGES],
            states: [[0.0; 12]; STAGES],
            inputs: [[0.0; 9]; STAGES],
            rates: [[0.0; 12]; STAGES],
            next_tangents: vec![[0.0; 12]; run.smooth.columns.len()],
        }
    }
}

/// Passes the interval after a sample.
#[cfg_attr(feature = "std", inline(always))]
fn pass_interval(
    run: &SmoothRun,
    integrator: &mut IntegratorState,
    sample: usize,
) -> Result<(), SensitivityError> {
    let (length, start) = (run.excitation.interval(sample), run.excitation.time(sample));
    let ends = [run.excitation.input(sample), run.excitation.input(sample + 1)];
    let (mut done, mut shortest_steps, most) = (0.0, 0, run.most_steps());
    while done < length {
        integrator.steps += 1;
        if integrator.steps.is_multiple_of(BETWEEN) && run.watch.stops() {
            return Err(Stopped::Interrupted.into());
        }
        let rest = length - done;
        // Equal steps to the end, so that no tiny one is left.
        let shortest = SHORTEST * length;
        let step = f64::max(integrator.step, shortest);
        let h = if step >= rest { rest } else { rest / (rest / step).ceil() };
        if integrator.steps > most {
            let fastest = run.varied.system.highest_frequency();
            let (time, steps, other) = (start + done, integrator.steps, OtherMethod::None);
            return Err(RunError::TooManySteps { time, step: h, steps, fastest, other }.into());
        }
        let least = h <= shortest;
        shortest_steps += usize::from(least);
        let (next, mut ratio) = state_step(run, integrator, [done / length, h / length], h, &ends);
        // At an edge the slope of a law has no derivative, or one without bound, and the estimates of the errors are too small.
        let passes = run.smooth.passes_edge(run.varied, &integrator.state, &next);
        if ratio <= 1.0 && !passes || least {
            ratio = f64::max(ratio, tangent_steps(run, integrator, h));
        }
        if !finite(&next) || ratio.is_nan() {
            return Err(RunError::OutOfRange.into());
        }
        if shortest_steps > MOST_SHORTEST_STEPS {
            let (time, other) = (start + done, OtherMethod::None);
            return Err(RunError::StepTooSmall { time, step: h, error: ratio, other }.into());
        }
        let factor = if passes { LEAST_FACTOR } else { (0.9 * ratio.powf(-0.125)).clamp(LEAST_FACTOR, 6.0) };
        if (ratio > 1.0 || passes) && !least {
            integrator.step = h * factor;
            continue;
        }
        // A step cut short by a sample tells little of longer ones.
        integrator.step = if h < 0.5 * integrator.step && integrator.step < f64::INFINITY {
            integrator.step
        } else {
            h * factor
        };
        integrator.state = next;
        integrator.scale = f64::max(integrator.scale, energy_norm(&next));
        core::mem::swap(&mut integrator.tangents, &mut integrator.next_tangents);
        for (scale, tangent) in integrator.scales.iter_mut().zip(&integrator.tangents) {
            *scale = f64::max(*scale, energy_norm(tangent));
        }
        done = if h == rest { length } else { done + h };
    }
    Ok(())
}

/// The next state, and its error over the tolerance. `[from, share]`: start and length of the step as fractions of the interval.
#[cfg_attr(feature = "std", inline(always))]
fn state_step(
    run: &SmoothRun,
    integrator: &mut IntegratorState,
    [from, share]: [f64; 2],
    h: f64,
    ends: &[Input; 2],
) -> (State, f64) {
    for stage in 0..STAGES {
        let at = from + share * NODES[stage];
        integrator.inputs[stage] = between(ends, at);
        let mut state = integrator.state;
        for (rate, factor) in integrator.rates.iter().zip(STAGE[stage]) {
            add_scaled(&mut state, rate, h * factor);
        }
        run.smooth.set_residuals(run.varied, &state, &mut integrator.residuals[stage]);
        integrator.rates[stage] =
            run.smooth.rate(&integrator.residuals[stage], &state, &integrator.inputs[stage]);
        integrator.states[stage] = state;
    }
    let (next, error) = end_of(&integrator.state, &integrator.rates, h);
    let scale = f64::max(integrator.scale, energy_norm(&next));
    (next, if error == 0.0 { 0.0 } else { error / (TOLERANCE * scale) })
}

/// The next derivatives, and the largest of their errors over the tolerance.
#[cfg_attr(feature = "std", inline(always))]
fn tangent_steps(run: &SmoothRun, integrator: &mut IntegratorState, h: f64) -> f64 {
    let mut worst = 0.0;
    for column in 0..integrator.tangents.len() {
        let start = integrator.tangents[column];
        let mut rates = [[0.0; 12]; STAGES];
        for stage in 0..STAGES {
            let (residuals, state, input) =
                (&integrator.residuals[stage], &integrator.states[stage], &integrator.inputs[stage]);
            let fixed = run.smooth.rate_derivative((run.varied, column), residuals, state, input);
            let mut tangent = start;
            for (rate, factor) in rates.iter().zip(STAGE[stage]) {
                add_scaled(&mut tangent, rate, h * factor);
            }
            rates[stage] = run.smooth.tangent_rate(residuals, &fixed, &tangent);
        }
        let (next, error) = end_of(&start, &rates, h);
        integrator.next_tangents[column] = next;
        let scale = f64::max(integrator.scales[column], energy_norm(&next));
        if error != 0.0 {
            worst = f64::max(worst, error / (TOLERANCE * scale));
        }
    }
    worst
}

/// The end of a step, and its estimated error.
#[cfg_attr(feature = "std", inline(always))]
fn end_of(start: &State, rates: &[State; STAGES], h: f64) -> (State, f64) {
    let (mut next, mut fifth, mut third) = (*start, [0.0; 12], [0.0; 12]);
    for stage in 0..STAGES {
        add_scaled(&mut next, &rates[stage], h * STEP[stage]);
        add_scaled(&mut fifth, &rates[stage], h * ERROR_5[stage]);
        add_scaled(&mut third, &rates[stage], h * ERROR_3[stage]);
    }
    let (fifth, third) = (energy_norm(&fifth), 0.1 * energy_norm(&third));
    let both = fifth.hypot(third);
    (next, if both == 0.0 { both } else { fifth * (fifth / both) })
}
