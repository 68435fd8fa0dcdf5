//! The smoother's kernels over arrays.

use guideload::smoother::{self, Adapted, Intensity, Rounded, Rule, Samples, Sites, Smoothed, Start};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, Array2, slice};

/// The arrays of a call, all of one motion of `order`.
struct Given<'a> {
    order: usize,
    samples: Samples<'a>,
    start: Start<'a>,
    cell: &'a [u32],
}

impl<'a> Given<'a> {
    fn new(
        samples: [&'a PyReadonlyArray1<'_, f64>; 3],
        mean: &'a PyReadonlyArray1<'_, f64>,
        covariance: &'a PyReadonlyArray2<'_, f64>,
        cell: &'a PyReadonlyArray1<'_, u32>,
        cells: usize,
    ) -> PyResult<Self> {
        let [step, value, variance] = samples;
        let samples = Samples {
            step: slice(step, "step")?,
            value: slice(value, "value")?,
            variance: slice(variance, "variance")?,
        };
        let start = Start {
            mean: slice(mean, "mean")?,
            covariance: covariance
                .as_slice()
                .map_err(|_| PyValueError::new_err("covariance: not contiguous"))?,
        };
        let (cell, count, order) = (slice(cell, "cell")?, samples.value.len(), start.mean.len());
        let fits =
            samples.step.len() + 1 == count && samples.variance.len() == count && cell.len() + 1 == count;
        if !fits || start.covariance.len() != order * order || cell.iter().any(|&c| c as usize >= cells) {
            return Err(PyValueError::new_err(
                "step, value, variance, cell, mean, covariance: lengths do not agree",
            ));
        }
        if !(2..=6).contains(&order) {
            return Err(PyValueError::new_err(format!("mean: expected 2 to 6 numbers, got {order}")));
        }
        Ok(Self { order, samples, start, cell })
    }
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // the arrays of a call, named in the stub
pub fn motion_likelihood(
    py: Python<'_>,
    step: PyReadonlyArray1<'_, f64>,
    value: PyReadonlyArray1<'_, f64>,
    variance: PyReadonlyArray1<'_, f64>,
    mean: PyReadonlyArray1<'_, f64>,
    covariance: PyReadonlyArray2<'_, f64>,
    cell: PyReadonlyArray1<'_, u32>,
    intensity: PyReadonlyArray1<'_, f64>,
) -> PyResult<Option<(f64, f64)>> {
    let of = slice(&intensity, "intensity")?;
    let given = Given::new([&step, &value, &variance], &mean, &covariance, &cell, of.len())?;
    let (order, samples, start, cell) = (given.order, given.samples, given.start, given.cell);
    Ok(py.detach(|| smoother::likelihood(order, samples, start, Intensity { cell, of })))
}

#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)] // the arrays of a call, named in the stub
pub fn smooth_motion<'py>(
    py: Python<'py>,
    step: PyReadonlyArray1<'_, f64>,
    value: PyReadonlyArray1<'_, f64>,
    variance: PyReadonlyArray1<'_, f64>,
    mean: PyReadonlyArray1<'_, f64>,
    covariance: PyReadonlyArray2<'_, f64>,
    cell: PyReadonlyArray1<'_, u32>,
    intensity: PyReadonlyArray1<'_, f64>,
) -> PyResult<(Array2<'py>, Array2<'py>, Array2<'py>)> {
    let of = slice(&intensity, "intensity")?;
    let given = Given::new([&step, &value, &variance], &mean, &covariance, &cell, of.len())?;
    let (order, samples, start, cell) = (given.order, given.samples, given.start, given.cell);
    let count = samples.value.len();
    let (mut means, mut variances, mut residuals) =
        (vec![[0.0; 3]; count], vec![[0.0; 3]; count], vec![[0.0; 2]; count]);
    py.detach(|| {
        let mut out = Smoothed { mean: &mut means, variance: &mut variances, residual: &mut residuals };
        smoother::smooth(order, samples, start, Intensity { cell, of }, &mut out)
    });
    Ok((table(py, means)?, table(py, variances)?, table(py, residuals)?))
}

#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)] // the arrays of a call, named in the stub
pub fn adapt_motion<'py>(
    py: Python<'py>,
    step: PyReadonlyArray1<'_, f64>,
    value: PyReadonlyArray1<'_, f64>,
    variance: PyReadonlyArray1<'_, f64>,
    mean: PyReadonlyArray1<'_, f64>,
    covariance: PyReadonlyArray2<'_, f64>,
    cell: PyReadonlyArray1<'_, u32>,
    intensity: PyReadonlyArray1<'_, f64>,
    rounded: PyReadonlyArray1<'_, f64>,
    quantum: f64,
    level: f64,
    rounds: usize,
    usual: f64,
    weight: f64,
    floor: f64,
) -> PyResult<(Array1<'py>, f64, Array1<'py>, Array1<'py>, Array1<'py>, Array1<'py>)> {
    let mut of = slice(&intensity, "intensity")?.to_vec();
    let given = Given::new([&step, &value, &variance], &mean, &covariance, &cell, of.len())?;
    for (name, number) in [("level", level), ("usual", usual), ("floor", floor)] {
        if !(number > 0.0 && number.is_finite()) {
            return Err(PyValueError::new_err(format!("{name}: expected a number above 0, got {number}")));
        }
    }
    let rounded = Rounded { value: slice(&rounded, "rounded")?, quantum };
    let count = given.samples.value.len();
    if rounded.value.len() != count {
        return Err(PyValueError::new_err(format!("rounded: expected {count} numbers")));
    }
    let (mut values, mut variances) = (given.samples.value.to_vec(), given.samples.variance.to_vec());
    let (mut told, mut found) = (vec![0.0; count], vec![0.0; of.len()]);
    let rule = Rule { rounds, usual, weight, floor };
    let (order, start) = (given.order, given.start);
    let mut adapted = Adapted {
        step: given.samples.step,
        rounded,
        cell: given.cell,
        of: &mut of,
        sites: Sites { value: &mut values, variance: &mut variances },
        level,
        told: &mut told,
        found: &mut found,
    };
    py.detach(|| smoother::adapt(order, start, rule, &mut adapted));
    let level = adapted.level;
    Ok((
        of.into_pyarray(py),
        level,
        values.into_pyarray(py),
        variances.into_pyarray(py),
        told.into_pyarray(py),
        found.into_pyarray(py),
    ))
}

fn table<const N: usize>(py: Python<'_>, rows: Vec<[f64; N]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}
