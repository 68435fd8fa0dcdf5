//! Dynamic load of linear rolling guides: one rigid body on elastic and damping links, driven by a measured motion.
//!
//! A machine accelerates on its rails. Each of its carriages bears a share of the weight and of the inertia forces, and vibrates on the balls
//! or rollers in between. This crate computes the loads of the carriages over time: what they bear at most, when, and for how long. The drive
//! holds the body along the rails; its other five degrees of freedom are small motions on the springs and dampers of the carriages.
//!
//! # A machine and its loads
//!
//! ```
//! use guideload::{Carriage, Excitation, Machine, MassProperties};
//!
//! let mut machine = Machine::new(MassProperties {
//!     mass: 1250.0,                          // kg
//!     center_of_mass: [0.12, -0.65, 0.18],   // m, from L, where the drive acts; x along the rails, y up
//!     inertia: [[420.0, 15.0, -8.0], [15.0, 310.0, 22.0], [-8.0, 22.0, 380.0]], // kg m², about the centre of mass
//! })?;
//! let guide = Carriage {
//!     length: 0.6,                           // m
//!     stiffness_y: 120e6,                    // N/m
//!     stiffness_z: 120e6,
//!     damping_y: 1e4,                        // N s/m
//!     damping_z: 1e4,
//!     ..Carriage::default()
//! };
//! let left = machine.add(guide.at([0.0, 0.05, -0.35]))?;
//! let right = machine.add(guide.at([0.0, 0.05, 0.35]))?;
//! let simulation = machine.assemble()?;
//!
//! // The weight alone: both guides together bear 1250 kg.
//! let at_rest = simulation.loads_at_rest();
//! assert!((at_rest[left].fy + at_rest[right].fy + 1250.0 * 9.80665).abs() < 1e-6);
//!
//! // Accelerate to 2.2 m/s² in 0.1 s, hold, and let go. The acceleration is linear between the samples.
//! let acceleration = [0.0, 2.2, 2.2, 0.0].map(|along| [along, 0.0, 0.0]);
//! let excitation = Excitation::uniform(0.0, 0.1, &acceleration)?;
//! let extremes = simulation.extremes(&excitation)?;
//! let peak = extremes[right].resultant.largest;
//! assert!(peak.value > at_rest[right].resultant() && peak.time > 0.05);
//! # Ok::<(), guideload::Error>(())
//! ```
//!
//! Springs that open, clear a gap or are preloaded: give a carriage a [`Law`]. The method of the run follows from the laws; without preload
//! there is no step error and nothing to choose. [`Simulation::at_samples`] gives the loads at every sample.
//!
//! # Step by step, on a controller
//!
//! A [`Live`] step takes the acceleration of the present period and gives the loads, in f64 or f32, in a fixed number of operations:
//!
//! ```
//! # use guideload::{Carriage, Error, Machine, MassProperties};
//! # fn simulation() -> Result<guideload::Simulation, Error> {
//! #     let inertia = [[420.0, 0.0, 0.0], [0.0, 310.0, 0.0], [0.0, 0.0, 380.0]];
//! #     let mut machine = Machine::new(MassProperties { mass: 1250.0, center_of_mass: [0.1, -0.6, 0.1], inertia })?;
//! #     let guide = Carriage { length: 0.6, stiffness_y: 1e8, stiffness_z: 1e8, damping_y: 1e4, damping_z: 1e4, ..Carriage::default() };
//! #     machine.add(guide.at([0.0, 0.05, -0.35]))?;
//! #     machine.add(guide.at([0.0, 0.05, 0.35]))?;
//! #     Ok(machine.assemble()?)
//! # }
//! let mut live = simulation()?.live::<f32>(1e-3)?; // every 1 ms
//! let loads = live.step(2.2); // m/s²
//! for load in loads.iter() {
//!     println!("{:.0} N along y, {:.0} N along z", load.fy, load.fz);
//! }
//! # Ok::<(), Error>(())
//! ```
//!
//! # The long way
//!
//! The short way covers carriages and accelerations. Everything else is below it: describe a [`Scene`] (a [`Body`], any [`Link`]s with their
//! [`Law`]s, gravity, the [`Free`] degrees of freedom) and compute its [`System`]; [`run`] it under an [`Excitation`], with moving riders
//! and external loads, with a [`Method`] and a [`Control`] of your choice; a [`Record`] receives the states, and [`group_load`], [`position`] or
//! [`reaction`] read them. [`EquivalentLoad`] judges a load over its travel.
//!
//! All of this works without the feature `std`, a default, and without an allocator, then with up to eight carriages. The feature `studies` adds
//! `batch` (Monte Carlo), `sensitivity` (derivatives), `smoother` (the motion from a measured trace) and `bands` (the uncertainty of the
//! loads), which take as long to compile as all the rest. Without the feature `any-processor`, a default, programs compile in four fifths of the
//! time and need AVX2 and FMA on x86-64 (see [`runs_on_this_processor`]).
//!
//! # Units and source
//!
//! Vectors and matrices are those of [`nalgebra`], which is exported here in the version that the functions take.
//!
//! All quantities are SI. Equation numbers are those of the paper "Dynamical load of linear rolling guides".
//!
//! The folders of the source are layers in the order of the data; each imports only from those above it, which `tests/layers.rs` checks.
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
//! - `variation`: scenes whose numbers vary; `sensitivity`: exact derivatives by them; both with the feature `studies` only.
//! - `smoother`, `bands`, `batch`: with `studies` only. A new statistic of Monte Carlo samples goes into `batch/measure` and
//!   `batch/requirements`.
//! - `machine`, `live`: the short way, and nothing else.
#![cfg_attr(not(feature = "std"), no_std)]
#![deny(unsafe_code)]
// Modules that need a feature are gated; what they alone use below them is not, as it is not compiled to code then.
#![cfg_attr(not(feature = "studies"), allow(dead_code, unused_imports))]

