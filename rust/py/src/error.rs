//! Errors of the core as exceptions of Python.

use guideload::sensitivity::SensitivityError;
use guideload::{BatchError, ChangeError, ExcitationError, RunError, SceneError, Stopped};
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;

/// The exception tree is `guideload.base.errors`.
pub mod exceptions {
    pyo3::import_exception!(guideload.base.errors, ArgumentError);
    pyo3::import_exception!(guideload.base.errors, RunError);
    pyo3::import_exception!(guideload.base.errors, SceneError);
    pyo3::import_exception!(guideload.base.errors, TraceError);
}

/// Any error of the core.
pub enum CoreError {
    Scene(SceneError),
    Link(usize, SceneError),
    Rider(usize, SceneError),
    Excitation(ExcitationError),
    Run(RunError),
    Batch(BatchError),
    Sensitivity(SensitivityError),
    Stopped(Stopped),
}

impl From<ChangeError> for CoreError {
    fn from(error: ChangeError) -> Self {
        Self::Batch(error.into())
    }
}

impl From<SensitivityError> for CoreError {
    fn from(error: SensitivityError) -> Self {
        match error {
            SensitivityError::Run(error) => Self::Run(error),
            SensitivityError::Stopped(stopped) => Self::Stopped(stopped),
            error => Self::Sensitivity(error),
        }
    }
}

impl From<Stopped> for CoreError {
    fn from(stopped: Stopped) -> Self {
        Self::Stopped(stopped)
    }
}

impl From<SceneError> for CoreError {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<ExcitationError> for CoreError {
    fn from(error: ExcitationError) -> Self {
        Self::Excitation(error)
    }
}

impl From<RunError> for CoreError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl From<BatchError> for CoreError {
    fn from(error: BatchError) -> Self {
        match error {
            BatchError::Scene(error) => Self::Scene(error),
            BatchError::Run(error) => Self::Run(error),
            BatchError::Stopped(stopped) => Self::Stopped(stopped),
            error => Self::Batch(error),
        }
    }
}

impl From<CoreError> for PyErr {
    fn from(error: CoreError) -> Self {
        match error {
            CoreError::Scene(error) => exceptions::SceneError::new_err(error.to_string()),
            CoreError::Link(index, error) => {
                exceptions::SceneError::new_err(format!("links[{index}].{error}"))
            }
            CoreError::Rider(index, error) => {
                exceptions::SceneError::new_err(format!("riders[{index}].{error}"))
            }
            CoreError::Sensitivity(SensitivityError::Sample(error)) => {
                exceptions::SceneError::new_err(error.to_string())
            }
            CoreError::Sensitivity(error) => exceptions::ArgumentError::new_err(error.to_string()),
            CoreError::Excitation(error) => exceptions::TraceError::new_err(error.to_string()),
            CoreError::Run(
                error @ (RunError::Tolerance { .. }
                | RunError::Step { .. }
                | RunError::OutputTime { .. }
                | RunError::NotExact { .. }
                | RunError::NotExactRiders
                | RunError::NotExponential { .. }
                | RunError::NotExponentialRiders
                | RunError::StartState { .. }),
            ) => exceptions::ArgumentError::new_err(error.to_string()),
            CoreError::Run(RunError::Interrupted { .. }) | CoreError::Stopped(Stopped::Interrupted) => {
                PyKeyboardInterrupt::new_err(())
            }
            CoreError::Run(error @ RunError::Memory { .. }) => PyMemoryError::new_err(error.to_string()),
            CoreError::Stopped(stopped) => PyMemoryError::new_err(stopped.to_string()),
            CoreError::Run(error) => exceptions::RunError::new_err(error.to_string()),
            CoreError::Batch(error) => exceptions::ArgumentError::new_err(error.to_string()),
        }
    }
}

/// The error of a machine that cannot be prepared for something.
pub fn scene_error(error: impl std::fmt::Display) -> PyErr {
    exceptions::SceneError::new_err(error.to_string())
}

/// An error unless the numbers of a result are finite.
pub fn require_finite(are_finite: bool) -> Result<(), CoreError> {
    if are_finite { Ok(()) } else { Err(RunError::OutOfRange.into()) }
}
