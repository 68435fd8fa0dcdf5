//! Dynamic load of linear rolling guides: one rigid body on elastic and damping links, driven by a measured motion.
//!
//! All quantities are SI. Equation numbers are those of the paper "Dynamical load of linear rolling guides".
//!
//! # Use
//!
//! Describe a [`Scene`] (a [`Body`], its [`Link`]s with their [`Law`]s, gravity, the [`Free`] degrees of freedom) and compute its [`System`].
//! Then [`run`] it under an [`Excitation`] with a [`Method`], and compute loads from the recorded states:
//!
//! ```
//! use guideload::{Body, Control, Exact, Excitation, Extremes, Free, Output, Part, Peaks, Scene, System};
//! use guideload::{carriage_links, group_load, run};
//! use nalgebra::{Matrix3, Vector3};
//!
//! let inertia = Matrix3::new(420.0, 15.0, -8.0, 15.0, 310.0, 22.0, -8.0, 22.0, 380.0);
//! let body = Body::new(1250.0, Vector3::new(0.12, -0.65, 0.18), inertia)?;
//! let centers = [-0.35, 0.35].map(|z| Vector3::new(0.0, 0.05, z));
//! let guides = [
//!     carriage_links(centers[0], 0.6, [120e6; 2], [100e3; 2])?,
//!     carriage_links(centers[1], 0.6, [120e6; 2], [100e3; 2])?,
//! ];
//! let scene = Scene::new(body, guides.as_flattened(), Vector3::new(0.0, -9.80665, 0.0), Free::GUIDED)?;
//! let system = System::new(&scene)?;
//! let loads = [0, 1].map(|g| group_load(&system, 4 * g..4 * g + 4, centers[g], Part::Total));
//! let mut extremes = [Extremes::NONE; 2];
//! let motion = [[0.0, 0.0, 0.0], [2.2, 0.0, 0.0], [2.2, 0.0, 0.0], [0.0, 0.0, 0.0]];
//! let excitation = Excitation::uniform(0.0, 0.088, &motion)?;
//! let control = Control::Adaptive { rtol: 1e-6 };
//! let mut peaks = Peaks::new(&loads, &mut extremes);
//! run(&system, &Exact::<1>, control, &excitation, Output::Samples, &mut peaks)?;
//! assert!(extremes[1].largest[6] > 9000.0); // N, the y-z resultant of guide 2
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! All of this works without the feature `std` and without an allocator. The feature `std` adds [`batch`] (Monte Carlo), [`sensitivity`]
//! (derivatives), [`smoother`] (the motion from a measured trace) and [`bands`] (the uncertainty of the loads).
//!
//! # Source
//!
//! The folders are layers in the order of the data; each imports only from those above it, which `tests/layers.rs` checks.
//!
//! - `error`: error types and their messages.
//! - `numeric`: elementary functions, vector loops, bounded vector, tensors, random numbers.
//! - `model`: body, riders, degrees of freedom, laws, links, scene. **A new elastic law goes into `model/law`.**
//! - `system`: matrices, static equilibrium, undamped modes; the state in energy coordinates.
//! - `excitation`: acceleration, external load and motion of riders over time, and the modal force that they cause.
//! - `equations`: the equations of motion (linear, piecewise linear, smooth) and the exact solution over a step.
//! - `contacts`: the instants at which a link leaves a segment of its law.
//! - `output`: loads and motions from states; what a run records.
//! - `life`: the equivalent load of a carriage, and integrals of its power over the travel.
//! - `integrate`: the loop over the samples, step-size control, and the methods. **A new integrator goes into `integrate`.**
//! - `variation`: scenes whose numbers vary; `sensitivity`: exact derivatives by them; both with `std` only.
//! - `smoother`, `bands`, `batch`: with `std` only. A new statistic of Monte Carlo samples goes into `batch/measure` and
//!   `batch/requirements`.
#![cfg_attr(not(feature = "std"), no_std)]
#![deny(unsafe_code)]

#[cfg(feature = "std")]
pub mod bands;
#[cfg(feature = "std")]
pub mod batch;
mod contacts;
mod equations;
mod error;
mod excitation;
mod integrate;
mod life;
mod model;
mod numeric;
mod output;
#[cfg(feature = "std")]
pub mod sensitivity;
#[cfg(feature = "std")]
pub mod smoother;
mod system;
#[cfg(feature = "std")]
mod variation;

// Describe: a scene and what drives it.
pub use excitation::{Excitation, MAX_RIDERS, RiderMotion, wrench_at};
pub use model::{
    Body, Dof, Free, Law, LawParameter, Link, MAX_CURVE_POINTS, Rider, Scene, carriage_ends, carriage_links,
};
pub use numeric::tensor;
#[cfg(feature = "std")]
pub use numeric::watch::Watch;

// Solve: the system, its modes, and a run.
pub use equations::SampledSystem;
#[cfg(feature = "std")]
pub use integrate::NamedMethod;
pub use integrate::{
    Control, Exact, Exponential, Method, Output, Radau, Rk45, Start, Summary, load_scale, run, run_from,
};
pub use system::{
    Input, Matrices, Mode, ModelLevel, State, StateBox, System, assemble, eigenvalues, input_from, modes,
};

// Read out: records of a run, and loads and motions from its states.
pub use output::{
    Axes, Axial, Extremes, History, Part, Peaks, Record, Recovery, Ridden, RiddenInstant, Wrench,
    acceleration, evaluate, group_load, group_load_along, link_load, position, reaction, velocity,
};

#[cfg(feature = "std")]
pub use output::Watched;

// Judge: the equivalent load of a carriage over its travel.
pub use life::{EquivalentLoad, Integrals, Interval, Preload};

// Errors.
#[cfg(feature = "std")]
pub use batch::BatchError;
#[cfg(feature = "std")]
pub use error::Stopped;
pub use error::{ExcitationError, OtherMethod, RunError, SceneError};
#[cfg(feature = "std")]
pub use variation::{ChangeError, SampleError};

/// The Rust of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
