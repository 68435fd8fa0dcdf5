//! Errors of batches, and of single samples in them.

use core::fmt;

use super::change::Target;
use super::measure::Measure;
use crate::error::{RunError, SceneError, Stopped};

/// Why a batch is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BatchError {
    /// A target that the base scene does not have.
    Target {
        /// The target.
        target: Target,
    },
    /// Two changes of one target.
    Repeated {
        /// The target.
        target: Target,
    },
    /// A constant or factor that is not finite.
    NotFinite {
        /// Target of the change.
        target: Target,
    },
    /// A measure of a group that does not exist.
    Measure {
        /// The measure.
        measure: Measure,
    },
    /// A group with a link that does not exist.
    Group {
        /// Index of the group.
        group: usize,
        /// The link.
        link: usize,
        /// Number of links.
        count: usize,
    },
    /// A stay of a payload that is empty, ends after the motion, or changes between samples of different times.
    Payload {
        /// Index of the payload.
        payload: usize,
        /// First sample, and the first one after it.
        stay: [usize; 2],
        /// Number of samples.
        count: usize,
    },
    /// An exponent of the mean load below 1 or not finite.
    Exponent {
        /// As given.
        got: f64,
    },
    /// An array of the wrong length.
    Length {
        /// Its name.
        field: &'static str,
        /// Its length.
        expected: usize,
        /// Length given.
        got: usize,
    },
    /// Fewer columns of values than the changes name.
    Columns {
        /// Number of columns that the changes name.
        expected: usize,
        /// Number of columns given.
        got: usize,
    },
    /// A speed that is not finite.
    Speed {
        /// At which sample, from 0.
        index: usize,
    },
    /// The base is not a valid scene.
    Scene(SceneError),
    /// A setting of the method is refused.
    Run(RunError),
    /// The watch stopped it, or there is not enough memory.
    Stopped(Stopped),
}

impl From<Stopped> for BatchError {
    fn from(stopped: Stopped) -> Self {
        Self::Stopped(stopped)
    }
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
            Self::Payload { payload, stay: [from, to], count } => write!(
                f,
                "payloads[{payload}]: expected stays within the {count} samples, and two samples of one time at each change, got \
                 samples {from} to {to}"
            ),
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
            Self::Stopped(stopped) => stopped.fmt(f),
        }
    }
}

impl core::error::Error for BatchError {}

/// Why a sample has no result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleError {
    /// It is not a valid scene.
    Scene(SceneError),
    /// A link, by its index, is not valid.
    Link(usize, SceneError),
    /// A payload, by its index, is not valid.
    Payload(usize, SceneError),
    /// A value that is not finite.
    NotFinite {
        /// Its target.
        target: Target,
        /// Its value.
        got: f64,
    },
    /// The run has stopped.
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
            // The texts of a body's errors begin with its name.
            Self::Payload(index, error) => {
                write!(f, "payloads[{index}].{}", error.to_string().trim_start_matches("body."))
            }
            Self::NotFinite { target, got } => write!(f, "{target}: expected a finite number, got {got}"),
            Self::Run(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SampleError {}
