//! Errors of batches.

use core::fmt;

use super::measure::Measure;
use crate::error::{RunError, SceneError, Stopped, from_variants};
use crate::life::MAX_EXPONENT;
use crate::variation::ChangeError;

/// Why a batch is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BatchError {
    /// A change that the base scene cannot have.
    Change(ChangeError),
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
    /// An exponent of the mean load that is not 1 to 100.
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

from_variants!(BatchError: Change(ChangeError), Stopped(Stopped), Scene(SceneError), Run(RunError));

impl fmt::Display for BatchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Change(error) => error.fmt(f),
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
                write!(f, "exponent: expected 1 to {MAX_EXPONENT}, got {got}; balls have 3, rollers 10/3")
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
