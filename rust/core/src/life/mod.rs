//! What the rating life needs of the loads: the equivalent load of a carriage, and integrals of its power over the travel, by the code of
//! `guideload_life`.

mod equivalent_load;
mod power;
#[cfg(feature = "std")]
mod weights;

pub use equivalent_load::{EquivalentLoad, Preload};
#[cfg(feature = "std")]
pub(crate) use guideload_life::COMPONENTS;
pub use guideload_life::{Integrals, Interval, Rule};
pub use power::LoadPower;
#[cfg(feature = "studies")]
pub(crate) use power::{LAST_GAP, NEARLY_CONSTANT, mean_by_series};
