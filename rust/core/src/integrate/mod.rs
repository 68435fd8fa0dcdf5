//! One loop for every method: from knot to knot.

mod control;
mod course;
mod drive;
mod exact;
mod kept;
#[cfg(feature = "std")]
mod named;
mod radau;
mod rk45;
mod tableau;

pub use control::{Control, load_scale};
pub use drive::Ramp;
pub(crate) use drive::{Scaled, Values};
pub use exact::Exact;
#[cfg(feature = "std")]
pub use named::Named;
pub use radau::Radau;
pub use rk45::Rk45;

use control::{Controller, ErrorNorm};
use course::{Course, Steady};
use drive::Drive;

use crate::contacts::Contacts;
use crate::equations::Equations;
use crate::error::RunError;
use crate::excitation::Excitation;
use crate::float::{ceil, floor, sqrt};
use crate::record::Record;
use crate::simd::{Kernel, widest};
use crate::smooth::Smooth;
use crate::system::{Input, NO_INPUT, Rung, State, System};

/// A way to advance the state over one step. It never chooses the step: [`run`] and [`Control`] do.
pub trait Method {
    /// What one run owns: stages, factorisations.
    type Memory;
    /// Order of the error estimate of [`Method::step`]; none for a method without step error.
    const ERROR_ORDER: Option<u32>;

    /// Memory for one run.
    fn memory(&self) -> Self::Memory;

    /// The state after the step, and the estimated error of it.
    fn step<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
    ) -> (State, State);

    /// The state at the fraction `theta` of the step that [`Method::step`] last made, from `state` (dense output).
    fn between<E: Equations>(
        &self,
        equations: &E,
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
    /// Contact changes: times that a link passed to another segment of its law; zero where laws are linear or smooth.
    pub contact_changes: usize,
    /// The load that the tolerance was relative to, N.
    pub load_scale: f64,
}

/// Runs a system from static equilibrium through an excitation and hands each instant to `record`.
///
/// Where links change their stiffness in steps (clearance, sides, curves), every step ends at the next contact change, which is located on the
/// exact solution between two of them.
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
    run_scaled(system, method, control, &Scaled::whole(excitation), output, record)
}

/// [`run`] under the accelerations of an excitation times one factor and its external loads times another.
///
/// The record is called through a table: a loop for each kind of record would be so many times the code, and an instant costs far more than the
/// call.
pub(crate) fn run_scaled<M: Method>(
    system: &System,
    method: &M,
    control: Control,
    scaled: &Scaled,
    output: Output,
    record: &mut dyn Record,
) -> Result<Summary, RunError> {
    let excitation = scaled.excitation;
    if M::ERROR_ORDER.is_none()
        && let Some(link) = system.first_smooth()
    {
        return Err(RunError::NotExact { link });
    }
    control.check(M::ERROR_ORDER.is_some())?;
    check_output(output, excitation)?;
    let expected = match output {
        Output::Samples => excitation.count(),
        Output::Times(times) => times.len(),
    };
    record.reserve(expected)?;
    let load_scale = control::scale_of(system, &scaled.scaled_peak());
    if !load_scale.is_finite() {
        return Err(RunError::OutOfRange);
    }
    let drive = Drive::new(system, &scaled.peak, scaled.factors);
    let job = Job { system, method, control, excitation, output, record, drive, load_scale };
    match system.rung() {
        Rung::Linear => widest(Following { job, course: Steady(system) }),
        Rung::PiecewiseLinear => widest(Following { job, course: Contacts::new(system, load_scale) }),
        // Settled while compiling: for the exact method, which was refused above, this loop would be a tenth of the library.
        Rung::SmoothNonlinear if const { M::ERROR_ORDER.is_none() } => unreachable!("refused above"),
        Rung::SmoothNonlinear => widest(Following { job, course: Steady(&Smooth::new(system)) }),
    }
}

/// A run that can begin.
struct Job<'a, M> {
    system: &'a System,
    method: &'a M,
    control: Control,
    excitation: &'a Excitation<'a>,
    output: Output<'a>,
    record: &'a mut dyn Record,
    drive: Drive,
    load_scale: f64,
}

