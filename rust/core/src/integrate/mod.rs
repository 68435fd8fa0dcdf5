//! Time integration: [`run`] advances a [`Method`] from sample to sample of an excitation, with steps by a [`Control`].
//!
//! A new integrator is one file beside `exact`, `exponential`, `rk45` and `radau` with an implementation of [`Method`], a line here, and a row in
//! `named_method`. It computes one step of given length. `run` chooses the lengths, locates contact changes and records, for all methods.

mod budget;
mod control;
mod equal_intervals;
mod exact;
mod exact_steps;
mod exponential;
mod free_vibration;
#[cfg(feature = "studies")]
mod lane_group;
#[cfg(feature = "studies")]
mod lane_scene;
mod long_step;
mod long_step_plan;
mod method;
mod named_method;
mod radau;
mod recorder;
mod rk45;
mod run;
#[cfg(feature = "studies")]
mod side_by_side;
mod start;
mod step_cache;
mod step_control;
mod step_loop;
mod step_to_change;
mod tableau;

pub use control::{Control, load_scale};
pub use exact::Exact;
pub use exponential::Exponential;
pub use method::{Method, Output, Summary};
pub use named_method::NamedMethod;
pub use radau::Radau;
pub use rk45::Rk45;
pub(crate) use run::check_output;
pub use run::{run, run_from};
#[cfg(feature = "studies")]
pub(crate) use side_by_side::{SceneRun, run_side_by_side, scenes_side_by_side};
pub use start::Start;
