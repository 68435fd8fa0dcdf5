//! The smoother's kernels over arrays.

use guideload::Watch;
use guideload::smoother::{
    self, AdaptationRule, Adapted, ProcessNoise, Rounded, Samples, SiteApproximations, Smoothed, Start,
};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, Array2, CoreError, numbers, zeros};
use crate::interrupt::compute;

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

/// Checked copies of the arrays of one motion.
struct Checked {
    order: usize,
    step: Vec<f64>,
    value: Vec<f64>,
    variance: Vec<f64>,
    mean: Vec<f64>,
    covariance: Vec<f64>,
    segment: Vec<u32>,
    density: Vec<f64>,
}

impl Checked {
    fn new((step, value, variance, mean, covariance, segment, density): &Arrays<'_>) -> PyResult<Self> {
        let checked = Self {
            order: mean.len(),
            step: numbers(step, "step")?,
            value: numbers(value, "value")?,
            variance: numbers(variance, "variance")?,
            mean: numbers(mean, "mean")?,
            covariance: numbers(covariance, "covariance")?,
            segment: numbers(segment, "segment")?,
            density: numbers(density, "density")?,
        };
        let (count, order, segments) = (checked.value.len(), checked.order, checked.density.len());
        let intervals = [checked.step.len(), checked.segment.len()];
        let fits = intervals.iter().all(|length| length + 1 == count) && checked.variance.len() == count;
        if !fits
            || checked.covariance.len() != order * order
            || checked.segment.iter().any(|&segment| segment as usize >= segments)
        {
            return Err(PyValueError::new_err(
                "step, value, variance, segment, mean, covariance: lengths do not agree",
            ));
        }
        if !(2..=6).contains(&order) {
            return Err(PyValueError::new_err(format!("mean: expected 2 to 6 numbers, got {order}")));
        }
        Ok(checked)
    }

    fn samples<'a>(&'a self, watch: Watch<'a>) -> Samples<'a> {
        Samples { step: &self.step, value: &self.value, variance: &self.variance, watch }
    }

    fn start(&self) -> Start<'_> {
        Start { mean: &self.mean, covariance: &self.covariance }
    }

    fn noise(&self) -> ProcessNoise<'_> {
        ProcessNoise { segment: &self.segment, density: &self.density }
    }
}

#[pyfunction]
pub fn motion_likelihood(py: Python<'_>, given: Arrays<'_>) -> PyResult<Option<(f64, f64)>> {
    let given = Checked::new(&given)?;
    let found = compute(py, |watch| {
        smoother::likelihood(given.order, given.samples(watch), given.start(), given.noise())
    })?;
    Ok(found.map_err(CoreError::from)?)
}

#[pyfunction]
pub fn smooth_motion<'py>(
    py: Python<'py>,
    given: Arrays<'py>,
) -> PyResult<(Array2<'py>, Array2<'py>, Array2<'py>)> {
    let given = Checked::new(&given)?;
    let count = given.value.len();
    let arrays = (zeros(py, &[count, 3])?, zeros(py, &[count, 3])?, zeros(py, &[count, 2])?);
    {
        let (mut means, mut variances, mut residuals) =
            (arrays.0.readwrite(), arrays.1.readwrite(), arrays.2.readwrite());
        let mut out = Smoothed {
            mean: means.as_slice_mut()?.as_chunks_mut().0,
            variance: variances.as_slice_mut()?.as_chunks_mut().0,
            residual: residuals.as_slice_mut()?.as_chunks_mut().0,
        };
        compute(py, |watch| {
            smoother::smooth(given.order, given.samples(watch), given.start(), given.noise(), &mut out)
        })?
        .map_err(CoreError::from)?;
    }
    Ok(arrays)
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
    let given = Checked::new(&given)?;
    let (rounds, usual, weight, floor) = rule;
    for (name, number) in [("level", level), ("usual", usual), ("floor", floor)] {
        if !(number > 0.0 && number.is_finite()) {
            return Err(PyValueError::new_err(format!("{name}: expected a number above 0, got {number}")));
        }
    }
    let count = given.value.len();
    if rounded.len() != count {
        return Err(PyValueError::new_err(format!("rounded: expected {count} numbers")));
    }
    let rounded = numbers(&rounded, "rounded")?;
    let Checked { order, step, mut value, mut variance, mean, covariance, segment, mut density } = given;
    let (log_density, noise_ratio) = (zeros(py, &[count])?, zeros(py, &[density.len()])?);
    let rule =
        AdaptationRule { rounds, typical_density: usual, prior_weight: weight, min_noise_variance: floor };
    let level = {
        let (mut log_density, mut noise_ratio) = (log_density.readwrite(), noise_ratio.readwrite());
        let (log_density, noise_ratio) = (log_density.as_slice_mut()?, noise_ratio.as_slice_mut()?);
        compute(py, |watch| {
            let mut adapted = Adapted {
                step: &step,
                rounded: Rounded { value: &rounded, quantum },
                segment: &segment,
                density: &mut density,
                sites: SiteApproximations { value: &mut value, variance: &mut variance },
                noise_variance: level,
                log_density,
                noise_ratio,
                watch,
            };
            let start = Start { mean: &mean, covariance: &covariance };
            smoother::adapt(order, start, rule, &mut adapted)?;
            Ok::<_, CoreError>(adapted.noise_variance)
        })??
    };
    Ok((
        density.into_pyarray(py),
        level,
        value.into_pyarray(py),
        variance.into_pyarray(py),
        log_density,
        noise_ratio,
    ))
}
