//! The smoother's kernels over arrays.

use guideload::smoother::{
    self, AdaptationRule, Adapted, ProcessNoise, Rounded, Samples, SiteApproximations, Smoothed, Start,
};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, Array2, not_contiguous, slice};

/// The arrays of samples and of the model of their motion: step, value, variance, mean, covariance, segment, density.
type Arrays<'py> = (
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, f64>,
);

/// What `adapt_motion` returns: densities, noise variance, values and variances of the sites, log densities, noise ratios.
type AdaptedArrays<'py> = (Array1<'py>, f64, Array1<'py>, Array1<'py>, Array1<'py>, Array1<'py>);

/// Checked arrays of one motion.
struct Checked<'a> {
    order: usize,
    samples: Samples<'a>,
    start: Start<'a>,
    noise: ProcessNoise<'a>,
}

impl<'a> Checked<'a> {
    fn new((step, value, variance, mean, covariance, segment, density): &'a Arrays<'_>) -> PyResult<Self> {
        let samples = Samples {
            step: slice(step, "step")?,
            value: slice(value, "value")?,
            variance: slice(variance, "variance")?,
        };
        let start = Start {
            mean: slice(mean, "mean")?,
            covariance: covariance.as_slice().map_err(|_| not_contiguous("covariance"))?,
        };
        let noise = ProcessNoise { segment: slice(segment, "segment")?, density: slice(density, "density")? };
        let (count, order, segments) = (samples.value.len(), start.mean.len(), noise.density.len());
        let segment = noise.segment;
        let fits =
            samples.step.len() + 1 == count && samples.variance.len() == count && segment.len() + 1 == count;
        if !fits || start.covariance.len() != order * order || segment.iter().any(|&s| s as usize >= segments)
        {
            return Err(PyValueError::new_err(
                "step, value, variance, segment, mean, covariance: lengths do not agree",
            ));
        }
        if !(2..=6).contains(&order) {
            return Err(PyValueError::new_err(format!("mean: expected 2 to 6 numbers, got {order}")));
        }
        Ok(Self { order, samples, start, noise })
    }
}

#[pyfunction]
pub fn motion_likelihood(py: Python<'_>, given: Arrays<'_>) -> PyResult<Option<(f64, f64)>> {
    let Checked { order, samples, start, noise } = Checked::new(&given)?;
    Ok(py.detach(|| smoother::likelihood(order, samples, start, noise)))
}

#[pyfunction]
pub fn smooth_motion<'py>(
    py: Python<'py>,
    given: Arrays<'py>,
) -> PyResult<(Array2<'py>, Array2<'py>, Array2<'py>)> {
    let Checked { order, samples, start, noise } = Checked::new(&given)?;
    let count = samples.value.len();
    let (mut means, mut variances, mut residuals) =
        (vec![[0.0; 3]; count], vec![[0.0; 3]; count], vec![[0.0; 2]; count]);
    py.detach(|| {
        let mut out = Smoothed { mean: &mut means, variance: &mut variances, residual: &mut residuals };
        smoother::smooth(order, samples, start, noise, &mut out)
    });
    Ok((table(py, means)?, table(py, variances)?, table(py, residuals)?))
}

#[pyfunction]
pub fn adapt_motion<'py>(
    py: Python<'py>,
    given: Arrays<'py>,
    rounded: PyReadonlyArray1<'py, f64>,
    quantum: f64,
    level: f64,
    rule: (usize, f64, f64, f64),
) -> PyResult<AdaptedArrays<'py>> {
    let Checked { order, samples, start, noise } = Checked::new(&given)?;
    let (rounds, usual, weight, floor) = rule;
    for (name, number) in [("level", level), ("usual", usual), ("floor", floor)] {
        if !(number > 0.0 && number.is_finite()) {
            return Err(PyValueError::new_err(format!("{name}: expected a number above 0, got {number}")));
        }
    }
    let rounded = Rounded { value: slice(&rounded, "rounded")?, quantum };
    let count = samples.value.len();
    if rounded.value.len() != count {
        return Err(PyValueError::new_err(format!("rounded: expected {count} numbers")));
    }
    let (mut values, mut variances, mut density) =
        (samples.value.to_vec(), samples.variance.to_vec(), noise.density.to_vec());
    let (mut log_density, mut noise_ratio) = (vec![0.0; count], vec![0.0; density.len()]);
    let rule =
        AdaptationRule { rounds, typical_density: usual, prior_weight: weight, min_noise_variance: floor };
    let mut adapted = Adapted {
        step: samples.step,
        rounded,
        segment: noise.segment,
        density: &mut density,
        sites: SiteApproximations { value: &mut values, variance: &mut variances },
        noise_variance: level,
        log_density: &mut log_density,
        noise_ratio: &mut noise_ratio,
    };
    py.detach(|| smoother::adapt(order, start, rule, &mut adapted));
    let level = adapted.noise_variance;
    Ok((
        density.into_pyarray(py),
        level,
        values.into_pyarray(py),
        variances.into_pyarray(py),
        log_density.into_pyarray(py),
        noise_ratio.into_pyarray(py),
    ))
}

fn table<const N: usize>(py: Python<'_>, rows: Vec<[f64; N]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}
