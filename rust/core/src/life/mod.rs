//! What the rating life needs of the loads: the equivalent load of a carriage, and integrals of its power over the travel.

mod equivalent_load;
mod power_of_linear;
mod rows;
mod travel;
#[cfg(feature = "std")]
mod weights;

#[cfg(feature = "std")]
pub(crate) use equivalent_load::COMPONENTS;
pub use equivalent_load::{EquivalentLoad, Preload};
pub use travel::{Integrals, Interval};
