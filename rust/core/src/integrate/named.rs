//! The methods by name, for a choice made while the program runs.

use super::drive::Scaled;
use super::{Control, Exact, Output, Radau, Rk45, Summary, run_scaled};
use crate::error::RunError;
use crate::excitation::Excitation;
use crate::record::Record;
use crate::system::System;

/// Interval lengths that an exact run remembers: device clocks tick in a handful of them.
const KEPT: usize = 16;

/// A method by its name.
///
/// What [`super::run`] makes of a method is a loop for each kind of equations, long to compile. Those of a `Named` are compiled once, in this
/// crate, for all who use it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Named {
    /// [`Exact`], which remembers 16 interval lengths.
    Exact,
    /// [`Rk45`].
    Rk45,
    /// [`Radau`].
    Implicit,
}

impl Named {
    /// The method of that name: `exact`, `rk45` or `implicit`.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [("exact", Self::Exact), ("rk45", Self::Rk45), ("implicit", Self::Implicit)];
        all.into_iter().find(|(known, _)| *known == name).map(|(_, method)| method)
    }

    /// [`super::run`] with this method.
    ///
    /// # Errors
    /// As there.
    pub fn run(
        self,
        system: &System,
        control: Control,
        excitation: &Excitation,
        output: Output,
        record: &mut dyn Record,
    ) -> Result<Summary, RunError> {
        self.run_scaled(system, control, &Scaled::whole(excitation), output, record)
    }

    /// The same under an excitation times factors.
    pub(crate) fn run_scaled(
        self,
        system: &System,
        control: Control,
        scaled: &Scaled,
        output: Output,
        record: &mut dyn Record,
    ) -> Result<Summary, RunError> {
        match self {
            Self::Exact => run_scaled(system, &Exact::<KEPT>, control, scaled, output, record),
            Self::Rk45 => run_scaled(system, &Rk45, control, scaled, output, record),
            Self::Implicit => run_scaled(system, &Radau, control, scaled, output, record),
        }
    }
}
