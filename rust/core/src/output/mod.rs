//! Results from states: loads and motions of L (`loads`) in chosen axes (`axes`), their evaluation at all instants (`evaluate`), those of
//! a body with moving riders (`riding`), and what a run records (`record`).

mod axes;
mod evaluate;
mod loads;
mod record;
mod riding;

pub use axes::Axes;
pub use evaluate::evaluate;
#[cfg(feature = "std")]
pub(crate) use loads::Linear;
pub use loads::{
    Axial, Part, Recovery, Wrench, acceleration, group_load, group_load_along, link_load, position, reaction,
    velocity,
};
#[cfg(feature = "std")]
pub use record::Watched;
pub use record::{Extremes, History, Peaks, Record};
pub use riding::{Ridden, RiddenInstant};
