//! Credible bands of the loads of a linear scene: what the uncertainty of the estimated motion leaves open.
//!
//! The acceleration along x deviates from its estimate: at the time stamps by a number of the state of
//! [`Posterior`](crate::smoother::Posterior), linearly in between, as the exact method has it. The state z of the machine deviates with
//! it, z' = A z + f a(t), from zero at the first time stamp, as a run starts at rest. (d, z) is again a Markov chain.
//! [`standard_deviations`] propagates its covariance, [`draw_peaks`] draws from it.
//!
//! `schedule` (what happens when) → `covariance` → `deviations`; `schedule` → `peaks`.

mod covariance;
mod deviations;
mod peaks;
mod schedule;

pub use deviations::{StandardDeviations, standard_deviations};
pub use peaks::{NominalLoads, draw_peaks};
pub use schedule::Deviation;
