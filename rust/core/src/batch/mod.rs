//! Monte Carlo: many samples of one scene under one motion; values in, measures out, on any number of threads.
//!
//! Files in the order of the data: `variation` (the scene of a sample) → `motion_draws` (its motion, if drawn) → `windows` (of the motion,
//! between changes of payload) → `lanes` (linear scenes, one per vector lane), `preloaded` (preloaded scenes side by side) or `single` (any
//! other scene), the last two with `load_rows` and `reduce` →
//! `requirements`, `statistics` (what the measures need) → `measure`. The result of a sample depends on its own values only, to the last bit.

mod drawn;
mod equivalent;
mod error;
mod lanes;
mod load_rows;
mod measure;
mod motion_draws;
mod power_integral;
mod preloaded;
mod reduce;
mod requirements;
mod single;
mod solver;
mod time_statistics;
mod travel;
mod windows;

pub use crate::variation::{Base, Change, Group, Instance, NominalBody, Payload, Plan, SampleError, Target};
pub use error::BatchError;
pub use lanes::Width;
pub use measure::{Measure, Quantity, Statistic, time_weights};
pub use motion_draws::MotionDraws;
pub use solver::Solver;
pub use travel::Motion;

use std::ops::Range;
use std::sync::Mutex;

use crate::error::{RunError, Stopped};
use crate::integrate::{Control, MAX_SCENES, Start, scenes_side_by_side};
use crate::model::Dof;
use crate::numeric::simd::LANES;
use crate::numeric::watch::{Watch, on_threads, room};
use drawn::Drawn;
use lanes::{LaneMemory, Lanes};
use preloaded::{Beside, measure_side_by_side};
use reduce::Memory;
use requirements::Requirements;
use single::RunSettings;
use time_statistics::RunningStatistics;
use windows::Window;

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
        let excitation = &motion.excitation;
        requirements::check(&base, measures)?;
        motion.check()?;
        Control::Adaptive { rtol }.check(solver != Solver::Exact)?;
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
                drawn.draw(self.draws, values, columns, self.watch);
                let runs = self.runs(drawn.motion(&self.motion.excitation, 0));
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

/// Memory of one thread.
struct Worker {
    /// Scenes that run side by side, one per lane, so that they stay in the cache.
    samples: Vec<Instance>,
    /// One for each scene that runs beside others.
    memories: [Memory; MAX_SCENES],
    lanes: LaneMemory,
    statistics: Vec<RunningStatistics>,
    drawn: Drawn,
    failures: Failures,
}

impl Worker {
    fn new(batch: &Batch) -> Self {
        Self {
            samples: vec![batch.first.clone(); batch.lanes.count()],
            memories: core::array::from_fn(|_| Memory::new()),
            lanes: LaneMemory::default(),
            statistics: Vec::new(),
            drawn: Drawn::default(),
            failures: Vec::new(),
        }
    }

    /// Runs a group of samples, the first of which has the index `first`.
    fn run(
        &mut self,
        batch: &Batch,
        first: usize,
        values: &[f64],
        columns: usize,
        count: usize,
        rows: &mut [f64],
    ) {
        let (width, together) = (batch.measures.len(), self.samples.len());
        for start in (0..count).step_by(together) {
            if batch.watch.stops() {
                return;
            }
            if start.is_multiple_of(LANES) {
                let end = usize::min(start + LANES, count);
                let values = &values[start * columns..end * columns];
                self.drawn.draw(batch.draws, values, columns, batch.watch);
            }
            let samples = start..usize::min(start + together, count);
            let values = &values[samples.start * columns..samples.end * columns];
            let rows = &mut rows[samples.start * width..samples.end * width];
            self.run_together(batch, first, samples, values, columns, rows);
        }
    }

