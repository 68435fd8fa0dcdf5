//! What samples of a motion leave open about the loads of a linear scene.
//!
//! The acceleration along x deviates from its estimate: at the stamps of the samples by a number of the chain of [`Posterior`], linear in
//! between, as the exact method has it. The machine's state z deviates with it, z' = A z + f a(t), from nothing at the first stamp: a run starts at
//! rest. (d, z) is a Markov chain again. [`spread`] takes its covariance along, [`peaks`] draws of it.
//!
//! `course` (what happens when) → `covariance` → `spread`; `course` → `peaks`.

mod course;
mod covariance;
mod peaks;
mod spread;

pub use course::Deviation;
pub use peaks::{Nominal, peaks};
pub use spread::{Spread, spread};