#[cfg(feature = "studies")]
pub mod bands;
#[cfg(feature = "studies")]
pub mod batch;
mod contacts;
mod equations;
mod error;
mod excitation;
mod integrate;
mod life;
mod live;
mod machine;
mod model;
mod numeric;
mod output;
#[cfg(feature = "studies")]
pub mod sensitivity;
#[cfg(feature = "studies")]
pub mod smoother;
mod system;
#[cfg(feature = "studies")]
mod variation;
#[cfg(test)]
mod yardstick;

pub use nalgebra;

// The short way: a machine by named values, and the method chosen for it.
pub use live::{Error, Live, Number};
pub use machine::{
    Carriage, CarriageId, Load, LoadExtremes, Machine, MassProperties, Peak, PerCarriage, Range, Simulation,
};

// Describe: a scene and what drives it.
pub use excitation::{Excitation, MAX_RIDERS, RiderMotion, wrench_at};
pub use model::{
    Body, Dof, Free, Law, LawParameter, Link, MAX_CURVE_POINTS, Rider, Scene, carriage_ends, carriage_links,
};
pub use numeric::simd::runs_on_this_processor;
pub use numeric::tensor;
#[cfg(feature = "std")]
pub use numeric::watch::Watch;

// Solve: the system, its modes, and a run.
pub use equations::SampledSystem;
pub use integrate::{
    Control, Exact, Exponential, Method, NamedMethod, Output, Radau, Rk45, Start, Summary, load_scale, run,
    run_from,
};
pub use system::{
    Input, Matrices, Mode, ModelLevel, State, StateBox, System, assemble, eigenvalues, input_from, modes,
};

// Read out: records of a run, and loads and motions from its states.
pub use output::{
    Axes, Axial, BodyWithRiders, BodyWithRidersInstant, Extremes, History, Part, Peaks, Record, Recovery,
    Wrench, acceleration, evaluate, group_load, group_load_along, largest_velocity_change, link_load,
    position, reaction, velocity,
};

#[cfg(feature = "std")]
pub use excitation::{enough_parts, limit_parts, repeated_lengths};
#[cfg(feature = "std")]
pub use output::{ReferenceMotion, Watched};

// Judge: the equivalent load of a carriage over its travel.
#[cfg(feature = "studies")]
pub use life::{Combinations, combinations, largest_of};
pub use life::{EquivalentLoad, Integrals, Interval, LoadPower, Preload, Rule};

// Errors.
#[cfg(feature = "studies")]
pub use batch::BatchError;
#[cfg(feature = "std")]
pub use error::Stopped;
pub use error::{ExcitationError, OtherMethod, RunError, SceneError};
#[cfg(feature = "studies")]
pub use variation::{ChangeError, SampleError};

/// The Rust of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
