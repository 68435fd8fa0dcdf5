//! Results from states: loads and motions of L (`loads`) in chosen axes (`axes`), their evaluation at all instants (`evaluate`), those of
//! a body with moving riders (`riding`), mean loads between instants (`mean_loads`), and what a run records: states (`record`), or extremes (`peaks`, with `bounds` and `block_values` at
//! the instants, `bows`, `between` and `search` between them).

mod axes;
mod between;
mod block_values;
mod bounds;
mod bows;
mod evaluate;
mod extremes;
mod loads;
#[cfg(feature = "std")]
mod mean_loads;
mod peaks;
mod record;
mod riding;
mod search;

pub use axes::Axes;
pub use evaluate::evaluate;
pub use extremes::Extremes;
pub(crate) use loads::Linear;
pub use loads::{
    Axial, Part, Recovery, Wrench, acceleration, group_load, group_load_along, largest_velocity_change,
    link_load, position, reaction, velocity,
};
#[cfg(feature = "std")]
pub use mean_loads::ReferenceMotion;
#[cfg(feature = "studies")]
pub(crate) use mean_loads::{INSIDE, between, contacts, finer_bow, mark_changes, simpson_bow};
pub use peaks::Peaks;
#[cfg(feature = "std")]
pub use record::Watched;
pub use record::{History, Record};
pub use riding::{BodyWithRiders, BodyWithRidersInstant};
#[cfg(feature = "studies")]
pub(crate) use {
    block_values::{evaluate_block, transpose},
    bows::{BOW, beyond, is_unknown},
};
