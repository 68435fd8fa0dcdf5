//! Errors of batches, and of single samples in them.

use core::fmt;

use super::change::Target;
use super::measure::Measure;
use crate::error::{RunError, SceneError};

/// What is wrong with a batch, before anything runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BatchError {
    /// The base scene has no such place.
    Target {
        /// The place.
        target: Target,
    },
    /// Two changes of one place.
    Repeated {
        /// The place.
        target: Target,
    },
    /// A constant or factor that is not finite.
    NotFinite {
        /// Of the change of this place.
        target: Target,
    },
    /// A measure of a group that there is not, or a mean load without a speed.
    Measure {
        /// The measure.
        measure: Measure,
    },
    /// A group with a link that there is not.
    Group {
        /// Index of the group.
        group: usize,
        /// The link.
        link: usize,
        /// How many there are.
        count: usize,
    },
    /// An exponent of the mean load below 1 or not finite.
    Exponent {
        /// As given.
        got: f64,
    },
    /// A history or table of another length.
    Length {
        /// Which one.
        field: &'static str,
        /// Numbers that belong there.
        expected: usize,
        /// Numbers that are there.
        got: usize,
    },
    /// Fewer columns of values than the changes name.
    Columns {
        /// How many they name.
        expected: usize,
        /// How many there are.
        got: usize,
    },
    /// A speed that is not finite.
    Speed {
        /// At which sample, from 0.
        index: usize,
    },
    /// The base scene.
    Scene(SceneError),
    /// A setting of the method.
    Run(RunError),
}

impl From<SceneError> for BatchError {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<RunError> for BatchError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl fmt::Display for BatchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Target { target } => write!(f, "changes: the scene has no {target}"),
            Self::Repeated { target } => {
                write!(f, "changes: expected each place once, got {target} twice; add their terms up")
            }
            Self::NotFinite { target } => {
                write!(f, "changes: expected a finite constant and finite factors for {target}")
            }
            Self::Measure { measure } => write!(f, "measures: there is no group for {measure:?}"),
            Self::Group { group, link, count } => {
                write!(f, "groups[{group}]: there is no link {link} of {count}")
            }
            Self::Exponent { got } => {
                write!(f, "exponent: expected >= 1, got {got}; balls have 3, rollers 10/3")
            }
            Self::Length { field, expected, got } => {
                write!(f, "{field}: expected {expected} numbers, got {got}")
            }
            Self::Columns { expected, got } => {
                write!(f, "values: expected {expected} columns, one per number that varies, got {got}")
            }
            Self::Speed { index } => write!(f, "speed[{index}]: expected a finite number"),
            Self::Scene(error) => error.fmt(f),
            Self::Run(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for BatchError {}

/// Why a sample has no result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleError {
    /// No such scene.
    Scene(SceneError),
    /// No such link, by its index.
    Link(usize, SceneError),
    /// A value that is not finite.
    NotFinite {
        /// Of which place.
        target: Target,
        /// As it came out.
        got: f64,
    },
    /// The run stopped.
    Run(RunError),
}

impl From<SceneError> for SampleError {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<RunError> for SampleError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl fmt::Display for SampleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Link(index, error) => write!(f, "links[{index}].{error}"),
            Self::NotFinite { target, got } => write!(f, "{target}: expected a finite number, got {got}"),
            Self::Run(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SampleError {}
