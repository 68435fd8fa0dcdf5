//! A system and its derivatives by the values that vary.

use std::sync::Arc;

use guideload::batch::Group;
use guideload::sensitivity::{History, Quantity, SystemDerivative, VariedSystem};
use guideload::{Part, RunError};
use nalgebra::Matrix6;
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{self, Array1, Array2, CoreError, Samples, numbers, zeros};
use crate::interrupt::compute;
use crate::scene::{PyScene, table};

/// A system and its derivatives by each column of values.
#[pyclass(name = "VariedSystem", module = "guideload._core", frozen)]
pub struct PyVariedSystem {
    pub varied: Arc<VariedSystem>,
    pub groups: Vec<Group>,
}

#[pymethods]
impl PyVariedSystem {
    /// The scene of this system.
    fn scene(&self) -> PyScene {
        PyScene(Arc::new(self.varied.system.clone()), Vec::new())
    }

    /// Factors on the accelerations of the motion and on its external loads.
    #[getter]
    fn factors(&self) -> [f64; 2] {
        self.varied.factors
    }

    /// Derivatives of mass, damping and stiffness matrix, each (columns, 6, 6), and of the weight (columns, 6).
    fn matrices<'py>(&self, py: Python<'py>) -> PyResult<([Bound<'py, PyArray3<f64>>; 3], Array2<'py>)> {
        let derivatives = &self.varied.derivatives;
        let cube = |pick: fn(&SystemDerivative) -> &Matrix6<f64>| {
            // Symmetric, so that the order of rows and columns does not matter.
            let flat: Vec<f64> = derivatives.iter().flat_map(|by| pick(by).iter().copied()).collect();
            flat.into_pyarray(py).reshape([derivatives.len(), 6, 6])
        };
        let all = [cube(|by| &by.mass)?, cube(|by| &by.damping)?, cube(|by| &by.stiffness)?];
        Ok((all, table(py, derivatives.iter().map(|by| <[f64; 6]>::from(by.weight)))?))
    }

    /// Derivative of the static position of L (columns, 6).
    fn static_position<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        table(py, self.varied.derivatives.iter().map(|by| <[f64; 6]>::from(by.static_position)))
    }

    /// Derivative of the static load of each link (columns, links).
    fn static_link_loads<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let (columns, links) = (self.varied.derivatives.len(), self.varied.system.links().len());
        let out = zeros(py, &[columns, links])?;
        {
            let mut rows = out.readwrite();
            for (entry, to) in rows.as_slice_mut()?.iter_mut().enumerate() {
                *to = self.varied.static_link_load(entry / links, entry % links);
            }
        }
        Ok(out)
    }

    /// Static load of each group (groups, 6), and its derivative (columns, groups, 6).
    fn static_group_loads<'py>(&self, py: Python<'py>) -> PyResult<(Array2<'py>, Bound<'py, PyArray3<f64>>)> {
        let (columns, groups) = (self.varied.derivatives.len(), self.groups.len());
        let loads = |of: &(usize, &Group)| self.varied.group_load(of.0, of.1, Part::Total).at_rest();
        let at_rest = table(py, self.groups.iter().enumerate().map(|of| loads(&of)))?;
        let out = zeros(py, &[columns, groups, 6])?;
        {
            let mut rows = out.readwrite();
            for (entry, to) in rows.as_slice_mut()?.as_chunks_mut::<6>().0.iter_mut().enumerate() {
                let (column, group) = (entry / groups, entry % groups);
                *to = self.varied.static_group_load(column, group, &self.groups[group]);
            }
        }
        Ok((at_rest, out))
    }

    /// The run under a motion from static equilibrium, of which derivatives are wanted.
    #[pyo3(signature = (time, acceleration, wrench=None, *, start="rest"))]
    fn run(
        &self,
        py: Python<'_>,
        time: PyReadonlyArray1<'_, f64>,
        acceleration: PyReadonlyArray2<'_, f64>,
        wrench: Option<PyReadonlyArray2<'_, f64>>,
        start: &str,
    ) -> PyResult<PyVariedRun> {
        let (mut samples, start) =
            (Samples::new(&time, &acceleration, wrench.as_ref())?, convert::start(start)?);
        let (varied, [motion, load]) = (Arc::clone(&self.varied), self.varied.factors);
        samples.acceleration.as_flattened_mut().iter_mut().for_each(|x| *x *= motion);
        samples.wrench.iter_mut().flat_map(|all| all.as_flattened_mut()).for_each(|x| *x *= load);
        let history = compute(py, |watch| {
            Ok::<_, CoreError>(History::new(&varied, &samples.excitation()?, start, watch)?)
        })??;
        Ok(PyVariedRun { varied, groups: self.groups.clone(), samples, history })
    }

    /// Indices of the links without contact at rest, which enter the modes with their nominal stiffness.
    fn out_of_contact(&self) -> Vec<usize> {
        self.varied.out_of_contact().collect()
    }
}