/// A run and the equations that it follows.
struct Following<'a, M, C> {
    job: Job<'a, M>,
    course: C,
}

impl<M: Method, C: Course> Kernel for Following<'_, M, C> {
    type Output = Result<Summary, RunError>;

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> Self::Output {
        let Self { job, mut course } = self;
        let Job { system, method, control, excitation, output, record, drive, load_scale } = job;
        let norm = ErrorNorm::new(system, load_scale);
        let mut controller = match (control, M::ERROR_ORDER) {
            (Control::Adaptive { rtol }, Some(order)) => {
                Some(Controller::new(rtol, system, excitation, order))
            }
            _ => None,
        };
        let mut memory = method.memory();
        // States in two places that change, and so in memory: in registers their entries would be taken apart and put together every step.
        let (mut state, mut next): (&mut State, &mut State) = (&mut [0.0; 12], &mut [0.0; 12]);
        let mut summary = Summary { steps: 0, rejected: 0, recorded: 0, contact_changes: 0, load_scale };
        let mut reach = 0.0;
        // Made for those alone that look at it.
        let looks = record.looks_at_input();
        let mut at: Input;
        let (mut from, mut to) = (&mut [0.0; 9], &mut [0.0; 9]);
        drive.sample(excitation, 0, from);
        // A method with a step error may step over samples between which the excitation does not bend; where contacts change, short steps are
        // looked into more cheaply.
        let merges = controller.is_some() && !C::Equations::PIECES;

        if let Output::Samples = output {
            record.instant(excitation.time(0), state, &excitation.input(0));
            summary.recorded += 1;
        }
        let mut k = 0;
        while k + 1 < excitation.count() {
            let until = if merges { drive.straight_until(excitation, k) } else { k + 1 };
            let start = excitation.time(k);
            let length = if until == k + 1 { excitation.interval(k) } else { excitation.time(until) - start };
            let between = until > k + 1;
            drive.sample(excitation, until, to);
            let whole = Ramp { h: length, start: from, end: to, drive: &drive, whole: true };
            k += 1;
            if let Control::Fixed { step } = control
                && step < SHORTEST * length
            {
                return Err(RunError::Step { got: step });
            }
            let mut parts;
            let mut done = 0.0;
            // Equal steps that are planned for the rest, and their length.
            let (mut left, mut h) = (0.0, 0.0);
            while done < length {
                let rest = length - done;
                let wanted = match (&mut controller, control) {
                    (Some(controller), _) => controller.split(rest),
                    (None, Control::Fixed { step }) if left == 0.0 => ceil(rest / step * (1.0 - 1e-12)),
                    (None, Control::Fixed { .. }) => left,
                    (None, Control::Adaptive { .. }) => 1.0,
                };
                if left == 0.0 || wanted > left || 1.25 * wanted <= left {
                    (left, h) = (1.0, rest);
                    if wanted > 1.0 {
                        left = f64::min(wanted, f64::max(1.0, floor(rest / length / SHORTEST)));
                        h = rest / left;
                    }
                }
                let mut last = left == 1.0;
                let mut ramp = if last && done == 0.0 {
                    h = length;
                    whole
                } else {
                    let end = if last { 1.0 } else { (done + h) / length };
                    parts = [whole.values(done / length), whole.values(end)];
                    Ramp { h, start: &parts[0], end: &parts[1], drive: &drive, whole: false }
                };
                let error;
                (*next, error) = method.step(course.equations(), &mut memory, &ramp, state);
                // Without step error nothing grows by itself, and what is out of range stays so: asked once, at the end.
                let mut sound = M::ERROR_ORDER.is_none() || finite(next);
                if let Some(controller) = &mut controller {
                    let error = if sound { norm.of(&error) } else { f64::INFINITY };
                    if !controller.accept(h, error, between) {
                        summary.rejected += 1;
                        if h <= 2.0 * SHORTEST * length {
                            let error = controller.ratio();
                            return Err(RunError::StepTooSmall { time: start + done, step: h, error });
                        }
                        left = 0.0;
                        continue;
                    }
                } else if M::ERROR_ORDER.is_some() {
                    // Springs and dampers are passive, and the start is the lowest point of their potential: |η'| grows no faster than |f|.
                    reach += ramp.impulse();
                    sound &= speed(next) <= DIVERGENCE * reach;
                }
                if !sound {
                    return Err(RunError::Diverged { time: start + done, step: h });
                }
                let change = course.first_change(&ramp, state, next);
                let shorter;
                if let Some(theta) = change {
                    shorter = ramp.values(theta);
                    ramp = Ramp { h: theta * h, end: &shorter, whole: false, ..ramp };
                    *next = if theta > 0.0 {
                        method.step(course.equations(), &mut memory, &ramp, state).0
                    } else {
                        *state
                    };
                    (h, left, last) = (ramp.h, 1.0, false);
                }
                if summary.steps + course.searched() >= MOST_STEPS {
                    return Err(RunError::TooManySteps { time: start + done, step: h });
                }
                if let Output::Samples = output {
                    while k < until && (last || excitation.time(k) - start <= done + h) {
                        let theta = f64::min((excitation.time(k) - start - done) / h, 1.0);
                        let there = method.between(course.equations(), &mut memory, &ramp, state, theta);
                        record.instant(
                            excitation.time(k),
                            &there,
                            if looks {
                                at = excitation.input(k);
                                &at
                            } else {
                                &NO_INPUT
                            },
                        );
                        summary.recorded += 1;
                        k += 1;
                    }
                } else if let Output::Times(times) = output {
                    let end = last && until + 1 == excitation.count();
                    while let Some(&time) = times.get(summary.recorded) {
                        let theta = if h > 0.0 { (time - start - done) / h } else { f64::INFINITY };
                        if theta > 1.0 && !end {
                            break;
                        }
                        let theta = theta.clamp(0.0, 1.0);
                        let there = method.between(course.equations(), &mut memory, &ramp, state, theta);
                        record.instant(time, &there, &excitation.input_at(time));
                        summary.recorded += 1;
                    }
                }
                core::mem::swap(&mut state, &mut next);
                if change.is_some() {
                    course.cross(state);
                }
                summary.steps += 1;
                done = match (last, change) {
                    (true, _) => length,
                    (false, Some(_)) => done + h,
                    // Not by adding up, which a million steps would round.
                    (false, None) => length - (left - 1.0) * h,
                };
                left -= 1.0;
            }
            core::mem::swap(&mut from, &mut to);
            k = until;
            if let Output::Samples = output {
                record.instant(
                    excitation.time(k),
                    state,
                    if looks {
                        at = excitation.input(k);
                        &at
                    } else {
                        &NO_INPUT
                    },
                );
                summary.recorded += 1;
            }
        }
        if !finite(state) {
            return Err(RunError::OutOfRange);
        }
        if let Output::Times(times) = output {
            // All that is left when the excitation has no duration.
            for &time in &times[summary.recorded..] {
                record.instant(time, state, &excitation.input_at(time));
                summary.recorded += 1;
            }
        }
        summary.contact_changes = course.changes();
        Ok(summary)
    }
}

/// How far beyond what the excitation can reach a state may be before the method, not the machine, has brought it there.
const DIVERGENCE: f64 = 100.0;

/// Square root of twice the kinetic energy.
#[cfg_attr(feature = "std", inline(always))]
fn speed(state: &State) -> f64 {
    sqrt(state[6..].iter().map(|entry| entry * entry).sum())
}

/// Whether no entry is infinite or NaN.
#[cfg_attr(feature = "std", inline(always))]
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

/// Shortest step, as a fraction of the interval between two knots that it stands in.
const SHORTEST: f64 = 1e-9;

/// Steps of one run, some ten seconds of work, after which it is taken for a mistake.
const MOST_STEPS: usize = 100_000_000;

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
