//! The states of a run, and the quantities recovered from them.

use std::sync::Arc;

use guideload::input_from;
use guideload::{Input, RiddenInstant, RunError, State, Summary, System, Wrench, link_load};
use guideload::{Recovery, acceleration, evaluate, position, reaction, velocity};
use numpy::ndarray::Dimension;
use numpy::{PyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::convert::{self, CoreError, List, rows, zeros};
use crate::interrupt::compute;
use crate::links::group_loads;
use crate::riders::Travels;

/// Excitation at the recorded instants: the given samples, or interpolated at output times.
pub enum Inputs {
    Samples { acceleration: Vec<[f64; 3]>, wrench: Option<Vec<[f64; 6]>> },
    At(Vec<Input>),
}

impl Inputs {
    fn at(&self, k: usize) -> Input {
        match self {
            Self::Samples { acceleration, wrench } => {
                input_from(acceleration[k], wrench.as_ref().map_or([0.0; 6], |wrench| wrench[k]))
            }
            Self::At(inputs) => inputs[k],
        }
    }
}

#[pyclass(name = "Solution", module = "guideload._core", frozen)]
pub struct PySolution {
    pub system: Arc<System>,
    pub states: Vec<State>,
    pub inputs: Inputs,
    pub travels: Travels,
    pub summary: Summary,
}

#[pymethods]
impl PySolution {
    #[getter]
    fn steps(&self) -> usize {
        self.summary.steps
    }

    #[getter]
    fn rejected(&self) -> usize {
        self.summary.rejected
    }

    #[getter]
    fn contact_changes(&self) -> usize {
        self.summary.contact_changes
    }

    #[getter]
    fn load_scale(&self) -> f64 {
        self.summary.load_scale
    }

    /// Loads of groups of links about their centres, (time, groups, 6).
    fn group_loads<'py>(
        &self,
        py: Python<'py>,
        groups: List<PyReadonlyArray1<'_, i64>>,
        centers: PyReadonlyArray2<'_, f64>,
        part: &str,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let loads =
            group_loads(&self.system, &groups.0, &rows::<3>(&centers, "centers")?, convert::part(part)?)?;
        self.recover(py, &loads, &[self.states.len(), loads.len(), 6])
    }

    /// Loads of the links along their directions, (time, links).
    fn link_loads<'py>(&self, py: Python<'py>, part: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let part = convert::part(part)?;
        let load = |link| link_load(&self.system, link, part);
        let loads: Vec<_> = (0..self.system.links().len()).map(load).collect();
        self.recover(py, &loads, &[self.states.len(), loads.len()])
    }

    /// Position of L in the carriage frame, (time, 6).
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_reference(py, position)
    }

    /// Velocity of L in the carriage frame, (time, 6).
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_reference(py, velocity)
    }

    /// Acceleration of L in the carriage frame, (time, 6).
    fn acceleration<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        if !self.travels.is_empty() {
            return self.of_riders(py, 6, |instant, out| out.copy_from_slice(&instant.acceleration));
        }
        self.of_reference(py, acceleration)
    }

    /// Reaction of the held degrees of freedom, (time, 6).
    fn reaction<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        if !self.travels.is_empty() {
            return self.of_riders(py, 6, |instant, out| out.copy_from_slice(&instant.reaction));
        }
        self.of_reference(py, reaction)
    }

    /// Force and moment about L by which the riders' motion differs from riders at rest, (time, 6).
    fn rider_wrench<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_riders(py, 6, |instant, out| out.copy_from_slice(&instant.wrench))
    }

    /// Travel, speed and acceleration of the moving riders, (riders, time, 3).
    fn rider_travel<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let array = zeros(py, &[self.travels.count(), self.states.len(), 3])?;
        let flat = self.travels.samples().flat_map(|samples| samples.as_flattened().iter().copied());
        for (to, from) in array.readwrite().as_slice_mut()?.iter_mut().zip(flat) {
            *to = from;
        }
        Ok(array)
    }

    /// Force of the drive on each moving rider along its direction, (time, riders).
    fn rider_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.travels.count();
        self.of_riders(py, count, |instant, out| out.copy_from_slice(&instant.drive[..count]))
    }

    /// The excitation at the recorded instants, (time, 9): acceleration, force, moment about L.
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inputs = zeros(py, &[self.states.len(), 9])?;
        for (k, input) in inputs.readwrite().as_slice_mut()?.as_chunks_mut::<9>().0.iter_mut().enumerate() {
            *input = self.inputs.at(k);
        }
        Ok(inputs)
    }
}

impl PySolution {
    /// Quantities that depend on the riders, (time, width).
    fn of_riders<'py>(
        &self,
        py: Python<'py>,
        width: usize,
        write: impl Fn(&RiddenInstant, &mut [f64]),
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let array = zeros(py, &[self.states.len(), width])?;
        let instants =
            compute(py, |_| self.travels.instants(&self.system, &self.states, |k| self.inputs.at(k)))??;
        for (instant, out) in instants.iter().zip(array.readwrite().as_slice_mut()?.chunks_mut(width.max(1)))
        {
            write(instant, out);
        }
        Ok(array)
    }

    fn of_reference<'py>(
        &self,
        py: Python<'py>,
        quantity: for<'a> fn(&'a System) -> Wrench<'a>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let quantity = [quantity(&self.system)];
        self.recover(py, &quantity, &[self.states.len(), 6])
    }

    /// The quantities at all instants, as an array of this shape.
    fn recover<'py, const ROWS: usize, D: Dimension>(
        &self,
        py: Python<'py>,
        quantities: &[Recovery<ROWS>],
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyArray<f64, D>>> {
        let array = zeros(py, shape)?;
        let width = usize::max(quantities.len() * ROWS, 1);
        {
            let mut out = array.readwrite();
            let parts = out.as_slice_mut()?.chunks_mut(AT_A_TIME * width);
            let finite = compute(py, |watch| {
                let mut finite = true;
                let parts = self.states.chunks(AT_A_TIME).zip(parts).enumerate();
                for (part, (states, out)) in parts.take_while(|_| !watch.stops()) {
                    evaluate(quantities, states, |k| self.inputs.at(part * AT_A_TIME + k), out);
                    finite &= out.iter().fold(true, |all, x| all & x.is_finite());
                }
                finite
            })?;
            if !finite {
                return Err(CoreError::Run(RunError::OutOfRange).into());
            }
        }
        Ok(array)
    }
}

/// Instants that are evaluated between two looks for Ctrl-C.
pub const AT_A_TIME: usize = 1 << 16;