/// A run of a system, and the derivatives of all that is computed from its states.
#[pyclass(name = "VariedRun", module = "guideload._core", frozen)]
pub struct PyVariedRun {
    varied: Arc<VariedSystem>,
    groups: Vec<Group>,
    /// With the factors on the motion.
    samples: Samples,
    history: History,
}

#[pymethods]
impl PyVariedRun {
    /// Derivatives of a quantity (columns, samples, width).
    #[pyo3(signature = (quantity, part="total"))]
    fn derivatives<'py>(
        &self,
        py: Python<'py>,
        quantity: &str,
        part: &str,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let quantity = self.quantity(quantity, part)?;
        let tangents = compute(py, |watch| {
            Ok::<_, CoreError>(self.history.tangents(&self.varied, &self.samples.excitation()?, watch)?)
        })??;
        let width = quantity.width(&self.varied, &self.groups);
        let shape = [self.varied.derivatives.len(), self.history.states().len(), width];
        let out = zeros(py, &shape)?;
        {
            let mut numbers = out.readwrite();
            let numbers = numbers.as_slice_mut()?;
            let finite = compute(py, |_| {
                let (varied, excitation) = ((&*self.varied, &self.groups[..]), self.samples.excitation()?);
                self.history.derivatives(tangents, varied, &excitation, quantity, numbers);
                Ok::<_, CoreError>(numbers.iter().fold(true, |all, x| all & x.is_finite()))
            })??;
            if !finite {
                return Err(CoreError::Run(RunError::OutOfRange).into());
            }
        }
        Ok(out)
    }

    /// Derivative of a figure by each column (columns,), from its derivatives by a quantity (samples, width).
    #[pyo3(signature = (quantity, weights, part="total"))]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        quantity: &str,
        weights: PyReadonlyArray2<'_, f64>,
        part: &str,
    ) -> PyResult<Array1<'py>> {
        let quantity = self.quantity(quantity, part)?;
        let weights = numbers(&weights, "weights")?;
        let expected = self.history.states().len() * quantity.width(&self.varied, &self.groups);
        if weights.len() != expected {
            let got = weights.len();
            return Err(PyValueError::new_err(format!("weights: expected {expected} numbers, got {got}")));
        }
        let gradient = compute(py, |watch| {
            let (varied, excitation) = ((&*self.varied, &self.groups[..]), self.samples.excitation()?);
            Ok::<_, CoreError>(self.history.gradient(varied, &excitation, (quantity, &weights), watch)?)
        })??;
        Ok(gradient.into_pyarray(py))
    }
}

impl PyVariedRun {
    fn quantity(&self, name: &str, part: &str) -> PyResult<Quantity> {
        let part = convert::part(part)?;
        match name {
            "link_loads" => Ok(Quantity::LinkLoads(part)),
            "group_loads" => Ok(Quantity::GroupLoads(part)),
            "position" => Ok(Quantity::Position),
            "velocity" => Ok(Quantity::Velocity),
            "acceleration" => Ok(Quantity::Acceleration),
            "reaction" => Ok(Quantity::Reaction),
            _ => Err(PyValueError::new_err(format!(
                "quantity: expected link_loads, group_loads, position, velocity, acceleration or reaction, got {name:?}"
            ))),
        }
    }
}
