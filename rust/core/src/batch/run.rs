//! Runs of a batch, on any number of threads.

use std::sync::Mutex;

use super::description::Batch;
use super::drawn::Drawn;
use super::error::BatchError;
use super::single;
use super::worker::{Failures, Worker};
use crate::error::{RunError, Stopped};
use crate::numeric::watch::{on_threads, room};
use crate::variation::SampleError;

/// Number of samples that a thread runs at a time.
pub const SAMPLES: usize = 64;

impl Batch<'_> {
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
}
