//! Exact derivatives of a system by the values of its changes.
//!
//! A value enters the numbers of a scene linearly ([`Change`](crate::variation::Change)), so their derivatives are factors: nothing is
//! differenced. `scene` (derivatives of mass matrix, weight and links by each column of values) → `system` (of the static position, the
//! loads at rest and the stiffness in the modes) → `loads`, `motions`, `rows` (of what is computed from a state) and `equations` (of those in the
//! modes) → `steps`, `tangents` (of the states of a run), `segments`, `contacts` (with contact changes), `order_8`, `smooth`, `smooth_run`,
//! `smooth_quantities` (with preloaded links), `adjoint` (of one figure of a linear run) → `histories` (of all that is computed from them, at
//! the samples), `instants` (between them).

mod adjoint;
mod contacts;
mod equations;
mod error;
mod histories;
mod instants;
mod loads;
mod motions;
mod order_8;
mod rows;
mod scene;
mod segments;
mod smooth;
mod smooth_quantities;
mod smooth_run;
mod steps;
mod system;
mod tangents;

pub use error::SensitivityError;
pub use histories::{History, Tangents};
pub use instants::{Instants, Outputs};
pub use rows::Quantity;
pub use system::{LinkDerivative, SystemDerivative, VariedSystem};
