//! Errors of changes, and of the values of a sample.

use core::fmt;

use super::change::Target;
use crate::error::{RunError, SceneError, from_variants};

/// Why a change is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ChangeError {
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
}

impl fmt::Display for ChangeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Target { target } => write!(f, "changes: the scene has no {target}"),
            Self::Repeated { target } => {
                write!(f, "changes: expected each place once, got {target} twice; add their terms up")
            }
            Self::NotFinite { target } => {
                write!(f, "changes: expected a finite constant and finite factors for {target}")
            }
        }
    }
}

impl core::error::Error for ChangeError {}

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

from_variants!(SampleError: Scene(SceneError), Run(RunError));

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
