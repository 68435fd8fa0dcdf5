//! A run: checks, choice of the equations, and the [`Runner`] that steps.

use super::budget::Budget;
use super::control::{Control, Controller, ErrorNorm, scale_of};
use super::exact::Exact;
use super::method::{CompiledRun, Method, Output, Summary};
use super::recorder::{Recorder, are_samples};
use super::start::Start;
use super::step_control::StepControl;
use super::step_loop::Runner;
use crate::contacts::{Contacts, SmoothContacts, SwitchedEquations, Unswitched};
use crate::equations::{Equations, Riders, SmoothEquations};
use crate::error::{OtherMethod, RunError};
use crate::excitation::{Excitation, Forcing, ScaledExcitation};
use crate::numeric::float::norm;
use crate::numeric::simd::dispatch_once;
use crate::output::Record;
use crate::system::{ModelLevel, State, System, energy_norm};

/// Runs a system from static equilibrium through an excitation and hands each instant to `record`.
///
/// A step ends at the next contact change. If all laws have straight segments (clearance, sides, curves), the change is located on the exact
/// solution between two contact changes; if some links are preloaded, on the dense output of the method.
///
/// # Errors
/// [`RunError`] with time, step and error. `record` then contains the instants before the error.
pub fn run<M: Method, R: Record>(
    system: &System,
    method: &M,
    control: Control,
    excitation: &Excitation,
    output: Output,
    record: &mut R,
) -> Result<Summary, RunError> {
    run_from(system, method, control, Start::AtRest, excitation, output, record)
}

/// [`run`] from another state than static equilibrium.
///
/// # Errors
/// As [`run`]; also [`RunError::NoQuasiStaticState`] and [`RunError::StartState`].
pub fn run_from<M: Method, R: Record>(
    system: &System,
    method: &M,
    control: Control,
    start: Start,
    excitation: &Excitation,
    output: Output,
    record: &mut R,
) -> Result<Summary, RunError> {
    method.run_compiled(system, control, start, &ScaledExcitation::unscaled(excitation), output, record)
}

/// [`run_from`] with factors on the accelerations and on the external loads of the excitation.
///
/// The record is called through a table: compiling the loop for each kind of record would multiply the code, and an instant costs far more
/// than the call.
pub(crate) fn run_scaled<M: Method>(
    system: &System,
    method: &M,
    control: Control,
    start: Start,
    scaled: &ScaledExcitation,
    output: Output,
    record: &mut dyn Record,
) -> Result<Summary, RunError> {
    let excitation = scaled.excitation;
    if M::EXACT_IF_LINEAR && excitation.riders().is_empty() && system.first_smooth().is_none() {
        return Exact.run_compiled(system, control, start, scaled, output, record);
    }
    let of = &mut *record;
    let setup = Setup::new(system, method, control, start, scaled, output, of)?;
    let (start, load_scale) = (setup.start, setup.load_scale);
    let level =
        if excitation.riders().is_empty() { system.model_level() } else { ModelLevel::SmoothNonlinear };
    let done = match level {
        ModelLevel::Linear | ModelLevel::PiecewiseLinear if const { M::EXACT_IF_LINEAR } => {
            unreachable!("run by the exact method")
        }
        ModelLevel::Linear => dispatch_once!(run_on(setup, Unswitched(system))),
        ModelLevel::PiecewiseLinear => {
            dispatch_once!(run_on(setup, Contacts::new(system, &start, load_scale)))
        }
        // Decided at compile time. Without this arm the loop of the exact method on smooth laws would be compiled too, a tenth of the
        // library.
        ModelLevel::SmoothNonlinear if const { M::ERROR_ORDER.is_none() } => unreachable!("refused above"),
        ModelLevel::SmoothNonlinear if const { M::EXACT_IF_LINEAR } => {
            let equations = &SmoothEquations::at_rest(system, excitation);
            dispatch_once!(run_on(setup, Unswitched(equations)))
        }
        ModelLevel::SmoothNonlinear => {
            let rtol = if let Control::Adaptive { rtol } = control { rtol } else { 0.0 };
            dispatch_once!(run_on(setup, SmoothContacts::new(system, excitation, &start, load_scale, rtol)))
        }
    };
    record.end();
    done
}

