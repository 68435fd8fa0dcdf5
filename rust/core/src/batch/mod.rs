//! Monte Carlo: many samples of one scene under one motion; values in, measures out, on any number of threads.
//!
//! Files in the order of the data: `variation` (the scene of a sample) → `motion_draws` (the motion of a sample, if it is
//! drawn) → `windows` (of the motion, between changes of payload) → `lanes` (linear scenes, one per vector lane) or `single` (any other scene, with `load_rows` and `reduce`) →
//! `requirements`, `statistics` (what the measures need) → `measure`. The result of a sample depends on its own values only, to the last bit.

mod drawn;
mod equivalent;
mod error;
mod lanes;
mod load_rows;
mod measure;
mod motion_draws;
mod power_integral;
mod reduce;
mod requirements;
mod single;
mod solver;
mod time_statistics;
mod travel;
mod windows;
mod worker;

pub use crate::variation::{Base, Change, Group, Instance, NominalBody, Payload, Plan, SampleError, Target};
pub use error::BatchError;
pub use lanes::Width;
pub use measure::{Measure, Quantity, Statistic, time_weights};
pub use motion_draws::MotionDraws;
pub use solver::Solver;
pub use travel::Motion;

use std::sync::Mutex;

use crate::error::{RunError, Stopped};
use crate::integrate::{Control, Start};
use crate::model::Dof;
use crate::numeric::watch::{Watch, check_memory, on_threads, room};
use drawn::Drawn;
use lanes::Lanes;
use requirements::Requirements;
use single::RunSettings;
use windows::Window;
use worker::Worker;

/// Number of samples that a thread runs at a time.
pub const SAMPLES: usize = 64;

/// A batch: base scene, motion, changes and measures. Immutable and shared by all threads.
#[derive(Debug, Clone)]
pub struct Batch<'a> {
    base: Base<'a>,
    motion: Motion<'a>,
    plan: Plan,
    first: Instance,
    start: Start,
    measures: Vec<Measure>,
    /// Between the changes of payload; at least one.
    windows: Vec<Window<'a>>,
    lanes: Lanes<'a>,
    typical_interval: f64,
    solver: Solver,
    rtol: f64,
    watch: Watch<'a>,
    /// Draws of the motion, and the column of values with their numbers.
    draws: Option<(&'a MotionDraws, usize)>,
}

/// Memory of a batch for each sample of its motion: times, intervals, kinds and weights, and for each component value, change and range.
const BYTES_PER_SAMPLE: usize = 48;
const BYTES_PER_COMPONENT: usize = 17;
/// Memory of the travel for each sample: an interval and up to nine weights.
const BYTES_OF_TRAVEL: usize = 112;

