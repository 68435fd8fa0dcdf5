//! Intervals in parts.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::numbers;

#[pyfunction]
pub fn enough_parts<'py>(
    py: Python<'py>,
    intervals: PyReadonlyArray1<'py, f64>,
    starts: bool,
    fastest: f64,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let intervals = numbers(&intervals, "intervals")?;
    let parts = py.detach(|| guideload::enough_parts(&intervals, starts, fastest));
    Ok(PyArray1::from_iter(py, parts.into_iter().map(|parts| parts as i64)))
}

#[pyfunction]
pub fn limited_parts<'py>(
    py: Python<'py>,
    parts: PyReadonlyArray1<'py, i64>,
    most: usize,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let given = parts.as_array().iter().map(|parts| usize::try_from(*parts)).collect::<Result<Vec<_>, _>>();
    let mut parts = given.map_err(|_| PyValueError::new_err("parts: expected positive numbers"))?;
    guideload::limit_parts(&mut parts, most);
    Ok(PyArray1::from_iter(py, parts.into_iter().map(|parts| parts as i64)))
}
