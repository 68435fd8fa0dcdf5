//! The methods by name, for a choice at run time.

use super::control::Control;
use super::exact::{CACHED_STEPS, Exact};
use super::exponential::Exponential;
use super::method::{Output, Summary};
use super::radau::Radau;
use super::rk45::Rk45;
use super::run::run_scaled;
use super::start::Start;
use crate::error::RunError;
use crate::excitation::{Excitation, ScaledExcitation};
use crate::output::Record;
use crate::system::System;

/// A method chosen by its name at run time.
///
/// [`super::run`] is compiled for each method and kind of equations, which takes long. With this type all callers share one compiled copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NamedMethod {
    /// [`Exact`] with 16 cached propagators.
    Exact,
    /// [`Exponential`] with 16 cached propagators.
    Exponential,
    /// [`Rk45`].
    Rk45,
    /// [`Radau`].
    Implicit,
}

impl NamedMethod {
    /// All methods.
    pub const ALL: &'static [Self] = &[Self::Exact, Self::Exponential, Self::Rk45, Self::Implicit];

    /// The name of the method.
    pub const fn name(self) -> &'static str {
        ["exact", "exponential", "rk45", "implicit"][self as usize]
    }

    /// [`NamedMethod::run`] with factors on the excitation.
    pub(crate) fn run_scaled(
        self,
        system: &System,
        control: Control,
        start: Start,
        scaled: &ScaledExcitation,
        output: Output,
        record: &mut dyn Record,
    ) -> Result<Summary, RunError> {
        let (exact, exponential) = (&Exact::<CACHED_STEPS>, &Exponential::<CACHED_STEPS>);
        match self {
            Self::Exact => run_scaled(system, exact, control, start, scaled, output, record),
            Self::Exponential => run_scaled(system, exponential, control, start, scaled, output, record),
            Self::Rk45 => run_scaled(system, &Rk45, control, start, scaled, output, record),
            Self::Implicit => run_scaled(system, &Radau, control, start, scaled, output, record),
        }
    }

    /// The method of that name, as in [`NamedMethod::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|method| method.name() == name)
    }

    /// [`super::run_from`] with this method.
    ///
    /// # Errors
    /// As [`super::run_from`].
    pub fn run(
        self,
        system: &System,
        control: Control,
        start: Start,
        excitation: &Excitation,
        output: Output,
        record: &mut dyn Record,
    ) -> Result<Summary, RunError> {
        self.run_scaled(system, control, start, &ScaledExcitation::unscaled(excitation), output, record)
    }
}
