//! Monte Carlo: many samples of one scene under one motion; values in, measures out, on any number of threads.
//!
//! Files in the order of the data: `description` (of a batch) → `run`, `worker` (its threads) → `variation` (the scene of a sample) →
//! `motion_draws` (its motion, if drawn) → `windows` (of the motion, between changes of payload) → `lanes` (linear scenes, one per vector
//! lane), `preloaded` (preloaded scenes side by side) or `single` (any other scene), the last two with `load_extremes`, `load_rows` and
//! `reduce` → `signals`, `requirements`, `time_statistics` (what the measures need) → `measure`. The result of a sample depends on its own
//! values only, to the last bit.

mod description;
mod drawn;
mod equivalent;
mod error;
mod lanes;
mod lines;
mod load_extremes;
mod load_rows;
mod measure;
mod motion_draws;
mod power_integral;
mod preloaded;
mod reduce;
mod requirements;
mod run;
mod signals;
mod single;
mod time_statistics;
mod travel;
mod windows;
mod worker;

pub use crate::variation::{Base, Change, Group, Instance, NominalBody, Payload, Plan, SampleError, Target};
pub use description::Batch;
pub use error::BatchError;
pub use lanes::Width;
pub use measure::{Measure, Quantity, Statistic, time_weights};
pub use motion_draws::MotionDraws;
pub use run::SAMPLES;
pub use travel::Motion;
