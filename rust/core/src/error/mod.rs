//! Errors carry the numbers and the next move.

mod excitation;
mod run;
mod scene;

pub use excitation::ExcitationError;
pub use run::RunError;
pub use scene::SceneError;
