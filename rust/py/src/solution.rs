//! The states of a run, and the quantities recovered from them.

use std::sync::Arc;

use guideload::input_from;
use guideload::{BodyWithRidersInstant, Input, State, Summary, System, Wrench, link_load};
use guideload::{Recovery, acceleration, evaluate, largest_velocity_change, position, reaction, velocity};
use numpy::ndarray::Dimension;
use numpy::{PyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::convert::{self, List, filled, overwritten};
use crate::error::require_finite;
use crate::interrupt::try_compute;
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
    /// The systems one after the other, and the index of the first state of each.
    pub stretches: Vec<(Arc<System>, usize)>,
    pub states: Vec<State>,
    pub inputs: Inputs,
    /// Of a single system; empty where no rider moves.
    pub travels: Travels,
    /// Of all stretches together.
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
        let part = convert::part(part)?;
        let of = |system| group_loads(system, &groups.0, &centers, part);
        self.recover(py, of, &[self.states.len(), groups.0.len(), 6])
    }

    /// Loads of the links along their directions, (time, links).
    fn link_loads<'py>(&self, py: Python<'py>, part: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let part = convert::part(part)?;
        let count = self.stretches[0].0.links().len();
        let of = |system| Ok((0..count).map(|link| link_load(system, link, part)).collect());
        self.recover(py, of, &[self.states.len(), count])
    }

    /// Position of L in the travelling frame, (time, 6).
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_reference(py, position)
    }

    /// The position at some instants, (instants, 6): the first of each `every` ones, from the start of each stretch.
    fn some_positions<'py>(&self, py: Python<'py>, every: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let every = every.max(1);
        let count = self.each_stretch().map(|(_, states)| states.len().div_ceil(every)).sum();
        filled(py, &[count, 6], |mut rest| {
            for (system, states) in self.each_stretch() {
                let some: Vec<State> = states.iter().copied().step_by(every).collect();
                let (out, after) = rest.split_at_mut(6 * some.len());
                rest = after;
                evaluate(&[position(system)], &some, |_| [0.0; 9], out);
            }
            Ok(())
        })
    }

    /// Largest change of each component of the velocity of L from one instant to the next, (6,).
    fn largest_velocity_change<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut largest = [0.0; 6];
        for (system, states) in self.each_stretch() {
            for (most, size) in largest.iter_mut().zip(largest_velocity_change(system, states)) {
                *most = f64::max(*most, size);
            }
        }
        Ok(PyArray1::from_slice(py, &largest))
    }

    /// Velocity of L in the travelling frame, (time, 6).
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.of_reference(py, velocity)
    }

    /// Position and velocity of L in the travelling frame at the end of the motion, (2, 6).
    fn end<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let system = &self.stretches[self.stretches.len() - 1].0;
        let quantities = [position(system), velocity(system)];
        filled(py, &[2, 6], |out| {
            evaluate(&quantities, &[self.summary.end], |_| [0.0; 9], out);
            Ok(())
        })
    }

    /// Acceleration of L in the travelling frame, (time, 6).
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
        filled(py, &[self.travels.count(), self.states.len(), 3], |out| {
            let flat = self.travels.samples().flat_map(|samples| samples.as_flattened());
            out.iter_mut().zip(flat).for_each(|(to, from)| *to = *from);
            Ok(())
        })
    }

    /// Force of the drive on each moving rider along its direction, (time, riders).
    fn rider_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.travels.count();
        self.of_riders(py, count, |instant, out| out.copy_from_slice(&instant.drive[..count]))
    }

    /// The excitation at the recorded instants, (time, 9): acceleration, force, moment about L.
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        filled(py, &[self.states.len(), 9], |out| {
            out.as_chunks_mut::<9>().0.iter_mut().enumerate().for_each(|(k, out)| *out = self.inputs.at(k));
            Ok(())
        })
    }
}

impl PySolution {
    /// The systems one after the other, with their states.
    fn each_stretch(&self) -> impl Iterator<Item = (&System, &[State])> {
        let ends = self.stretches[1..].iter().map(|(_, first)| *first).chain([self.states.len()]);
        self.stretches.iter().zip(ends).map(|((system, first), end)| (&**system, &self.states[*first..end]))
    }

    /// Quantities that depend on the riders, (time, width).
    fn of_riders<'py>(
        &self,
        py: Python<'py>,
        width: usize,
        write: impl Fn(&BodyWithRidersInstant, &mut [f64]),
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let system = &self.stretches[0].0;
        filled(py, &[self.states.len(), width], |out| {
            let instants =
                try_compute(py, |_| self.travels.instants(system, &self.states, |k| self.inputs.at(k)))?;
            instants.iter().zip(out.chunks_mut(width.max(1))).for_each(|(instant, out)| write(instant, out));
            Ok(())
        })
    }

    fn of_reference<'py>(
        &self,
        py: Python<'py>,
        quantity: for<'a> fn(&'a System) -> Wrench<'a>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.recover(py, |system| Ok(vec![quantity(system)]), &[self.states.len(), 6])
    }

    /// The quantities of each system at all its instants, as an array of this shape.
    fn recover<'a, 'py, const ROWS: usize, D: Dimension>(
        &'a self,
        py: Python<'py>,
        quantities: impl Fn(&'a System) -> PyResult<Vec<Recovery<'a, ROWS>>>,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyArray<f64, D>>> {
        overwritten(py, shape, |mut rest| {
            let mut first = 0;
            for (system, states) in self.each_stretch() {
                let quantities = quantities(system)?;
                let width = usize::max(quantities.len() * ROWS, 1);
                let (out, after) = rest.split_at_mut(usize::min(states.len() * width, rest.len()));
                rest = after;
                try_compute(py, |watch| {
                    let mut finite = true;
                    let parts = states.chunks(AT_A_TIME).zip(out.chunks_mut(AT_A_TIME * width)).enumerate();
                    for (part, (states, out)) in parts.take_while(|_| !watch.stops()) {
                        let from = first + part * AT_A_TIME;
                        finite &= evaluate(&quantities, states, |k| self.inputs.at(from + k), out);
                    }
                    require_finite(finite)
                })?;
                first += states.len();
            }
            debug_assert!(rest.is_empty(), "every number is written");
            Ok(())
        })
    }
}

/// Instants that are evaluated between two looks for Ctrl-C.
pub const AT_A_TIME: usize = 1 << 9;