impl<'a> Batch<'a> {
    /// A batch of `changes` of a `base` under a `motion`. `rtol`: error of the link loads relative to [`crate::load_scale`], for methods
    /// with a step error.
    ///
    /// # Errors
    /// [`BatchError`] for a target that does not exist or is changed twice, for an argument out of range, and for a base that is not a valid
    /// scene without changes. Support and equilibrium are checked for each sample.
    pub fn new(
        base: Base<'a>,
        motion: Motion<'a>,
        changes: &[Change],
        measures: &[Measure],
        solver: Solver,
        rtol: f64,
    ) -> Result<Self, BatchError> {
        let (excitation, count) = (&motion.excitation, base.links.len());
        for (group, links) in base.groups.iter().map(|group| &group.links).enumerate() {
            if let Some(&link) = links.iter().find(|link| **link >= count) {
                return Err(BatchError::Group { group, link, count });
            }
        }
        if let Some(&measure) = measures.iter().find(|m| m.group().is_some_and(|g| g >= base.groups.len())) {
            return Err(BatchError::Measure { measure });
        }
        if !(motion.exponent >= 1.0 && motion.exponent.is_finite()) {
            return Err(BatchError::Exponent { got: motion.exponent });
        }
        if let Some(speed) = motion.speed {
            let (expected, got) = (excitation.count(), speed.len());
            if expected != got {
                return Err(BatchError::Length { field: "speed", expected, got });
            }
            if let Some(index) = speed.iter().position(|x| !x.is_finite()) {
                return Err(BatchError::Speed { index });
            }
        }
        Control::Adaptive { rtol }.check(solver != Solver::Exact)?;
        let components = excitation.peak().iter().filter(|peak| **peak > 0.0).count();
        let travel = if motion.speed.is_some() { BYTES_OF_TRAVEL } else { 0 };
        let bytes = BYTES_PER_SAMPLE + BYTES_PER_COMPONENT * components + travel;
        check_memory(bytes.saturating_mul(excitation.count()))?;
        let drive_is_held = !base.free.contains(Dof::X);
        let mut intervals: Vec<f64> = (1..excitation.count()).map(|k| excitation.interval(k - 1)).collect();
        intervals.retain(|length| *length > 0.0);
        intervals.sort_unstable_by(f64::total_cmp);
        let requirements = Requirements::new(measures, drive_is_held, base.groups, &motion);
        let windows = windows::windows(excitation, base.payloads, requirements)?;
        Ok(Self {
            lanes: Lanes::new(&base, &windows, Start::AtRest, false, Width::Widest),
            plan: Plan::new(&base, changes)?,
            first: Instance::new(&base)?,
            start: Start::AtRest,
            measures: measures.to_vec(),
            windows,
            typical_interval: intervals.get(intervals.len() / 2).copied().unwrap_or(0.0),
            base,
            motion,
            solver,
            rtol,
            watch: Watch::NEVER,
            draws: None,
        })
    }

    /// The batch with a watch, which may stop [`Batch::run`] and [`Batch::histories`] with [`BatchError::Stopped`].
    pub fn with_watch(mut self, watch: Watch<'a>) -> Self {
        self.watch = watch;
        self
    }

    /// The batch with another vector width for linear scenes. The width changes the speed, but no bit of the results.
    pub fn with_width(mut self, width: Width) -> Self {
        self.lanes = Lanes::new(&self.base, &self.windows, self.start, self.draws.is_some(), width);
        self
    }

    /// The batch with another start of all samples than [`Start::AtRest`].
    pub fn with_start(mut self, start: Start) -> Self {
        self.start = start;
        let width = self.lanes.width();
        self.with_width(width)
    }

    /// The batch with a draw of the motion for each sample: the one whose number, a whole one, is in this column of its values.
    ///
    /// # Panics
    /// If the draws are for another number of samples of the motion.
    pub fn with_motion_draws(mut self, draws: &'a MotionDraws, column: usize) -> Self {
        assert_eq!(draws.count(), self.motion.excitation.count(), "draws of this motion");
        self.draws = Some((draws, column));
        let width = self.lanes.width();
        self.with_width(width)
    }

    /// Columns of values that changes and draws need.
    pub fn columns(&self) -> usize {
        usize::max(self.plan.columns(), self.draws.map_or(0, |(_, column)| column + 1))
    }

    /// The measures, in the order of the columns of results.
    pub fn measures(&self) -> &[Measure] {
        &self.measures
    }

