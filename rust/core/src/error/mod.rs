//! Errors, and all of their wording. Each message names the field, says what was expected and what was given, and what to do next. (Those
//! of batches stand in `batch`.)

mod excitation;
mod run;
mod scene;

pub use excitation::ExcitationError;
pub use run::RunError;
pub use scene::SceneError;
