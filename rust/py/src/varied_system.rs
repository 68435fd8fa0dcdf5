//! A system and its derivatives by the values that vary.

use std::sync::Arc;

use guideload::Part;
use guideload::batch::Group;
use guideload::sensitivity::{
    History, Instants, Outputs, Quantity, SystemDerivative, Tangents, VariedSystem,
};
use nalgebra::Matrix6;
use numpy::{
    IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{self, Array1, Array2, Samples, filled, numbers, zeros};
use crate::error::require_finite;
use crate::interrupt::try_compute;
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
        filled(py, &[columns, links], |out| {
            for (entry, to) in out.iter_mut().enumerate() {
                *to = self.varied.static_link_load(entry / links, entry % links);
            }
            Ok(())
        })
    }

    /// Static load of each group (groups, 6), and its derivative (columns, groups, 6).
    fn static_group_loads<'py>(&self, py: Python<'py>) -> PyResult<(Array2<'py>, Bound<'py, PyArray3<f64>>)> {
        let (columns, groups) = (self.varied.derivatives.len(), self.groups.len());
        let loads = |of: &(usize, &Group)| self.varied.group_load(of.0, of.1, Part::Total).at_rest();
        let at_rest = table(py, self.groups.iter().enumerate().map(|of| loads(&of)))?;
        let out = filled(py, &[columns, groups, 6], |out| {
            for (entry, to) in out.as_chunks_mut::<6>().0.iter_mut().enumerate() {
                let (column, group) = (entry / groups, entry % groups);
                *to = self.varied.static_group_load(column, group, &self.groups[group]);
            }
            Ok(())
        })?;
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
        let history =
            try_compute(py, |watch| Ok(History::new(&varied, &samples.excitation()?, start, watch)?))?;
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
        let quantity = named(quantity, part)?;
        let tangents = self.tangents(py)?;
        let width = quantity.width(&self.varied, &self.groups);
        let shape = [self.varied.derivatives.len(), self.history.states().len(), width];
        filled(py, &shape, |out| {
            try_compute(py, |_| {
                let (varied, excitation) = ((&*self.varied, &self.groups[..]), self.samples.excitation()?);
                require_finite(self.history.derivatives(tangents, varied, &excitation, quantity, out))
            })
        })
    }

    /// The run at instants (n,), in ascending order.
    fn at(&self, py: Python<'_>, time: PyReadonlyArray1<'_, f64>) -> PyResult<PyVariedInstants> {
        let (tangents, time) = (self.tangents(py)?, numbers(&time, "time")?);
        let instants = try_compute(py, |watch| {
            let excitation = self.samples.excitation()?;
            Ok(self.history.at(tangents, (&self.varied, &excitation), &time, watch)?)
        })?;
        Ok(PyVariedInstants { varied: Arc::clone(&self.varied), groups: self.groups.clone(), instants })
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
        let quantity = named(quantity, part)?;
        let weights = numbers(&weights, "weights")?;
        let expected = self.history.states().len() * quantity.width(&self.varied, &self.groups);
        if weights.len() != expected {
            let got = weights.len();
            return Err(PyValueError::new_err(format!("weights: expected {expected} numbers, got {got}")));
        }
        let gradient = try_compute(py, |watch| {
            let (varied, excitation) = ((&*self.varied, &self.groups[..]), self.samples.excitation()?);
            Ok(self.history.gradient(varied, &excitation, (quantity, &weights), watch)?)
        })?;
        Ok(gradient.into_pyarray(py))
    }
}

impl PyVariedRun {
    fn tangents(&self, py: Python<'_>) -> PyResult<&Tangents> {
        try_compute(py, |watch| {
            Ok(self.history.tangents(&self.varied, &self.samples.excitation()?, watch)?)
        })
    }
}

/// A run at some instants, with derivatives by time and by each column of values.
#[pyclass(name = "VariedInstants", module = "guideload._core", frozen)]
pub struct PyVariedInstants {
    varied: Arc<VariedSystem>,
    groups: Vec<Group>,
    instants: Instants,
}

#[pymethods]
impl PyVariedInstants {
    /// Accelerations of L's frame and external loads (n, 9), and their derivatives by time.
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<(Array2<'py>, Array2<'py>)> {
        let [inputs, slopes] = self.instants.inputs();
        Ok((table(py, inputs.iter().copied())?, table(py, slopes.iter().copied())?))
    }

    /// Sums of the numbers of a quantity with factors `along` (k, width): values (n, k), their derivatives by time (n, k) and by the columns
    /// (columns, n, k).
    #[pyo3(signature = (quantity, along, part="total"))]
    fn histories<'py>(
        &self,
        py: Python<'py>,
        quantity: &str,
        along: PyReadonlyArray2<'_, f64>,
        part: &str,
    ) -> PyResult<(Array2<'py>, Array2<'py>, Bound<'py, PyArray3<f64>>)> {
        let quantity = named(quantity, part)?;
        let (sums, got) = (along.shape()[0], along.shape()[1]);
        let along = numbers(&along, "along")?;
        let width = quantity.width(&self.varied, &self.groups);
        if got != width {
            return Err(PyValueError::new_err(format!("along: expected rows of {width} numbers, got {got}")));
        }
        let count = self.instants.count();
        let (values, slopes) = (zeros(py, &[count, sums])?, zeros(py, &[count, sums])?);
        let derivatives = zeros(py, &[self.varied.derivatives.len(), count, sums])?;
        {
            let (mut values, mut slopes) = (values.readwrite(), slopes.readwrite());
            let mut derivatives = derivatives.readwrite();
            let out = Outputs {
                values: values.as_slice_mut()?,
                slopes: slopes.as_slice_mut()?,
                derivatives: derivatives.as_slice_mut()?,
            };
            let of = (&*self.varied, &self.groups[..]);
            try_compute(py, |_| require_finite(self.instants.write(of, (quantity, &along), out)))?;
        }
        Ok((values, slopes, derivatives))
    }
}

/// The quantity with this name, and the part of it if it is a load.
fn named(name: &str, part: &str) -> PyResult<Quantity> {
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
