//! What the rating life needs of the loads: the equivalent load of a carriage, and integrals of its power over the travel, by the code of
//! `guideload_life`.

#[cfg(feature = "studies")]
mod combinations;
mod equivalent_load;
mod power;
#[cfg(feature = "std")]
mod weights;

#[cfg(feature = "studies")]
pub use combinations::{Combinations, combinations, largest_of};
pub use equivalent_load::{EquivalentLoad, Preload};
#[cfg(feature = "std")]
pub(crate) use guideload_life::COMPONENTS;
pub use guideload_life::{Integrals, Interval, Rule};
pub use power::LoadPower;
#[cfg(feature = "studies")]
pub(crate) use power::{LAST_GAP, MAX_EXPONENT, NEARLY_CONSTANT, mean_by_series, speed_coefficients};