    /// Runs some samples of the group side by side, at most one per lane, with the values and rows of these alone.
    fn run_together(
        &mut self,
        batch: &Batch,
        first: usize,
        samples: Range<usize>,
        values: &[f64],
        columns: usize,
        rows: &mut [f64],
    ) {
        // `first`: index of the first of these; `place`: where it is among the drawn motions.
        let (first, place, width) = (first + samples.start, samples.start % LANES, batch.measures.len());
        let mut valid = Vec::with_capacity(samples.len());
        for (index, sample) in self.samples[..samples.len()].iter_mut().enumerate() {
            let values = &values[index * columns..(index + 1) * columns];
            match batch.plan.apply(&batch.base, values, sample) {
                Ok(()) => valid.push(index),
                Err(error) => {
                    rows[index * width..(index + 1) * width].fill(f64::NAN);
                    self.failures.push((first + index, error));
                }
            }
        }
        // Linear scenes run side by side. Those for which the lanes are not accurate enough are left to the others.
        let lost = vec![false; batch.requirements().contacts.len()];
        let in_lanes =
            matches!(batch.solver, Solver::Auto | Solver::Exact) && batch.lanes.can_start(batch.start);
        if in_lanes {
            let (linear, mut rest): (Vec<usize>, Vec<usize>) =
                valid.into_iter().partition(|&index| self.samples[index].is_linear());
            if !linear.is_empty() {
                let scenes: Vec<&Instance> = linear.iter().map(|&index| &self.samples[index]).collect();
                let places: Vec<usize> = linear.iter().map(|&index| place + index).collect();
                let deviations = self.drawn.deviations(&places, self.samples.len());
                batch.lanes.run(&batch.windows, &scenes, deviations, &mut self.lanes, batch.watch);
            }
            for (lane, &index) in linear.iter().enumerate() {
                if batch.lanes.statistics(batch.requirements(), &self.lanes, lane, &mut self.statistics) {
                    let out = &mut rows[index * width..(index + 1) * width];
                    let excitation = &batch.motion.excitation;
                    let done = batch.requirements().write_measures(excitation, &self.statistics, &lost, out);
                    self.note(first + index, done.map_err(SampleError::from), out);
                } else {
                    rest.push(index);
                }
            }
            valid = rest;
        }
        let side_by_side = matches!(batch.solver, Solver::Auto | Solver::Exponential);
        let (preloaded, rest): (Vec<usize>, Vec<usize>) =
            valid.into_iter().partition(|&index| side_by_side && self.samples[index].is_preloaded());
        for some in preloaded.chunks(scenes_side_by_side()) {
            let places: Vec<usize> = some.iter().map(|index| place + index).collect();
            self.drawn.set_motions(&batch.motion.excitation, &places);
            let samples = some.iter().zip(&mut self.memories).enumerate().map(|(lane, (&index, memory))| {
                Beside { runs: batch.runs(self.drawn.motion_in(lane)), sample: &self.samples[index], memory }
            });
            let mut table = vec![0.0; some.len() * width];
            let done = measure_side_by_side(&mut samples.collect::<Vec<_>>(), batch.base.groups, &mut table);
            for (lane, (&index, done)) in some.iter().zip(done).enumerate() {
                let out = &mut rows[index * width..(index + 1) * width];
                out.copy_from_slice(&table[lane * width..(lane + 1) * width]);
                self.note(first + index, done, out);
            }
        }
        for index in rest {
            let out = &mut rows[index * width..(index + 1) * width];
            let sample = &self.samples[index];
            let runs = batch.runs(self.drawn.motion(&batch.motion.excitation, place + index));
            let done = single::measure(&runs, batch.base.groups, sample, &mut self.memories[0], out);
            self.note(first + index, done, out);
        }
    }

    /// Notes a sample without result.
    fn note(&mut self, index: usize, done: Result<(), SampleError>, out: &mut [f64]) {
        if let Err(error) = done {
            out.fill(f64::NAN);
            self.failures.push((index, error));
        }
    }
}
