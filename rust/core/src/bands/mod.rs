//! Credible bands of the loads of a linear scene, from the uncertainty of the estimated motion.
//!
//! At the time stamps, the deviation a of the acceleration along x from its estimate is an entry of the state d of
//! [`Posterior`](crate::smoother::Posterior); between them it is linear, as in the exact method. It causes a deviation z of the machine's
//! state, z' = A z + f a(t), with z = 0 at the first time stamp, because a run starts at rest. (d, z) is again a Markov chain.
//! [`standard_deviations`] propagates its covariance, [`draw_peaks`] draws random peaks from it.
//!
//! `schedule` (the order of samples and instants) → `covariance` → `deviations`; `schedule` → `peaks`.

mod covariance;
mod deviations;
mod peaks;
mod schedule;

pub use deviations::{StandardDeviations, standard_deviations};
pub use peaks::{NominalLoads, draw_peaks};
pub use schedule::Deviation;