/// A checked run, before its first step.
pub(super) struct Setup<'a, M> {
    system: &'a System,
    method: &'a M,
    control: Control,
    pub start: State,
    excitation: &'a Excitation<'a>,
    output: Output<'a>,
    record: &'a mut dyn Record,
    pub forcing: Forcing,
    pub load_scale: f64,
    budget: Budget,
    /// Way out if the run fails.
    other: OtherMethod,
}

impl<'a, M: Method> Setup<'a, M> {
    /// Checks a run, and finds its first state.
    pub(super) fn new(
        system: &'a System,
        method: &'a M,
        control: Control,
        start: Start,
        scaled: &ScaledExcitation<'a>,
        output: Output<'a>,
        record: &'a mut dyn Record,
    ) -> Result<Self, RunError> {
        let excitation = scaled.excitation;
        if M::ERROR_ORDER.is_none()
            && let Some(link) = system.first_smooth()
        {
            return Err(RunError::NotExact { link });
        }
        if M::ERROR_ORDER.is_none() && !excitation.riders().is_empty() {
            return Err(RunError::NotExactRiders);
        }
        if M::EXACT_IF_LINEAR && !excitation.riders().is_empty() {
            return Err(RunError::NotExponentialRiders);
        }
        if M::EXACT_IF_LINEAR
            && let Some(link) = system.first_segmented()
        {
            return Err(RunError::NotExponential { link });
        }
        control.check()?;
        check_output(output, excitation)?;
        let expected = match output {
            Output::Samples => excitation.count(),
            Output::Times(times) => times.len(),
        };
        record.reserve(expected)?;
        let load_scale = scale_of(system, &scaled.scaled_peak(), excitation);
        if !load_scale.is_finite() {
            return Err(RunError::OutOfRange);
        }
        let mut forcing = Forcing::new(system, &scaled.peak, scaled.factors).with_riders(excitation);
        let riders = Riders::new(system, excitation);
        riders.peak_forces(&scaled.peak, |force| forcing.riders += norm(force));
        let start = start.state(system, &forcing, &riders, excitation)?;
        let other = match system.first_smooth() {
            None if excitation.riders().is_empty() => OtherMethod::Exact,
            _ if M::STABLE => OtherMethod::None,
            _ => OtherMethod::Implicit,
        };
        let budget = Budget::new::<M>(system, excitation, expected, control, (&start, other))?;
        Ok(Self {
            system,
            method,
            control,
            start,
            excitation,
            output,
            record,
            forcing,
            load_scale,
            budget,
            other,
        })
    }

    /// The run on equations of one kind, with the memory of the method.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn runner<'r, C: SwitchedEquations>(
        self,
        memory: &'r mut M::Memory,
        equations: &'r mut C,
    ) -> Runner<'r, M, C>
    where
        'a: 'r,
    {
        let Self {
            system,
            method,
            control,
            start,
            excitation,
            output,
            record,
            load_scale,
            budget,
            other,
            ..
        } = self;
        let has_edges = !C::Equations::LINEAR;
        let has_segments = system.first_segmented().is_some();
        let controller = match (control, M::ERROR_ORDER) {
            (Control::Adaptive { rtol }, Some(order)) => {
                Some(Controller::new(rtol, system, excitation, order, has_segments, M::LONGEST_STEP))
            }
            _ => None,
        };
        let steps = StepControl {
            control,
            controller,
            norm: ErrorNorm::new(system, load_scale),
            has_error: M::ERROR_ORDER.is_some(),
            has_edges,
            at_edge: false,
            was_whole: true,
            other,
            reach: energy_norm(&start),
        };
        let at_samples = match output {
            Output::Samples => true,
            Output::Times(times) => M::ERROR_ORDER.is_none() && are_samples(times, excitation),
        };
        let recorder = Recorder { excitation, output, record, at_samples, recorded: 0 };
        let summary =
            Summary { steps: 0, rejected: 0, recorded: 0, contact_changes: 0, load_scale, end: start };
        Runner { method, memory, equations, steps, recorder, summary, budget }
    }
}

/// A run on equations of one kind.
#[cfg_attr(feature = "std", inline(always))]
fn run_on<M: Method, C: SwitchedEquations>(setup: Setup<M>, mut equations: C) -> Result<Summary, RunError> {
    let (forcing, start) = (setup.forcing, setup.start);
    let mut memory = setup.method.memory();
    setup.runner(&mut memory, &mut equations).run(&forcing, start)
}

pub(crate) fn check_output(output: Output, excitation: &Excitation) -> Result<(), RunError> {
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
