//! Equivalent loads, and integrals of their powers over the travel.

use guideload::{EquivalentLoad, Interval, Preload};
use numpy::{PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, Array2, not_contiguous, numbers, rows, zeros};
use crate::interrupt::compute;

/// Intervals between two looks for signals: about a millisecond.
const INTERVALS: usize = 16_384;

/// Weights (2, 5, 2), minor factor, preload in N, and its formula: "power" or "linear".
pub type Rule<'py> = (PyReadonlyArray3<'py, f64>, f64, f64, String);

/// The rule of the equivalent load.
pub fn equivalent_load((weights, minor, preload, formula): &Rule<'_>) -> PyResult<EquivalentLoad> {
    let flat = weights.as_slice().map_err(|_| not_contiguous("weights"))?;
    let (pairs, _) = flat.as_chunks::<2>();
    let [first, second] = pairs.as_chunks::<5>().0 else {
        let shape = weights.shape();
        return Err(PyValueError::new_err(format!("weights: expected shape (2, 5, 2), got {shape:?}")));
    };
    let preload = match formula.as_str() {
        _ if *preload == 0.0 => Preload::None,
        "power" => Preload::Power(*preload),
        "linear" => Preload::Linear(*preload),
        other => {
            return Err(PyValueError::new_err(format!("formula: expected power or linear, got {other:?}")));
        }
    };
    Ok(EquivalentLoad { weights: [*first, *second], minor: *minor, preload })
}

/// Integrals of `P^p |v|` and `|v|` over each interval between n instants, two of (n - 1,).
#[pyfunction]
pub fn equivalent_load_integrals<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    velocity: PyReadonlyArray1<'py, f64>,
    acceleration: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray2<'py, f64>,
    rule: Rule<'py>,
    exponent: f64,
) -> PyResult<(Array1<'py>, Array1<'py>)> {
    let rule = equivalent_load(&rule)?;
    let (time, velocity) = (numbers(&time, "time")?, numbers(&velocity, "velocity")?);
    let (acceleration, loads) = (numbers(&acceleration, "acceleration")?, rows::<6>(&loads, "loads")?);
    let lengths = [velocity.len(), acceleration.len(), loads.len()];
    if lengths.iter().any(|&length| length != time.len()) {
        return Err(PyValueError::new_err("time, velocity, acceleration, loads: lengths do not agree"));
    }
    let count = time.len().saturating_sub(1);
    let (powers, paths) = (zeros(py, &[count])?, zeros(py, &[count])?);
    {
        let (mut powers, mut paths) = (powers.readwrite(), paths.readwrite());
        let (powers, paths) = (powers.as_slice_mut()?, paths.as_slice_mut()?);
        compute(py, |watch| {
            for (k, (power, path)) in powers.iter_mut().zip(paths).enumerate() {
                if k % INTERVALS == 0 && watch.stops() {
                    return;
                }
                let travel = Interval {
                    length: time[k + 1] - time[k],
                    velocity: [velocity[k], velocity[k + 1]],
                    acceleration: [acceleration[k], acceleration[k + 1]],
                };
                let [first, last] = [loads[k], loads[k + 1]].map(|[_, rest @ ..]| rest);
                let found = rule.integrals(exponent, &travel, [&first, &last]);
                (*power, *path) = (found.power, found.path);
            }
        })?;
    }
    Ok((powers, paths))
}

/// Derivatives of the sum of the integrals of `P^p |v|` by the loads at each instant (n, 6).
#[pyfunction]
pub fn equivalent_load_weights<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    velocity: PyReadonlyArray1<'py, f64>,
    acceleration: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray2<'py, f64>,
    rule: Rule<'py>,
    exponent: f64,
) -> PyResult<Array2<'py>> {
    let rule = equivalent_load(&rule)?;
    let (time, velocity) = (numbers(&time, "time")?, numbers(&velocity, "velocity")?);
    let (acceleration, loads) = (numbers(&acceleration, "acceleration")?, rows::<6>(&loads, "loads")?);
    let lengths = [velocity.len(), acceleration.len(), loads.len()];
    if lengths.iter().any(|&length| length != time.len()) {
        return Err(PyValueError::new_err("time, velocity, acceleration, loads: lengths do not agree"));
    }
    let weights = zeros(py, &[time.len(), 6])?;
    {
        let mut weights = weights.readwrite();
        let weights = weights.as_slice_mut()?.as_chunks_mut::<6>().0;
        compute(py, |watch| {
            for k in (0..time.len().saturating_sub(1)).take_while(|k| k % INTERVALS != 0 || !watch.stops()) {
                let travel = Interval {
                    length: time[k + 1] - time[k],
                    velocity: [velocity[k], velocity[k + 1]],
                    acceleration: [acceleration[k], acceleration[k + 1]],
                };
                let [first, last] = [loads[k], loads[k + 1]].map(|[_, rest @ ..]| rest);
                let ends = rule.integral_weights(exponent, &travel, [&first, &last]);
                for (end, of) in ends.iter().enumerate() {
                    for (component, slope) in of.iter().enumerate() {
                        weights[k + end][1 + component] += slope;
                    }
                }
            }
        })?;
    }
    Ok(weights)
}

/// The index of the largest equivalent load without the effect of a preload, this load, and the largest size of each component (6,).
#[pyfunction]
pub fn largest_equivalent_load<'py>(
    py: Python<'py>,
    loads: PyReadonlyArray2<'py, f64>,
    rule: Rule<'py>,
) -> PyResult<(usize, f64, [f64; 6])> {
    let (rule, loads) = (equivalent_load(&rule)?, rows::<6>(&loads, "loads")?);
    py.detach(|| {
        let (mut instant, mut peak, mut sizes) = (0, f64::NEG_INFINITY, [0.0; 6]);
        for (k, load) in loads.iter().enumerate() {
            for (size, value) in sizes.iter_mut().zip(load) {
                *size = f64::max(*size, value.abs());
            }
            let [_, rest @ ..] = load;
            let found = rule.without_preload(rest);
            if found > peak {
                (instant, peak) = (k, found);
            }
        }
        Ok((instant, peak, sizes))
    })
}
