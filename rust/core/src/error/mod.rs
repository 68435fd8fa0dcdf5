//! Errors and their messages. Each message names the field, what was expected, what was given, and what to do. (The errors of batches are in
//! `batch`.)

mod excitation;
mod run;
mod scene;
mod stopped;

pub use excitation::ExcitationError;
pub use run::{OtherMethod, RunError};
pub use scene::SceneError;
pub use stopped::Stopped;
