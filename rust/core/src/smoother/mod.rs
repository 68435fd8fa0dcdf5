//! Kalman filter and fixed-interval smoother of a sampled motion.
//!
//! The state is the position and its first N - 1 derivatives, N = 2 to 6. The N-th derivative is white noise (process noise) of constant
//! spectral density in each segment, a stretch of intervals between samples. (With an oscillator, of 4 to 6 numbers some are others:
//! `ringing`.) A sample is the position (or, for velocity samples, the velocity
//! in its place) plus white noise (measurement noise) of its own variance. All quantities have the caller's units; a time unit near the
//! sampling interval scales the numbers well.
//!
//! Files in the order of the data:
//!
//! - `data`: samples in, estimates out; `transition`: the state over one interval, of `derivatives` or of a `ringing` axis, which follows its
//!   drive as an oscillator does.
//! - `passes`: filter forwards (Kalman 1960, with the exact noise of each interval) and smoother backwards, with the score r and its variance
//!   (de Jong 1989; Durbin and Koopman 2012, section 4.4). They also give the derivative of the likelihood with respect to each noise
//!   density, and the leave-one-out residual of each sample (de Jong and Penzer 1998).
//! - `square_root` → `posterior`: deviations from the estimate as a Markov chain; `variance_recovery`, `draw`: variances and random
//!   deviations from it; `block_step`: several of its steps as one.
//! - `rounding`: samples rounded to a quantum, replaced by normal ones (site approximations of expectation propagation).
//! - `smooth`, `adapt`: the entry points.

mod adapt;
mod block_step;
mod data;
mod derivatives;
mod draw;
mod passes;
mod posterior;
mod ringing;
mod rounding;
mod smooth;
mod square_root;
mod transition;
mod variance_recovery;

pub use adapt::{AdaptationRule, Adapted, adapt};
pub(crate) use block_step::{BLOCK, BlockStep};
pub use data::{Oscillator, ProcessNoise, Rounded, Samples, SiteApproximations, Smoothed, Start};
pub(crate) use draw::DeviationDraws;
pub use draw::draw;
pub use posterior::{MAX_ORDER, MarkovStep, Posterior, PosteriorInput, Square};
pub use smooth::{likelihood, smooth};
