//! Batches of samples of one scene.

use std::sync::Arc;

use guideload::batch::{Batch, Change, Measure, Motion, MotionDraws, Width};
use guideload::{BatchError, NamedMethod, SampleError, Start, Watch};
use numpy::{PyArray4, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::bands::PyMotionDraws;
use crate::convert::{self, Array2, List, Samples, filled, numbers};
use crate::error::CoreError;
use crate::interrupt::try_compute;
use crate::life::{Rule, equivalent_load};
use crate::scene::named_method;
use crate::variation::{OwnedBase, PyVariedScene};

/// A batch, with the data that it borrows.
#[pyclass(name = "Batch", module = "guideload._core", frozen)]
pub struct PyBatch {
    base: OwnedBase,
    samples: Samples,
    speed: Option<Vec<f64>>,
    exponent: f64,
    changes: Vec<Change>,
    measures: Vec<Measure>,
    /// None: auto.
    method: Option<NamedMethod>,
    rtol: f64,
    start: Start,
    /// Whether extremes are those at the samples, or those at any time.
    at_samples: bool,
    /// Draws of the motion, and the column of values with their numbers.
    draws: Option<(Arc<MotionDraws>, usize)>,
}

/// Largest index of a column of values.
const MOST_COLUMNS: usize = 1 << 32;

/// Samples without a result, and the reasons.
type Failures = Vec<(usize, String)>;

#[pymethods]
impl PyBatch {
    #[new]
    #[pyo3(signature = (scene, *, time, acceleration, wrench, speed, exponent, measures, method, rtol, rules=None, start="rest", draws=None, at_samples=false))]
    #[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
    fn new(
        py: Python<'_>,
        scene: &PyVariedScene,
        time: PyReadonlyArray1<'_, f64>,
        acceleration: PyReadonlyArray2<'_, f64>,
        wrench: Option<PyReadonlyArray2<'_, f64>>,
        speed: Option<PyReadonlyArray1<'_, f64>>,
        exponent: f64,
        measures: List<(String, usize, String)>,
        method: &str,
        rtol: f64,
        rules: Option<List<(Rule<'_>, Rule<'_>)>>,
        start: &str,
        draws: Option<(PyRef<'_, PyMotionDraws>, usize)>,
        at_samples: bool,
    ) -> PyResult<Self> {
        let mut base = scene.base.clone();
        let rules = rules.map_or_else(Vec::new, |rules| rules.0);
        if ![0, base.groups.len()].contains(&rules.len()) {
            let (expected, got) = (base.groups.len(), rules.len());
            return Err(PyValueError::new_err(format!("rules: expected {expected}, got {got}")));
        }
        for (group, (mean, peak)) in base.groups.iter_mut().zip(&rules) {
            (group.mean_rule, group.peak_rule) = (equivalent_load(mean)?, equivalent_load(peak)?);
        }
        let batch = Self {
            base,
            samples: Samples::new(&time, &acceleration, wrench.as_ref())?,
            speed: speed.map(|speed| numbers(&speed, "speed")).transpose()?,
            exponent,
            changes: scene.changes.clone(),
            measures: measures.0.iter().map(measure).collect::<PyResult<_>>()?,
            method: if method == "auto" { None } else { Some(named_method(method)?) },
            rtol,
            start: convert::start(start)?,
            at_samples,
            draws: draws.map(|(draws, column)| (Arc::clone(&draws.0), column)),
        };
        let of_motion = batch.samples.time.len();
        if let Some((draws, column)) = &batch.draws
            && (draws.count() != of_motion || *column > MOST_COLUMNS)
        {
            let got = draws.count();
            return Err(PyValueError::new_err(format!(
                "draws: expected those of {of_motion} samples in a column up to {MOST_COLUMNS}, got {got}, column {column}"
            )));
        }
        try_compute(py, |watch| batch.with_batch(watch, |_| Ok(())))?;
        Ok(batch)
    }

    /// Measures of samples (n, measures), and the samples without a result.
    #[pyo3(signature = (values, threads, width="widest"))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray2<'_, f64>,
        threads: usize,
        width: &str,
    ) -> PyResult<(Array2<'py>, Failures)> {
        let (count, values) = table(&values)?;
        let width = Width::from_name(width).ok_or_else(|| {
            PyValueError::new_err(format!("width: expected widest, four or one, got {width:?}"))
        })?;
        let mut failures = Vec::new();
        let out = filled(py, &[count, self.measures.len()], |rows| {
            failures = try_compute(py, |watch| {
                self.with_batch(watch, |batch| batch.with_width(width).run(count, &values, threads, rows))
            })?;
            Ok(())
        })?;
        Ok((out, messages(failures)))
    }

    /// Loads of the groups of samples (n, time, groups, 6), and the samples without a result.
    fn histories<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<(Bound<'py, PyArray4<f64>>, Failures)> {
        let (count, values) = table(&values)?;
        let mut failures = Vec::new();
        let shape = [count, self.samples.acceleration.len(), self.base.groups.len(), 6];
        let out = filled(py, &shape, |rows| {
            let histories = |batch: Batch| batch.histories(count, &values, rows);
            failures = try_compute(py, |watch| self.with_batch(watch, histories))?;
            Ok(())
        })?;
        Ok((out, messages(failures)))
    }
}

impl PyBatch {
    /// Calls `then` with the batch.
    fn with_batch<T>(
        &self,
        watch: Watch,
        then: impl FnOnce(Batch) -> Result<T, BatchError>,
    ) -> Result<T, CoreError> {
        let motion = Motion {
            excitation: self.samples.excitation()?,
            speed: self.speed.as_deref(),
            exponent: self.exponent,
        };
        let batch =
            Batch::new(self.base.base(), motion, &self.changes, &self.measures, self.method, self.rtol)?;
        let batch = batch.with_start(self.start).with_watch(watch);
        let batch = if self.at_samples { batch.at_samples() } else { batch };
        Ok(then(match &self.draws {
            Some((draws, column)) => batch.with_motion_draws(draws, *column),
            None => batch,
        })?)
    }
}

fn messages(failures: Vec<(usize, SampleError)>) -> Failures {
    failures.into_iter().map(|(sample, error)| (sample, error.to_string())).collect()
}

/// The number of rows, and all of them.
fn table(values: &PyReadonlyArray2<'_, f64>) -> PyResult<(usize, Vec<f64>)> {
    Ok((values.shape()[0], numbers(values, "values")?))
}

fn measure((quantity, index, statistic): &(String, usize, String)) -> PyResult<Measure> {
    Measure::from_names(quantity, *index, statistic).ok_or_else(|| {
        PyValueError::new_err(format!("measures: there is no ({quantity:?}, {index}, {statistic:?})"))
    })
}
