//! One thread of a batch: which samples run side by side, and which by themselves.

use std::ops::Range;

use super::description::Batch;
use super::drawn::Drawn;
use super::lanes::LaneMemory;
use super::preloaded::{Beside, measure_side_by_side};
use super::reduce::Memory;
use super::single;
use super::time_statistics::RunningStatistics;
use crate::integrate::{NamedMethod, scenes_side_by_side};
use crate::numeric::simd::{LANES, MAX_LANES};
use crate::variation::{Instance, SampleError};

/// Samples without a result, by index.
pub(super) type Failures = Vec<(usize, SampleError)>;

/// Memory of one thread.
pub(super) struct Worker {
    /// Scenes that run side by side, one per lane, so that they stay in the cache.
    samples: Vec<Instance>,
    /// One for each scene that runs beside others.
    memories: [Memory; MAX_LANES],
    lanes: LaneMemory,
    statistics: Vec<RunningStatistics>,
    drawn: Drawn,
    pub failures: Failures,
}

impl Worker {
    pub(super) fn new(batch: &Batch) -> Self {
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
            matches!(batch.method, None | Some(NamedMethod::Exact)) && batch.lanes.can_start(batch.start);
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
                let (requirements, excitation) = (batch.requirements(), &batch.motion.excitation);
                if batch.lanes.statistics(requirements, excitation, &self.lanes, lane, &mut self.statistics) {
                    let out = &mut rows[index * width..(index + 1) * width];
                    let done = requirements.write_measures(&self.statistics, &lost, out);
                    self.note(first + index, done.map_err(SampleError::from), out);
                } else {
                    rest.push(index);
                }
            }
            valid = rest;
        }
        let side_by_side = matches!(batch.method, None | Some(NamedMethod::Exponential));
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
