//! The trait of the integrators, the instants that a run records, and its summary.

use super::control::Control;
use super::exact_steps::ExactSteps;
use super::start::Start;
use crate::equations::{Equations, Linearized, LongStep};
use crate::error::RunError;
use crate::excitation::{Forcing, Ramp, ScaledExcitation, Values};
use crate::output::Record;
use crate::system::{State, System};

/// An integrator of this crate: advances the state over one step of given length.
pub trait Method: CompiledRun {
    /// Memory of one run: stages, factorisations.
    type Memory;
    /// Order of the error estimate of [`Method::step`]; none for a method without step error.
    const ERROR_ORDER: Option<u32>;
    /// Whether it is stable at any step on a passive linear system.
    const STABLE: bool;
    /// Whether it has no step error on linear equations, so that [`super::Exact`] runs scenes without smooth laws in its place.
    const EXACT_IF_LINEAR: bool = false;
    /// Longest step with step-size control, in radians of the fastest mode that vibrates.
    const LONGEST_STEP: f64 = f64::INFINITY;
    /// Time of a step over that of [`crate::Rk45`], about, for the limit of a run's work.
    const WORK: usize = 1;

    /// Memory for one run.
    fn memory(&self) -> Self::Memory;

    /// The state after the step that starts in `state`, and its estimated error.
    fn step<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
    ) -> (State, State);

    /// The exact steps over intervals of `h` s by the equations with this key, if the method has them ready.
    fn exact_steps<'m>(&self, _: &'m mut Self::Memory, _h: f64, _key: u32) -> Option<ExactSteps<'m>> {
        None
    }

    /// The exact long step over intervals of `h` s by the equations, if the method has one or finds it worth preparing.
    fn long_step<'m, E: Equations>(
        &self,
        _: &'m mut Self::Memory,
        _: &E,
        _: &Forcing,
        _h: f64,
    ) -> Option<&'m LongStep> {
        None
    }

    /// The equations linearised about the equilibrium under a constant excitation, for intervals of `h` s, if the method has them;
    /// `prepares`: whether it may prepare them. `state`: where the body is.
    fn linearized<'m, E: Equations>(
        &self,
        _: &'m mut Self::Memory,
        _: &E,
        _: (&Forcing, &Values),
        _h: f64,
        _state: &State,
        _prepares: bool,
    ) -> Option<&'m Linearized> {
        None
    }

    /// Dense output: the state at the fraction `theta` of the step that [`Method::step`] made last, from `state`.
    fn between<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
        theta: f64,
    ) -> State;

    /// Number of changes of contact that the steps show, for a method that does not end its steps at them.
    fn contact_changes<E: Equations>(&self, _: &E, _: &Self::Memory) -> usize {
        0
    }
}

/// A run by a method, compiled in this crate: a generic function would be compiled again in each crate that calls it.
pub trait CompiledRun {
    /// [`super::run_from`] with factors on the excitation.
    #[doc(hidden)]
    fn run_compiled(
        &self,
        system: &System,
        control: Control,
        start: Start,
        scaled: &ScaledExcitation,
        output: Output,
        record: &mut dyn Record,
    ) -> Result<Summary, RunError>;
}

/// The instants that a run records.
#[derive(Debug, Clone, Copy)]
pub enum Output<'a> {
    /// Every sample of the excitation.
    Samples,
    /// These times, ascending, s; within a step by dense output.
    Times(&'a [f64]),
}

/// Work and result of a run in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Accepted steps. A step over many samples, which the record does not need, counts once.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Instants recorded, or left out because the record does not need them.
    pub recorded: usize,
    /// Number of contact changes, at which a link moves to another segment of its law; zero if all laws are linear.
    pub contact_changes: usize,
    /// The load that the tolerance is relative to, N.
    pub load_scale: f64,
    /// The state at the last sample.
    pub end: State,
}
