//! The model of a motion without the values of its samples, from arrays.

use guideload::smoother::{MAX_ORDER, Oscillator, ProcessNoise};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{check, check_finite, numbers};

/// Frequency in radians per unit of time, damping ratio, and index of the acceleration in the state.
pub type OscillatorOfModel = Option<(f64, f64, usize)>;

/// Checked copies of the arrays of a chain.
pub struct Chain {
    pub order: usize,
    pub step: Vec<f64>,
    pub variance: Vec<f64>,
    pub covariance: Vec<f64>,
    pub segment: Vec<u32>,
    pub density: Vec<f64>,
    pub oscillator: Option<Oscillator>,
}

impl Chain {
    pub fn new(
        step: &PyReadonlyArray1<'_, f64>,
        variance: &PyReadonlyArray1<'_, f64>,
        covariance: &PyReadonlyArray2<'_, f64>,
        segment: &PyReadonlyArray1<'_, u32>,
        density: &PyReadonlyArray1<'_, f64>,
        oscillator: OscillatorOfModel,
    ) -> PyResult<Self> {
        let order = covariance.shape()[0];
        let chain = Self {
            order,
            step: numbers(step, "step")?,
            variance: numbers(variance, "variance")?,
            covariance: numbers(covariance, "covariance")?,
            segment: numbers(segment, "segment")?,
            density: numbers(density, "density")?,
            oscillator: oscillator.map(|(frequency, damping, acceleration)| Oscillator {
                frequency,
                damping,
                acceleration,
            }),
        };
        let intervals = [chain.step.len(), chain.segment.len()];
        let (count, segments) = (chain.variance.len(), chain.density.len());
        if intervals.iter().any(|length| length + 1 != count)
            || covariance.shape()[1] != order
            || chain.segment.iter().any(|&segment| segment as usize >= segments)
        {
            return Err(PyValueError::new_err(
                "step, variance, covariance, segment, density: lengths do not agree",
            ));
        }
        if !(2..=MAX_ORDER).contains(&order) {
            return Err(PyValueError::new_err(format!("covariance: expected 2 to 6 rows, got {order}")));
        }
        check(&chain.step, "step", "a finite number > 0", |x| x > 0.0 && x < f64::INFINITY)?;
        check(&chain.variance, "variance", "a number > 0", |x| x > 0.0)?;
        check(&chain.density, "density", "a finite number >= 0", |x| (0.0..f64::INFINITY).contains(&x))?;
        if let Some(Oscillator { frequency, damping, acceleration }) = chain.oscillator {
            let fits =
                frequency > 0.0 && frequency < f64::INFINITY && (0.0..f64::INFINITY).contains(&damping);
            if !(fits && order >= 4 && acceleration <= order - 3) {
                return Err(PyValueError::new_err(format!(
                    "oscillator: expected a frequency above 0, a damping ratio >= 0, and an acceleration with at least two states \
                     after it, got {frequency}, {damping}, and number {acceleration} of {order} states"
                )));
            }
        }
        chain.check_covariance()?;
        Ok(chain)
    }

    /// Finite, symmetric, and no correlation above 1. (Of an indefinite matrix that passes, the result is not finite.)
    fn check_covariance(&self) -> PyResult<()> {
        check_finite(&self.covariance, "covariance")?;
        let at = |i: usize, j: usize| self.covariance[i * self.order + j];
        for i in 0..self.order {
            for j in 0..=i {
                let largest = at(i, i).sqrt() * at(j, j).sqrt() * (1.0 + ROUNDING);
                let symmetric = (at(i, j) - at(j, i)).abs() <= ROUNDING * largest;
                // Not NaN, if a diagonal entry is negative.
                if !(symmetric && at(i, j).abs() <= largest) {
                    return Err(PyValueError::new_err(format!(
                        "covariance[{i}, {j}]: expected a symmetric, positive semidefinite matrix, got {}",
                        at(i, j)
                    )));
                }
            }
        }
        Ok(())
    }

    pub fn noise(&self) -> ProcessNoise<'_> {
        ProcessNoise { segment: &self.segment, density: &self.density, oscillator: self.oscillator }
    }
}

/// Rounding of the entries of a covariance.
const ROUNDING: f64 = 1e-9;
