//! The smoother over arrays.

use guideload::Watch;
use guideload::smoother::{
    self, AdaptationRule, Adapted, Rounded, Samples, SiteApproximations, Smoothed, Start,
};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::chain::{Chain, OscillatorOfModel};
use crate::convert::{Array1, Array2, check_finite, check_results, numbers, zeros};
use crate::interrupt::try_compute;

/// The arrays of samples and of the model of their motion: step, value, variance, mean, covariance, segment, density, oscillator.
type Arrays<'py> = (
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, f64>,
    OscillatorOfModel,
);

/// What `adapt_motion` returns: densities, noise variance, values and variances of the sites, log densities, noise ratios.
type AdaptedArrays<'py> = (Array1<'py>, f64, Array1<'py>, Array1<'py>, Array1<'py>, Array1<'py>);

/// Checked copies of the arrays of one motion.
struct Checked {
    chain: Chain,
    value: Vec<f64>,
    mean: Vec<f64>,
}

impl Checked {
    fn new(
        (step, value, variance, mean, covariance, segment, density, oscillator): &Arrays<'_>,
    ) -> PyResult<Self> {
        let (value, mean) = (numbers(value, "value")?, numbers(mean, "mean")?);
        let chain = Chain::new(step, variance, covariance, segment, density, *oscillator)?;
        if value.len() != chain.variance.len() || mean.len() != chain.order {
            return Err(PyValueError::new_err("value, variance, mean, covariance: lengths do not agree"));
        }
        check_finite(&value, "value")?;
        check_finite(&mean, "mean")?;
        Ok(Self { chain, value, mean })
    }

    fn samples<'a>(&'a self, watch: Watch<'a>) -> Samples<'a> {
        Samples { step: &self.chain.step, value: &self.value, variance: &self.chain.variance, watch }
    }

    fn start(&self) -> Start<'_> {
        Start { mean: &self.mean, covariance: &self.chain.covariance }
    }
}

#[pyfunction]
pub fn motion_likelihood(py: Python<'_>, given: Arrays<'_>) -> PyResult<Option<(f64, f64)>> {
    let given = Checked::new(&given)?;
    let found = try_compute(py, |watch| {
        let (samples, start) = (given.samples(watch), given.start());
        Ok(smoother::likelihood(given.chain.order, samples, start, given.chain.noise())?)
    })?;
    if let Some((determinant, misfit)) = found {
        check_results(&[&[determinant, misfit]])?;
    }
    Ok(found)
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
        try_compute(py, |watch| {
            let (samples, start) = (given.samples(watch), given.start());
            Ok(smoother::smooth(given.chain.order, samples, start, given.chain.noise(), &mut out)?)
        })?;
        check_results(&[means.as_slice()?, variances.as_slice()?, residuals.as_slice()?])?;
    }
    Ok(arrays)
}

/// Most rounds of an adaptation; it settles in some ten.
const MOST_ROUNDS: usize = 10_000;

fn check_rule(
    quantum: f64,
    level: f64,
    (rounds, usual, weight, floor): (usize, f64, f64, f64),
) -> PyResult<()> {
    for (name, number) in [("level", level), ("usual", usual), ("floor", floor)] {
        if !(number > 0.0 && number.is_finite()) {
            return Err(PyValueError::new_err(format!("{name}: expected a number above 0, got {number}")));
        }
    }
    for (name, number) in [("quantum", quantum), ("weight", weight)] {
        if !(number >= 0.0 && number.is_finite()) {
            return Err(PyValueError::new_err(format!("{name}: expected a number >= 0, got {number}")));
        }
    }
    if rounds > MOST_ROUNDS {
        return Err(PyValueError::new_err(format!("rounds: expected up to {MOST_ROUNDS}, got {rounds}")));
    }
    Ok(())
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
    check_rule(quantum, level, rule)?;
    let (rounds, usual, weight, floor) = rule;
    let count = given.value.len();
    if rounded.len() != count {
        return Err(PyValueError::new_err(format!("rounded: expected {count} numbers")));
    }
    let rounded = numbers(&rounded, "rounded")?;
    check_finite(&rounded, "rounded")?;
    let Checked { chain, mut value, mean } = given;
    let Chain { order, step, mut variance, covariance, segment, mut density, oscillator } = chain;
    let (log_density, noise_ratio) = (zeros(py, &[count])?, zeros(py, &[density.len()])?);
    let rule =
        AdaptationRule { rounds, typical_density: usual, prior_weight: weight, min_noise_variance: floor };
    let level = {
        let (mut log_density, mut noise_ratio) = (log_density.readwrite(), noise_ratio.readwrite());
        let (log_density, noise_ratio) = (log_density.as_slice_mut()?, noise_ratio.as_slice_mut()?);
        try_compute(py, |watch| {
            let mut adapted = Adapted {
                step: &step,
                rounded: Rounded { value: &rounded, quantum },
                segment: &segment,
                density: &mut density,
                oscillator,
                sites: SiteApproximations { value: &mut value, variance: &mut variance },
                noise_variance: level,
                log_density,
                noise_ratio,
                watch,
            };
            let start = Start { mean: &mean, covariance: &covariance };
            smoother::adapt(order, start, rule, &mut adapted)?;
            Ok(adapted.noise_variance)
        })?
    };
    check_results(&[
        &density,
        &[level],
        &value,
        log_density.readonly().as_slice()?,
        noise_ratio.readonly().as_slice()?,
    ])?;
    Ok((
        density.into_pyarray(py),
        level,
        value.into_pyarray(py),
        variance.into_pyarray(py),
        log_density,
        noise_ratio,
    ))
}
