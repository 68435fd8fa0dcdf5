//! A load monitor for a controller: from encoder counts to the loads of the carriages of a linear guide, and the life that they use.
//!
//! A PC computes the constants of a machine ([`Prepared`]); the controller keeps them in flash, and the state of a [`Monitor`] in RAM:
//!
//! ```
//! # use guideload_monitor::{Monitor, Prepared};
//! # fn on_sample(monitor: &mut Monitor<f32, 10, 4, 64>, prepared: &Prepared<f32, 10, 4, 64>, stamp: u32, count: u32) {
//! monitor.push(prepared, stamp, count); // once per period: time stamp and counter
//! let [y, z, ..] = monitor.loads()[0]; // N, on the first carriage
//! let largest = monitor.totals().carriages[0].largest[6]; // N, largest equivalent load so far
//! # }
//! ```
//!
//! Each call takes bounded time: the number of operations does not depend on the past, nothing is allocated, no call is recursive, and no
//! path panics. A sample gives the loads at the instant `lag` periods earlier, because an acceleration can be told from counts only with
//! samples after it; lag 0 uses the past alone.
//!
//! - `sum`, `flag`: sums of very many terms; yes or no. f32 and f64, the equivalent load of a carriage and its power over the travel are
//!   those of `guideload_life`.
//! - `prepared`: the constants.
//! - `input`: samples to second differences, with missing and wrong ones bridged.
//! - `movement`, `slow`: whether the axis stands, or moves slowly; travel and load of movement by single counts.
//! - `totals`, `monitor`, `record`: what is kept; the step from sample to sample; saving it.
//! - `prepare`, `many`: the constants from a scene, and many samples in one call; on a PC (feature `prepare`).
#![no_std]
#![deny(unsafe_code)]

#[cfg(feature = "prepare")]
extern crate std;

mod flag;
mod input;
#[cfg(feature = "prepare")]
mod many;
mod monitor;
mod movement;
#[cfg(feature = "prepare")]
mod prepare;
mod prepared;
mod record;
mod slow;
mod sum;
mod totals;

pub use flag::Flag;
pub use guideload_life::{COMPONENTS, Exponent, Real, Rule};
pub use input::{Counters, Sample};
pub use monitor::{Monitor, Motion, PERIODS_PER_CALL};
#[cfg(feature = "prepare")]
pub use prepare::{Judgement, PrepareError, Settings, prepare};
pub use prepared::{Carriage, FRACTION, InputSettings, Prepared};
pub use record::{RecordError, crc32, record_length};
pub use sum::Sum;
pub use totals::{BINS, CarriageTotals, QUANTITIES, Totals};
