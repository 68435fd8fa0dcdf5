//! Elastic laws over arrays.

use guideload::Law;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;

use crate::convert::{Array1, filled, not_contiguous, rows};
use crate::error::CoreError;

#[pyclass(name = "Law", module = "guideload._core", frozen, eq, from_py_object)]
#[derive(Clone, PartialEq)]
pub struct PyLaw(pub Law);

#[pymethods]
impl PyLaw {
    #[staticmethod]
    fn linear(stiffness: f64) -> Result<Self, CoreError> {
        Ok(Self(Law::linear(stiffness)?))
    }

    #[staticmethod]
    fn sided(positive: f64, negative: f64, clearance: f64) -> Result<Self, CoreError> {
        Ok(Self(Law::sided(positive, negative, clearance)?))
    }

    #[staticmethod]
    fn preloaded(stiffness: f64, preload: f64, exponent: f64) -> Result<Self, CoreError> {
        Ok(Self(Law::preloaded(stiffness, preload, exponent)?))
    }

    #[staticmethod]
    fn curve(points: PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        Ok(Self(Law::curve(&rows::<2>(&points, "points")?).map_err(CoreError::from)?))
    }

    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind()
    }

    /// Nominal stiffness.
    #[getter]
    fn stiffness(&self) -> f64 {
        self.0.nominal()
    }

    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.0.edges().to_pyarray(py)
    }

    fn scaled(&self, factor: f64) -> Result<Self, CoreError> {
        Ok(Self(self.0.scaled(factor)?))
    }

    fn force<'py>(&self, py: Python<'py>, deflection: PyReadonlyArray1<'_, f64>) -> PyResult<Array1<'py>> {
        over(py, &deflection, |d| self.0.force(d))
    }

    fn tangent<'py>(&self, py: Python<'py>, deflection: PyReadonlyArray1<'_, f64>) -> PyResult<Array1<'py>> {
        over(py, &deflection, |d| self.0.tangent(d))
    }

    fn energy<'py>(&self, py: Python<'py>, deflection: PyReadonlyArray1<'_, f64>) -> PyResult<Array1<'py>> {
        over(py, &deflection, |d| self.0.energy(d))
    }

    fn __repr__(&self) -> String {
        let (kind, stiffness) = (self.0.kind(), self.0.nominal());
        format!("<Law {kind}, {stiffness:e} N/m, edges at {:?} m>", self.0.edges())
    }
}

/// Evaluates a function at each deflection.
fn over<'py>(
    py: Python<'py>,
    deflection: &PyReadonlyArray1<'_, f64>,
    of: impl Fn(f64) -> f64,
) -> PyResult<Array1<'py>> {
    let deflection = deflection.as_slice().map_err(|_| not_contiguous("deflection"))?;
    filled(py, &[deflection.len()], |values| {
        values.iter_mut().zip(deflection).for_each(|(value, d)| *value = of(*d));
        Ok(())
    })
}
