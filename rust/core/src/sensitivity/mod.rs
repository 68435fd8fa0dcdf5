//! Exact derivatives of a system by the values of its changes.
//!
//! A value enters the numbers of a scene linearly ([`Change`](crate::variation::Change)), so their derivatives are factors: nothing is
//! differenced. `scene` (derivatives of mass matrix, weight and links by each column of values) → `system` (of the static position, the
//! loads at rest and the stiffness in the modes) → `loads` (of loads as functions of the state).

mod error;
mod loads;
mod scene;
mod system;

pub use error::SensitivityError;
pub use system::{LinkDerivative, SystemDerivative, VariedSystem};
