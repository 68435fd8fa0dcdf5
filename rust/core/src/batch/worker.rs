//! A thread of a batch: runs groups of samples, linear scenes side by side and all others one by one.

use super::drawn::Drawn;
use super::lanes::LaneMemory;
use super::reduce::Memory;
use super::time_statistics::RunningStatistics;
use super::{Batch, Failures, Solver, single};
use crate::numeric::simd::LANES;
use crate::variation::Instance;

/// Memory of one thread.
pub(super) struct Worker {
    /// Scenes that run side by side, one per lane, so that they stay in the cache.
    samples: Vec<Instance>,
    memory: Memory,
    lanes: LaneMemory,
    statistics: Vec<RunningStatistics>,
    drawn: Drawn,
    pub failures: Failures,
}

impl Worker {
    pub(super) fn new(batch: &Batch) -> Self {
        Self {
            samples: vec![batch.first.clone(); batch.lanes.count()],
            memory: Memory::new(),
            lanes: LaneMemory::default(),
            statistics: Vec::new(),
            drawn: Drawn::default(),
            failures: Vec::new(),
        }
    }

    /// Runs a group of samples, the first of which has the index `first`.
    pub(super) fn run(
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
                self.drawn.draw(batch, &values[start * columns..end * columns], columns);
            }
            let end = usize::min(start + together, count);
            let values = &values[start * columns..end * columns];
            self.run_together(
                batch,
                first + start,
                start % LANES,
                values,
                columns,
                end - start,
                &mut rows[start * width..end * width],
            );
        }
    }

    /// Runs samples side by side, at most one per lane. `place`: of the first of them among the drawn motions.
    #[allow(clippy::too_many_arguments)]
    fn run_together(
        &mut self,
        batch: &Batch,
        first: usize,
        place: usize,
        values: &[f64],
        columns: usize,
        count: usize,
        rows: &mut [f64],
    ) {
        let width = batch.measures.len();
        let mut valid = Vec::with_capacity(count);
        for (index, sample) in self.samples[..count].iter_mut().enumerate() {
            let values = &values[index * columns..(index + 1) * columns];
            match batch.plan.apply(&batch.base, values, sample) {
                Ok(()) => valid.push(index),
                Err(error) => {
                    rows[index * width..(index + 1) * width].fill(f64::NAN);
                    self.failures.push((first + index, error));
                }
            }
        }
        // Linear scenes run side by side. Those for which the lanes are not accurate enough, and all others, run one by one.
        let lost = vec![false; batch.requirements().contacts.len()];
        let in_lanes =
            matches!(batch.solver, Solver::Auto | Solver::Exact) && batch.lanes.can_start(batch.start);
        if in_lanes {
            let (linear, mut rest): (Vec<usize>, Vec<usize>) =
                valid.into_iter().partition(|&index| self.samples[index].is_linear());
            if !linear.is_empty() {
                let scenes: Vec<&Instance> = linear.iter().map(|&index| &self.samples[index]).collect();
                let places: Vec<usize> = linear.iter().map(|&index| place + index).collect();
                let deviations = self.drawn.deviations(batch, &places);
                batch.lanes.run(&batch.windows, &scenes, deviations, &mut self.lanes, batch.watch);
            }
            for (lane, &index) in linear.iter().enumerate() {
                if batch.lanes.statistics(batch.requirements(), &self.lanes, lane, &mut self.statistics) {
                    let out = &mut rows[index * width..(index + 1) * width];
                    let excitation = &batch.motion.excitation;
                    let done = batch.requirements().write_measures(excitation, &self.statistics, &lost, out);
                    if let Err(error) = done {
                        out.fill(f64::NAN);
                        self.failures.push((first + index, error.into()));
                    }
                } else {
                    rest.push(index);
                }
            }
            valid = rest;
        }
        for index in valid {
            let out = &mut rows[index * width..(index + 1) * width];
            let sample = &self.samples[index];
            let runs = batch.runs(self.drawn.motion(batch, place + index));
            let done = single::measure(&runs, batch.base.groups, sample, &mut self.memory, out);
            if let Err(error) = done {
                out.fill(f64::NAN);
                self.failures.push((first + index, error));
            }
        }
    }
}
