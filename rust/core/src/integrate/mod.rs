//! One loop for every method: from knot to knot.

mod control;
mod drive;
mod exact;
mod kept;
mod radau;
mod rk45;
mod tableau;

pub use control::{Control, load_scale};
pub use drive::Ramp;
pub(crate) use drive::Values;
pub use exact::Exact;
pub use radau::Radau;
pub use rk45::Rk45;

use control::{Controller, ErrorNorm};
use drive::Drive;

use crate::error::RunError;
use crate::excitation::Excitation;
use crate::float::{ceil, sqrt};
use crate::record::Record;
use crate::simd::{Kernel, widest};
use crate::system::{State, System};

/// A way to advance the state over one step. It never chooses the step: [`run`] and [`Control`] do.
pub trait Method {
    /// What one run owns: stages, factorisations.
    type Memory;
    /// Order of the error estimate of [`Method::step`]; none for a method without step error.
    const ERROR_ORDER: Option<u32>;

    /// Memory for one run.
    fn memory(&self, system: &System) -> Self::Memory;

    /// The state after the step, and the estimated error of it.
    fn step(&self, system: &System, memory: &mut Self::Memory, ramp: &Ramp, state: &State) -> (State, State);

    /// The state at the fraction `theta` of the step that [`Method::step`] last made, from `state` (dense output).
    fn between(
        &self,
        system: &System,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
        theta: f64,
    ) -> State;
}

/// Which instants a run records.
#[derive(Debug, Clone, Copy)]
pub enum Output<'a> {
    /// Every sample of the excitation.
    Samples,
    /// These times, ascending, s; within a step by dense output.
    Times(&'a [f64]),
}

/// What a run did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Instants recorded.
    pub recorded: usize,
    /// The load that the tolerance was relative to, N.
    pub load_scale: f64,
}

/// Runs a system from static equilibrium through an excitation and hands each instant to `record`.
///
/// # Errors
/// [`RunError`] with time, step and error; what was recorded until then stays in `record`.
pub fn run<M: Method, R: Record>(
    system: &System,
    method: &M,
    control: Control,
    excitation: &Excitation,
    output: Output,
    record: &mut R,
) -> Result<Summary, RunError> {
    widest(Job { system, method, control, excitation, output, record })
}

/// All that [`run`] is given.
struct Job<'a, M, R> {
    system: &'a System,
    method: &'a M,
    control: Control,
    excitation: &'a Excitation<'a>,
    output: Output<'a>,
    record: &'a mut R,
}

