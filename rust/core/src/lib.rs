//! Dynamic load of linear rolling guides.
#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "std")]
pub mod bands;
#[cfg(feature = "std")]
pub mod batch;
mod contacts;
mod equations;
mod error;
mod excitation;
mod integrate;
mod model;
mod numeric;
mod output;
#[cfg(feature = "std")]
pub mod smoother;
mod system;

#[cfg(feature = "std")]
pub use batch::{BatchError, SampleError};
pub use error::{ExcitationError, RunError, SceneError};
pub use excitation::{Excitation, wrench_at};
pub use integrate::{Control, Exact, Method, Output, Radau, Rk45, Summary, load_scale, run};
pub use model::{
    Body, Dof, Free, Law, LawParameter, Link, MAX_CURVE_POINTS, Scene, carriage_ends, carriage_links,
};
pub use numeric::tensor;
pub use output::{
    Axial, Extremes, History, Part, Peaks, Record, Recovery, Wrench, acceleration, evaluate, group_load,
    link_load, position, reaction, velocity,
};
pub use system::{
    Input, Matrices, Mode, ModelLevel, State, System, assemble, eigenvalues, input_from, modes,
};
