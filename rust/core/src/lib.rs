//! Dynamic load of linear rolling guides: one rigid body on elastic and damping links, driven by a measured motion.
//!
//! The files follow the data: [`tensor`] → [`body`], [`law`] → [`link`], [`dof`] → [`scene`] → [`assemble`] → `factor` (modes), `statics`
//! → [`system`] → [`excitation`] → `equations` and who keeps them: [`system`] (linear), `piece` and `contacts` (linear between contact
//! changes), `smooth` (preloaded) → `propagator`, [`integrate`] → [`record`] → [`loads`], `fill`; [`modes`] stands beside them. With `std` a
//! `batch` runs many scenes, `smoother` finds the motion behind a trace, and `bands` carries what that leaves open to the loads. All quantities are SI. Source: the paper "Dynamical load of
//! linear rolling guides", whose equation numbers stand where they are used.
//!
//! A new elastic law goes into [`law`], a new method into [`integrate`] beside the three that are there.
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
#![cfg_attr(not(feature = "std"), no_std)]

pub mod assemble;
#[cfg(feature = "std")]
pub mod bands;
#[cfg(feature = "std")]
pub mod batch;
pub mod body;
mod contacts;
pub mod dof;
mod equations;
pub mod error;
pub mod excitation;
mod factor;
mod fill;
mod float;
pub mod integrate;
pub mod law;
pub mod link;
pub mod loads;
mod many;
pub mod modes;
#[cfg(feature = "std")]
mod normal;
mod piece;
mod propagator;
pub mod record;
mod rows;
pub mod scene;
mod simd;
mod smooth;
#[cfg(feature = "std")]
pub mod smoother;
mod statics;
pub mod system;
pub mod tensor;

pub use assemble::{Matrices, assemble};
pub use body::Body;
pub use dof::{Dof, Free};
#[cfg(feature = "std")]
pub use error::{BatchError, SampleError};
pub use error::{ExcitationError, RunError, SceneError};
pub use excitation::{Excitation, wrench_at};
#[cfg(feature = "std")]
pub use integrate::Named;
pub use integrate::{Control, Exact, Method, Output, Radau, Rk45, Summary, load_scale, run};
pub use law::Law;
pub use link::{Link, carriage_ends, carriage_links};
pub use loads::{Axial, Part, Wrench, group_load, link_load};
pub use modes::{Mode, eigenvalues, modes};
pub use record::{Extremes, History, Peaks, Record};
pub use scene::Scene;
pub use system::{Input, Rung, State, System};

/// The Rust of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