    /// Runs `count` samples with `values` (count, columns), row by row, on `threads` threads, and writes their measures to `out` (count,
    /// measures). A sample without result gets a row of NaN, and its index is returned with the reason.
    ///
    /// # Errors
    /// [`BatchError::Columns`], [`BatchError::Length`], [`BatchError::Stopped`].
    pub fn run(
        &self,
        count: usize,
        values: &[f64],
        threads: usize,
        out: &mut [f64],
    ) -> Result<Failures, BatchError> {
        let columns = self.check(count, values, out, self.measures.len())?;
        let width = self.measures.len();
        if count == 0 {
            return Ok(Vec::new());
        }
        // Work is handed out in groups of samples, each with its rows of the table.
        let mut rows: Vec<&mut [f64]> = room(count.div_ceil(SAMPLES))?;
        match width {
            0 => rows.resize_with(count.div_ceil(SAMPLES), Default::default),
            _ => rows.extend(out.chunks_mut(SAMPLES * width)),
        }
        let queue = Mutex::new(rows.into_iter().enumerate());
        let work = || {
            let mut worker = Worker::new(self);
            loop {
                // A poisoned queue is still valid: a thread cannot leave it half taken.
                let next = queue.lock().unwrap_or_else(std::sync::PoisonError::into_inner).next();
                let Some((group, rows)) = next.filter(|_| !self.watch.stops()) else {
                    return worker.failures;
                };
                let samples = group * SAMPLES..usize::min((group + 1) * SAMPLES, count);
                worker.run(
                    self,
                    samples.start,
                    &values[samples.start * columns..samples.end * columns],
                    columns,
                    samples.len(),
                    rows,
                );
            }
        };
        let threads = threads.clamp(1, count.div_ceil(SAMPLES));
        let mut failures = on_threads(threads, self.watch, work).concat();
        failures.sort_unstable_by_key(|(sample, _)| *sample);
        self.completed(failures)
    }

    /// Runs `count` samples and writes the loads of all groups to `out` (count, time, groups, 6): force in N and moment in N m about the
    /// group's centre. Rows and failures as in [`Batch::run`].
    ///
    /// # Errors
    /// As [`Batch::run`].
    pub fn histories(&self, count: usize, values: &[f64], out: &mut [f64]) -> Result<Failures, BatchError> {
        let width = self.motion.excitation.count() * self.base.groups.len() * 6;
        let columns = self.check(count, values, out, width)?;
        let (mut sample, mut failures) = (self.first.clone(), Vec::new());
        let mut drawn = Drawn::default();
        for index in 0..count {
            let (values, out) = (
                &values[index * columns..(index + 1) * columns],
                &mut out[index * width..(index + 1) * width],
            );
            let done = self.plan.apply(&self.base, values, &mut sample).and_then(|()| {
                drawn.draw(self, values, columns);
                let runs = self.runs(drawn.motion(self, 0));
                single::history(&runs, self.base.groups, &sample, out)
            });
            if let Err(error) = done {
                out.fill(f64::NAN);
                failures.push((index, error));
            }
            if self.watch.stops() {
                break;
            }
        }
        self.completed(failures)
    }

    /// The failures of samples, unless all samples together failed.
    fn completed(&self, failures: Failures) -> Result<Failures, BatchError> {
        self.watch.check()?;
        for (_, failure) in &failures {
            if let SampleError::Run(RunError::Memory { bytes }) = *failure {
                return Err(Stopped::Memory { bytes }.into());
            }
        }
        Ok(failures)
    }

    /// Checks the sizes of the tables; returns the number of columns of `values`.
    fn check(&self, count: usize, values: &[f64], out: &[f64], width: usize) -> Result<usize, BatchError> {
        let columns = values.len().checked_div(count).unwrap_or(self.columns());
        if columns < self.columns() {
            return Err(BatchError::Columns { expected: self.columns(), got: columns });
        }
        if values.len() != count * columns {
            return Err(BatchError::Length { field: "values", expected: count * columns, got: values.len() });
        }
        let expected = count.saturating_mul(width);
        if out.len() != expected {
            return Err(BatchError::Length { field: "out", expected, got: out.len() });
        }
        Ok(columns)
    }

    /// The requirements, with the weights of the samples of the first window.
    fn requirements(&self) -> &Requirements {
        &self.windows[0].requirements
    }

    /// `drawn`: accelerations of a drawn motion.
    fn runs<'b>(&'b self, drawn: Option<&'b [[f64; 3]]>) -> RunSettings<'b> {
        RunSettings {
            start: self.start,
            excitation: &self.motion.excitation,
            drawn,
            windows: &self.windows,
            typical_interval: self.typical_interval,
            solver: self.solver,
            rtol: self.rtol,
            watch: self.watch,
        }
    }
}

/// Samples without a result, by index.
type Failures = Vec<(usize, SampleError)>;