impl<M: Method, R: Record> Kernel for Job<'_, M, R> {
    type Output = Result<Summary, RunError>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { system, method, control, excitation, output, record } = self;
        control.check()?;
        check_output(output, excitation)?;
        let expected = match output {
            Output::Samples => excitation.count(),
            Output::Times(times) => times.len(),
        };
        record.reserve(expected)?;

        let peak = excitation.peak();
        let load_scale = control::scale_of(system, &peak);
        let norm = ErrorNorm::new(system, load_scale);
        let mut controller = match (control, M::ERROR_ORDER) {
            (Control::Adaptive { rtol }, Some(order)) => {
                Some(Controller::new(rtol, system, excitation, order))
            }
            _ => None,
        };
        let mut memory = method.memory(system);
        let mut state: State = [0.0; 12];
        let mut summary = Summary { steps: 0, rejected: 0, recorded: 0, load_scale };
        let drive = Drive::new(system, &peak);
        let mut reach = 0.0;
        let (mut from, mut to) = (&mut [0.0; 9], &mut [0.0; 9]);
        drive.sample(excitation, 0, from);

        if let Output::Samples = output {
            record.instant(excitation.time(0), &state, &excitation.input(0));
            summary.recorded += 1;
        }
        for k in 1..excitation.count() {
            let start = excitation.time(k - 1);
            let length = excitation.interval(k - 1);
            drive.sample(excitation, k, to);
            let whole = Ramp { h: length, start: from, end: to, drive: &drive };
            let mut parts;
            let mut done = 0.0;
            if let Control::Fixed { step } = control
                && step < smallest_step(start, length)
            {
                return Err(RunError::Step { got: step });
            }
            while done < length {
                let rest = length - done;
                let splits = match (&mut controller, control) {
                    (Some(controller), _) => controller.split(rest),
                    (None, Control::Fixed { step }) => f64::max(1.0, ceil(rest / step * (1.0 - 1e-12))),
                    (None, Control::Adaptive { .. }) => 1.0,
                };
                let ramp = if splits == 1.0 && done == 0.0 {
                    whole
                } else {
                    let h = rest / splits;
                    let end = if splits == 1.0 { 1.0 } else { (done + h) / length };
                    parts = [whole.values(done / length), whole.values(end)];
                    Ramp { h, start: &parts[0], end: &parts[1], drive: &drive }
                };
                let h = ramp.h;
                let (next, error) = method.step(system, &mut memory, &ramp, &state);
                let mut sound = finite(&next);
                if M::ERROR_ORDER.is_some() && matches!(control, Control::Fixed { .. }) {
                    // Springs and dampers are passive: |s| grows no faster than |f|.
                    reach += ramp.impulse();
                    sound &= size(&next) <= DIVERGENCE * reach;
                }
                if !sound {
                    return Err(RunError::Diverged { time: start + done, step: h });
                }
                if let Some(controller) = &mut controller
                    && !controller.accept(h, norm.of(&error))
                {
                    summary.rejected += 1;
                    if h < smallest_step(start, length) {
                        let error = controller.ratio();
                        return Err(RunError::StepTooSmall { time: start + done, step: h, error });
                    }
                    continue;
                }
                if let Output::Times(times) = output {
                    let last = k + 1 == excitation.count() && splits == 1.0;
                    while let Some(&time) = times.get(summary.recorded) {
                        let theta = (time - start - done) / h;
                        if theta > 1.0 && !last {
                            break;
                        }
                        let theta = theta.clamp(0.0, 1.0);
                        let there = method.between(system, &mut memory, &ramp, &state, theta);
                        record.instant(time, &there, &excitation.input_at(time));
                        summary.recorded += 1;
                    }
                }
                state = next;
                summary.steps += 1;
                done = if splits == 1.0 { length } else { done + h };
            }
            core::mem::swap(&mut from, &mut to);
            if let Output::Samples = output {
                record.instant(excitation.time(k), &state, &excitation.input(k));
                summary.recorded += 1;
            }
        }
        if let Output::Times(times) = output {
            // All that is left when the excitation has no duration.
            for &time in &times[summary.recorded..] {
                record.instant(time, &state, &excitation.input_at(time));
                summary.recorded += 1;
            }
        }
        Ok(summary)
    }
}

/// How far beyond what the excitation can reach a state may be before the method, not the machine, has brought it there.
const DIVERGENCE: f64 = 100.0;

/// Square root of twice the energy.
#[inline(always)]
fn size(state: &State) -> f64 {
    sqrt(state.iter().map(|entry| entry * entry).sum())
}

/// Whether no entry is infinite or NaN.
#[inline(always)]
fn finite(state: &State) -> bool {
    // Four sums side by side, of zeros unless an entry is not finite.
    let mut sums = [0.0; 4];
    for entries in state.as_chunks::<4>().0 {
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum += 0.0 * entry;
        }
    }
    sums == [0.0; 4]
}

/// The step below which `time + step` or a fraction of the interval `length` is rounding, s.
fn smallest_step(time: f64, length: f64) -> f64 {
    f64::max(4.0 * f64::EPSILON * time.abs(), 1e-9 * length)
}

fn check_output(output: Output, excitation: &Excitation) -> Result<(), RunError> {
    let Output::Times(times) = output else { return Ok(()) };
    let last = excitation.time(excitation.count() - 1);
    let mut from = excitation.time(0);
    for (index, &got) in times.iter().enumerate() {
        if !(from..=last).contains(&got) {
            return Err(RunError::OutputTime { index, got, range: [from, last] });
        }
        from = got;
    }
    Ok(())
}
