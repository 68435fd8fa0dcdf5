//! What samples of a motion leave open about the loads of a linear scene.
//!
//! The acceleration along x deviates from its estimate: at the stamps of the samples by a number of the chain of [`Posterior`], linear in
//! between, as the exact method has it. The machine's state z deviates with it, z' = A z + f a(t), from nothing at the first stamp: a run starts at
//! rest. (d, z) is a Markov chain again. [`spread`] takes its covariance along, [`peaks`] draws of it.
//!
//! `schedule` (what happens when) → `covariance` → `spread`; `schedule` → `peaks`.

mod covariance;
mod deviations;
mod peaks;
mod schedule;

pub use deviations::{StandardDeviations, standard_deviations};
pub use peaks::{NominalLoads, draw_peaks};
pub use schedule::Deviation;
