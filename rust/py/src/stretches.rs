//! Runs of a machine whose mass changes: its scenes one after the other, each over a part of the samples.

use std::sync::Arc;

use guideload::{
    Input, NamedMethod, Output, Part, Peaks, Record, RunError, Start, State, Summary, System, Watch, Watched,
};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{self, Array2, List, Samples, numbers, room};
use crate::error::CoreError;
use crate::extremes::{Rules, Sought};
use crate::interrupt::try_compute;
use crate::links::group_loads;
use crate::riders::Travels;
use crate::scene::{PyScene, named_method};
use crate::solution::{Inputs, PySolution};

/// Checked arguments of a run.
struct Stretches {
    systems: Vec<Arc<System>>,
    /// With the masses that are on the machine before and after each change.
    kept: Vec<Arc<System>>,
    /// Index of the first sample of each stretch, and the number of samples.
    bounds: Vec<usize>,
    samples: Samples,
    method: NamedMethod,
    control: guideload::Control,
    start: Start,
}

impl Stretches {
    fn new(
        [scenes, kept]: [&List<PyRef<'_, PyScene>>; 2],
        first: &List<usize>,
        samples: Samples,
        (method, start): (&str, &str),
        control: guideload::Control,
    ) -> PyResult<Self> {
        let systems =
            |scenes: &List<PyRef<'_, PyScene>>| scenes.0.iter().map(|scene| Arc::clone(&scene.0)).collect();
        let (systems, kept): (Vec<Arc<System>>, Vec<Arc<System>>) = (systems(scenes), systems(kept));
        let mut bounds = first.0.clone();
        bounds.push(samples.acceleration.len());
        let fits = bounds.len() == systems.len() + 1 && kept.len() + 1 == systems.len();
        let like = |system: &Arc<System>| system.links().len() == systems[0].links().len();
        if !fits
            || bounds[0] != 0
            || !bounds.is_sorted_by(|a, b| a < b)
            || !systems.iter().chain(&kept).all(like)
        {
            return Err(PyValueError::new_err(
                "scenes, kept, first: expected stretches of one machine, ascending",
            ));
        }
        let (method, start) = (named_method(method)?, convert::start(start)?);
        Ok(Self { systems, kept, bounds, samples, method, control, start })
    }

    /// Runs all stretches; `of`: the instants and the record of a stretch, which it gets back.
    fn run<'a, R: Record>(
        &'a self,
        watch: Watch<'a>,
        mut output: impl FnMut(usize) -> Output<'a>,
        mut record: impl FnMut(usize) -> R,
        mut done: impl FnMut(R),
    ) -> Result<Summary, CoreError> {
        let mut start = self.start;
        let mut whole: Option<Summary> = None;
        for (index, system) in self.systems.iter().enumerate() {
            let part = self.bounds[index]..self.bounds[index + 1];
            let excitation = self.samples.excitation_of(part)?;
            let mut watched = Watched { record: record(index), watch };
            let summary =
                self.method.run(system, self.control, start, &excitation, output(index), &mut watched)?;
            done(watched.record);
            if let (Some(kept), Some(to)) = (self.kept.get(index), self.systems.get(index + 1)) {
                start = Start::after_change(system, &summary.end, kept, to);
            }
            whole = Some(whole.map_or(summary, |before| Summary {
                steps: before.steps + summary.steps,
                rejected: before.rejected + summary.rejected,
                recorded: before.recorded + summary.recorded,
                contact_changes: before.contact_changes + summary.contact_changes,
                load_scale: f64::max(before.load_scale, summary.load_scale),
                end: summary.end,
            }));
        }
        whole.ok_or(CoreError::Run(RunError::OutOfRange))
    }
}

