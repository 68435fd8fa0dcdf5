//! Errors carry the numbers and the next move.

#[cfg(feature = "std")]
mod batch;
mod excitation;
mod run;
mod scene;

#[cfg(feature = "std")]
pub use batch::{BatchError, SampleError};
pub use excitation::ExcitationError;
pub use run::RunError;
pub use scene::SceneError;
