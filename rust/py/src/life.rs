//! Equivalent loads, and integrals of their powers over the travel.

use guideload::{EquivalentLoad, Integrals, Interval, Preload};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, not_contiguous, rows, slice};

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
    let (time, velocity) = (slice(&time, "time")?, slice(&velocity, "velocity")?);
    let (acceleration, loads) = (slice(&acceleration, "acceleration")?, rows::<6>(&loads, "loads")?);
    let lengths = [velocity.len(), acceleration.len(), loads.len()];
    if lengths.iter().any(|&length| length != time.len()) {
        return Err(PyValueError::new_err("time, velocity, acceleration, loads: lengths do not agree"));
    }
    let intervals = py.detach(|| {
        let of_interval = |k: usize| {
            let travel = Interval {
                length: time[k + 1] - time[k],
                velocity: [velocity[k], velocity[k + 1]],
                acceleration: [acceleration[k], acceleration[k + 1]],
            };
            let [first, last] = [loads[k], loads[k + 1]].map(|[_, rest @ ..]| rest);
            let Integrals { power, path } = rule.integrals(exponent, &travel, [&first, &last]);
            (power, path)
        };
        (0..time.len().saturating_sub(1)).map(of_interval).unzip::<f64, f64, Vec<_>, Vec<_>>()
    });
    Ok((intervals.0.into_pyarray(py), intervals.1.into_pyarray(py)))
}
