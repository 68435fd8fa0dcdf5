//! Scenes whose numbers vary: what varies, and the scene of given values.
//!
//! `change` (the numbers that vary, as functions of columns of values), `group` (the links whose loads are measured) → `instance` (the base scene with given values).

mod change;
mod error;
mod group;
mod instance;

pub use change::{Change, Target};
pub use error::{ChangeError, SampleError};
pub use group::Group;
pub use instance::{Base, Instance, NominalBody, Payload, Plan};
