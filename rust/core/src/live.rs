//! Loads step by step, for a controller: in f64 or f32, in a fixed number of operations, without memory but its own.

use core::fmt;
use core::ops::{Add, Mul};

use crate::equations::SampledSystem;
use crate::error::{ExcitationError, RunError, SceneError, from_variants};
use crate::machine::{Load, PerCarriage, Simulation};

/// The numbers of a [`Live`] step: f64 or f32.
pub trait Number: Copy + Into<f64> + Add<Output = Self> + Mul<Output = Self> + Default {
    /// The nearest number.
    fn nearest(value: f64) -> Self;
}

impl Number for f64 {
    fn nearest(value: f64) -> Self {
        value
    }
}

impl Number for f32 {
    fn nearest(value: f64) -> Self {
        value as Self
    }
}

fn is_finite<T: Number>(number: &T) -> bool {
    (*number).into().is_finite()
}

/// Why the short way is refused: all errors that it can give.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// Of the machine.
    Scene(SceneError),
    /// Of the excitation.
    Excitation(ExcitationError),
    /// Of a run.
    Run(RunError),
    /// A step of fixed work needs linear carriages.
    NotLinear,
    /// A period that is not positive, or with which numbers of a step are beyond the range of f64 or f32.
    Period {
        /// s.
        got: f64,
    },
}

impl core::error::Error for Error {}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Excitation(error) => error.fmt(f),
            Self::Run(error) => error.fmt(f),
            Self::NotLinear => f.write_str(
                "a live step needs linear carriages, as the work of a contact change has no bound: leave out law_y and law_z",
            ),
            Self::Period { got } => {
                write!(f, "period: expected > 0 s and a step within the range of numbers, got {got} s")
            }
        }
    }
}

from_variants!(Error: Scene(SceneError), Excitation(ExcitationError), Run(RunError));

/// Loads of the carriages of a linear machine, one period after the other.
///
/// Between two instants the acceleration counts as linear; then the state and the loads are those of the exact solution, but for rounding.
/// Where a mode has no damping the errors of rounding add up: in f32 its swing may change by some percent in 10 million steps.
#[derive(Debug, Clone)]
pub struct Live<T> {
    step: SampledSystem<T>,
    at_rest: PerCarriage<[T; 5]>,
    /// Load per entry of the state.
    by_state: PerCarriage<[[T; 5]; 12]>,
    state: [T; 12],
    /// Acceleration at the instant of the state, m/s²; none before the first instant.
    acceleration: Option<T>,
    loads: PerCarriage<Load<T>>,
}

impl<T: Number> Live<T> {
    /// The step of a simulation; see [`Simulation::live`].
    fn new(simulation: &Simulation, period: f64) -> Result<Self, Error> {
        if !(period > 0.0 && period.is_finite()) {
            return Err(Error::Period { got: period });
        }
        let step =
            SampledSystem::new(simulation.system(), period).ok_or(Error::NotLinear)?.rounded(T::nearest);
        if !step.entries().all(is_finite) {
            return Err(Error::Period { got: period });
        }
        let (count, recoveries) = (simulation.count(), simulation.recoveries());
        let linear = |k: usize| &recoveries.as_slice()[k].linear;
        let components = |load: [f64; 6]| [1, 2, 3, 4, 5].map(|component| T::nearest(load[component]));
        let at_rest = PerCarriage::new(count, |k| components(linear(k).constant));
        let loads = PerCarriage::new(count, |k| Load::of(at_rest.as_slice()[k]));
        let by_state = PerCarriage::new(count, |k| linear(k).by_state.map(components));
        let mut effects = by_state.iter().flat_map(|columns| columns.as_flattened());
        if !loads.iter().all(Load::is_finite) || !effects.all(is_finite) {
            return Err(Error::Run(RunError::OutOfRange));
        }
        Ok(Self { step, at_rest, by_state, state: [T::default(); 12], acceleration: None, loads })
    }

    /// Goes on by one period to the instant at which L has this `acceleration` along x, m/s², and gives the loads then. The first call is the
    /// first instant, whose loads are those at rest. After an acceleration that is not finite, all later loads are NaN until [`Live::reset`]; see
    /// [`Live::is_finite`].
    pub fn step(&mut self, acceleration: T) -> &PerCarriage<Load<T>> {
        if let Some(before) = self.acceleration.replace(acceleration) {
            self.state = self.step.after(&self.state, [before, acceleration]);
        }
        let carriages = self.at_rest.iter().zip(self.by_state.iter());
        for (load, (at_rest, by_state)) in self.loads.as_mut_slice().iter_mut().zip(carriages) {
            let mut sum = *at_rest;
            for (column, &entry) in by_state.iter().zip(&self.state) {
                sum = core::array::from_fn(|k| sum[k] + column[k] * entry);
            }
            *load = Load::of(sum);
        }
        &self.loads
    }

    /// The loads of the last instant; those at rest before the first.
    pub fn loads(&self) -> &PerCarriage<Load<T>> {
        &self.loads
    }

    /// Whether all accelerations so far, and their effects, were finite.
    pub fn is_finite(&self) -> bool {
        self.state.iter().chain(&self.acceleration).all(is_finite)
    }

    /// Begins again at rest.
    pub fn reset(&mut self) {
        (self.state, self.acceleration) = ([T::default(); 12], None);
        for (load, &at_rest) in self.loads.as_mut_slice().iter_mut().zip(self.at_rest.iter()) {
            *load = Load::of(at_rest);
        }
    }
}

impl Simulation {
    /// The loads step by step, every `period` s, in f64 or f32: for a controller that knows the acceleration, and for simulations in which a
    /// drive reacts to them.
    ///
    /// # Errors
    /// [`Error::NotLinear`] for carriages with other laws than a stiffness; [`Error::Period`]; [`RunError::OutOfRange`] for a machine whose
    /// loads are beyond the range of f64 or f32.
    pub fn live<T: Number>(&self, period: f64) -> Result<Live<T>, Error> {
        Live::new(self, period)
    }
}