/// As `Scene.solve`, of scenes one after the other.
#[pyfunction]
#[pyo3(signature = (scenes, kept, first, time, acceleration, wrench=None, *, method, rtol, step=None, times=None, start="rest"))]
#[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
pub fn solve_stretches(
    py: Python<'_>,
    scenes: List<PyRef<'_, PyScene>>,
    kept: List<PyRef<'_, PyScene>>,
    first: List<usize>,
    time: PyReadonlyArray1<'_, f64>,
    acceleration: PyReadonlyArray2<'_, f64>,
    wrench: Option<PyReadonlyArray2<'_, f64>>,
    method: &str,
    rtol: f64,
    step: Option<f64>,
    times: Option<PyReadonlyArray1<'_, f64>>,
    start: &str,
) -> PyResult<PySolution> {
    let samples = Samples::new(&time, &acceleration, wrench.as_ref())?;
    let control = convert::control(rtol, step);
    let run = Stretches::new([&scenes, &kept], &first, samples, (method, start), control)?;
    let times = times.as_ref().map(|times| numbers(times, "times")).transpose()?;
    // Instants at a change are those after it.
    let place = |index: usize| match (&times, run.bounds.get(index)) {
        (Some(times), Some(&sample)) if index > 0 && index < run.systems.len() => {
            times.partition_point(|time| *time < run.samples.time[sample])
        }
        (Some(times), _) if index > 0 => times.len(),
        (None, Some(&sample)) => sample,
        _ => 0,
    };
    let firsts: Vec<usize> = (0..=run.systems.len()).map(place).collect();
    let mut states: Vec<State> = room(firsts[run.systems.len()])?;
    let mut inputs: Vec<Input> = room(times.as_ref().map_or(0, Vec::len))?;
    let summary = try_compute(py, |watch| {
        let output = |index: usize| match &times {
            Some(times) => Output::Times(&times[firsts[index]..firsts[index + 1]]),
            None => Output::Samples,
        };
        let summary = run.run(watch, output, |_| Vec::<State>::new(), |mut part| states.append(&mut part))?;
        for (index, times) in times.iter().flat_map(|times| (0..run.systems.len()).map(move |i| (i, times))) {
            let excitation = run.samples.excitation_of(run.bounds[index]..run.bounds[index + 1])?;
            let times = &times[firsts[index]..firsts[index + 1]];
            inputs.extend(times.iter().map(|&time| excitation.input_at(time)));
        }
        Ok(summary)
    })?;
    let stretches = run.systems.into_iter().zip(firsts).collect();
    let Samples { acceleration, wrench, .. } = run.samples;
    let inputs = if times.is_some() { Inputs::At(inputs) } else { Inputs::Samples { acceleration, wrench } };
    Ok(PySolution { stretches, states, inputs, travels: Travels::NONE, summary })
}

/// As `Scene.peaks`, of scenes one after the other.
#[pyfunction]
#[pyo3(signature = (scenes, kept, first, time, acceleration, wrench=None, *, method, rtol, step=None, groups, centers, start="rest", less=None, rules=None))]
#[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
pub fn peaks_of_stretches<'py>(
    py: Python<'py>,
    scenes: List<PyRef<'_, PyScene>>,
    kept: List<PyRef<'_, PyScene>>,
    first: List<usize>,
    time: PyReadonlyArray1<'_, f64>,
    acceleration: PyReadonlyArray2<'_, f64>,
    wrench: Option<PyReadonlyArray2<'_, f64>>,
    method: &str,
    rtol: f64,
    step: Option<f64>,
    groups: List<PyReadonlyArray1<'_, i64>>,
    centers: PyReadonlyArray2<'_, f64>,
    start: &str,
    less: Option<PyReadonlyArray2<'_, f64>>,
    rules: Option<Rules<'_>>,
) -> PyResult<[Array2<'py>; 5]> {
    let samples = Samples::new(&time, &acceleration, wrench.as_ref())?;
    let control = convert::control(rtol, step);
    let run = Stretches::new([&scenes, &kept], &first, samples, (method, start), control)?;
    let sought = Sought::new(groups.0.len(), less.as_ref(), rules)?;
    let of = |system| Ok(sought.loads(group_loads(system, &groups.0, &centers, Part::Total)?));
    let loads = run.systems.iter().map(|system| of(system)).collect::<PyResult<Vec<_>>>()?;
    let mut parts = vec![sought.begin(); loads.len()];
    try_compute(py, |watch| {
        let part = |index: usize| run.bounds[index]..run.bounds[index + 1];
        let excitations = (0..loads.len())
            .map(|index| run.samples.excitation_of(part(index)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut rooms = parts.iter_mut();
        let record = |index: usize| {
            let room = rooms.next().map_or(&mut [][..], |room| room);
            Peaks::new(&run.systems[index], &excitations[index], &loads[index], room)
        };
        run.run(watch, |_| Output::Samples, record, |_| ()).map(|_| ())
    })?;
    let mut whole = sought.begin();
    for part in &parts {
        for (all, of_part) in whole.iter_mut().zip(part) {
            *all = all.with(of_part);
        }
    }
    sought.arrays(py, &whole)
}
