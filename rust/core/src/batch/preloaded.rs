//! Runs of some samples with preloaded links side by side.

use super::reduce::{Memory, Reduce};
use super::single::{RunSettings, measure};
use super::windows::Window;
use crate::error::RunError;
use crate::excitation::ScaledExcitation;
use crate::integrate::{NamedMethod, SceneRun, Start, run_side_by_side};
use crate::output::{Record, Watched, Wrench};
use crate::system::{State, System};
use crate::variation::{Group, Instance, SampleError};

/// A sample that runs beside others.
pub(super) struct Beside<'a> {
    /// With its drawn motion, if it has one.
    pub runs: RunSettings<'a>,
    pub sample: &'a Instance,
    pub memory: &'a mut Memory,
}

/// Runs up to [`crate::integrate::scenes_side_by_side`] samples and writes their measures to `out` (samples, measures), as [`measure`] does:
/// side by side those for which the exponential method is the right one.
pub(super) fn measure_side_by_side(
    samples: &mut [Beside],
    groups: &[Group],
    out: &mut [f64],
) -> Vec<Result<(), SampleError>> {
    let width = out.len() / usize::max(samples.len(), 1);
    let Some(RunSettings { windows, .. }) = samples.first().map(|one| one.runs) else { return Vec::new() };
    let mut done: Vec<Result<(), SampleError>> = samples.iter().map(|_| Ok(())).collect();
    let mut last: Vec<Option<(System, State)>> = samples.iter().map(|_| None).collect();
    for one in &mut *samples {
        one.memory.begin(&windows[0].requirements, one.sample, groups);
    }
    let mut by_itself = vec![false; samples.len()];
    for window in windows {
        let mut begun = Vec::with_capacity(samples.len());
        for (index, (one, last)) in samples.iter().zip(&mut last).enumerate() {
            if done[index].is_err() || by_itself[index] {
                continue;
            }
            match one.runs.begin(window, one.sample, last.take()) {
                Ok((system, _)) if one.runs.method_for(&system) != NamedMethod::Exponential => {
                    by_itself[index] = true;
                }
                Ok(begin) => begun.push((index, begin)),
                Err(error) => done[index] = Err(error),
            }
        }
        let ends = run_window(window, samples, groups, &begun);
        for ((index, (system, _)), end) in begun.into_iter().zip(ends) {
            match end {
                Ok(end) => last[index] = Some((system, end)),
                Err(error) => done[index] = Err(error.into()),
            }
        }
    }
    for (index, (one, done)) in samples.iter_mut().zip(&mut done).enumerate() {
        let out = &mut out[index * width..(index + 1) * width];
        if by_itself[index] {
            *done = measure(&one.runs, groups, one.sample, one.memory, out);
        } else if done.is_ok() {
            let written = one.memory.write(&windows[0].requirements, out);
            *done = written.map_err(SampleError::from);
        }
    }
    done
}

/// Runs the samples that have `begun`, each with its index, through a window; their final states.
fn run_window(
    window: &Window,
    samples: &mut [Beside],
    groups: &[Group],
    begun: &[(usize, (System, Start))],
) -> Vec<Result<State, RunError>> {
    let settings: Vec<RunSettings> = begun.iter().map(|(index, _)| samples[*index].runs).collect();
    let Some(RunSettings { rtol, typical_interval, .. }) = settings.first().copied() else {
        return Vec::new();
    };
    let excitations: Vec<_> = settings.iter().map(|one| one.excitation(window)).collect();
    let mut loads: Vec<Vec<Wrench>> = Vec::with_capacity(begun.len());
    for (index, (system, _)) in begun {
        loads.push(window.requirements.extremes.of(system, samples[*index].sample, groups));
    }
    let mut records = Vec::with_capacity(begun.len());
    for (index, one) in samples.iter_mut().enumerate() {
        let Some(place) = begun.iter().position(|(other, _)| *other == index) else { continue };
        let (of_system, sample) = ((&begun[place].1.0, &loads[place][..]), one.sample);
        let (excitation, peak) = &excitations[place];
        let scaled = ScaledExcitation { excitation, peak: *peak, factors: sample.factors() };
        let record = Reduce::new(window, &scaled, of_system, (sample, groups), one.memory);
        records.push((Watched { record, watch: one.runs.watch }, scaled));
    }
    let runs = begun.iter().zip(&mut records);
    let runs = runs.map(|((_, (system, start)), (record, scaled))| SceneRun {
        system,
        start: *start,
        scaled: *scaled,
        record,
    });
    let ends = run_side_by_side(runs.collect(), rtol, typical_interval);
    for (record, _) in &mut records {
        record.end();
    }
    ends
}
