//! Scenes whose numbers vary: what varies, and the scene of given values.
//!
//! `change` (the numbers that vary, as functions of columns of values) → `instance` (the base scene with given values).

mod change;
mod error;
mod instance;

pub use change::{Change, Target};
pub use error::{ChangeError, SampleError};
pub use instance::{Base, Group, Instance, NominalBody, Payload, Plan};
