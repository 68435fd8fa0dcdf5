//! A scene that owns its links, and the ways to run it.

use std::sync::Arc;

use guideload::reaction;
use guideload::{
    Body, Input, ModelLevel, NamedMethod, Output, Part, Peaks, ReferenceMotion, Rider, RunError, Scene,
    State, System, Watched, eigenvalues, link_load, modes,
};
use numpy::{
    Complex64, IntoPyArray, PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, ToPyArray,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{self, Array1, Array2, List, Samples, StartState, filled, matrix3, numbers, room};
use crate::error::{CoreError, require_finite};
use crate::extremes::{Rules, Sought};
use crate::interrupt::try_compute;
use crate::law::PyLaw;
use crate::links::{self, group_loads};
use crate::riders::{self, RiderTuple, Travels};
use crate::solution::{AT_A_TIME, Inputs, PySolution};

#[pyclass(name = "Scene", module = "guideload._core", frozen)]
pub struct PyScene(pub Arc<System>, pub Vec<Rider>);

/// The method of that name.
pub fn named_method(name: &str) -> PyResult<NamedMethod> {
    NamedMethod::from_name(name).ok_or_else(|| {
        let known: Vec<_> = NamedMethod::ALL.iter().map(|method| method.name()).collect();
        PyValueError::new_err(format!("method: expected one of {}, got {name:?}", known.join(", ")))
    })
}

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (*, mass, center_of_mass, inertia, gravity, free, points, directions, laws, damping, damping_in_contact, offsets=None, base_compliance=None, riders=None))]
    #[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
    fn new(
        mass: f64,
        center_of_mass: [f64; 3],
        inertia: [[f64; 3]; 3],
        gravity: [f64; 3],
        free: List<String>,
        points: PyReadonlyArray2<'_, f64>,
        directions: PyReadonlyArray2<'_, f64>,
        laws: List<PyRef<'_, PyLaw>>,
        damping: PyReadonlyArray1<'_, f64>,
        damping_in_contact: PyReadonlyArray1<'_, bool>,
        offsets: Option<PyReadonlyArray1<'_, f64>>,
        base_compliance: Option<[[f64; 6]; 6]>,
        riders: Option<List<RiderTuple>>,
    ) -> PyResult<Self> {
        let mut body = Body::new(mass, center_of_mass.into(), matrix3(inertia)).map_err(CoreError::from)?;
        let given = riders.map_or(Vec::new(), |riders| riders.0).into_iter().enumerate();
        let riders = given.map(|(i, rider)| riders::rider(i, rider)).collect::<Result<Vec<_>, _>>()?;
        for rider in &riders {
            body = body.plus(rider.body());
        }
        let links =
            links::links(&points, &directions, &laws.0, &damping, &damping_in_contact, offsets.as_ref())?;
        let free = convert::free(&free.0)?;
        let mut scene = Scene::new(body, &links, gravity.into(), free).map_err(CoreError::from)?;
        if let Some(compliance) = base_compliance {
            scene = scene.on_base(convert::matrix6(compliance)).map_err(CoreError::from)?;
        }
        let system = System::new(&scene).map_err(CoreError::from)?;
        Ok(Self(Arc::new(system), riders))
    }

    /// Whether a link has clearance, one side or a curve.
    #[getter]
    fn has_segments(&self) -> bool {
        self.0.first_segmented().is_some()
    }

    /// Model level of the scene.
    #[getter]
    fn model_level(&self) -> &'static str {
        match self.0.model_level() {
            ModelLevel::Linear => "linear",
            ModelLevel::PiecewiseLinear => "piecewise linear",
            ModelLevel::SmoothNonlinear => "smooth nonlinear",
        }
    }

    /// Motions of L in which the body is free within its clearance at rest, (m, 6).
    #[getter]
    fn free_at_rest<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        table(py, self.0.free_at_rest().map(<[f64; 6]>::from))
    }

    #[pyo3(signature = (time, acceleration, wrench=None, *, method, rtol, step=None, times=None, start=StartState::rest(), travel=None))]
    #[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
    fn solve(
        &self,
        py: Python<'_>,
        time: PyReadonlyArray1<'_, f64>,
        acceleration: PyReadonlyArray2<'_, f64>,
        wrench: Option<PyReadonlyArray2<'_, f64>>,
        method: &str,
        rtol: f64,
        step: Option<f64>,
        times: Option<PyReadonlyArray1<'_, f64>>,
        start: StartState<'_>,
        travel: Option<PyReadonlyArray3<'_, f64>>,
    ) -> PyResult<PySolution> {
        let (method, start) = (named_method(method)?, start.start()?);
        let samples = Samples::new(&time, &acceleration, wrench.as_ref())?;
        let travels = Travels::new(&self.1, travel.as_ref())?;
        let times = times.as_ref().map(|times| numbers(times, "times")).transpose()?;
        let system = Arc::clone(&self.0);
        let mut inputs: Vec<Input> = room(times.as_ref().map_or(0, Vec::len))?;
        try_compute(py, |watch| {
            let motions = travels.motions();
            let excitation = samples.excitation()?.with_riders(&motions)?;
            let mut record = Watched { record: Vec::<State>::new(), watch };
            let (control, output) = (convert::control(rtol, step), convert::output(times.as_deref()));
            let summary = method.run(&system, control, start, &excitation, output, &mut record)?;
            let states = record.record;
            if let Some(times) = times {
                for some in times.chunks(AT_A_TIME).take_while(|_| !watch.stops()) {
                    inputs.extend(some.iter().map(|&time| excitation.input_at(time)));
                }
                let travels = travels.at(&excitation, &times);
                let (stretches, inputs) = (vec![(system, 0)], Inputs::At(inputs));
                return Ok(PySolution { stretches, states, inputs, travels, summary });
            }
            let inputs = Inputs::Samples { acceleration: samples.acceleration, wrench: samples.wrench };
            drop(motions);
            Ok(PySolution { stretches: vec![(system, 0)], states, inputs, travels, summary })
        })
    }

    /// Extremes only: (smallest, largest, time of smallest, time of largest), each (groups, 8); with `less` (2 groups, 8), whose second
    /// half has only the largest magnitudes, and else infinite numbers. Then the largest equivalent loads of the groups with a rule, without
    /// the effect of its preload, and their times (rules, 2).
    #[pyo3(signature = (time, acceleration, wrench=None, *, method, rtol, step=None, groups, centers, start=StartState::rest(), travel=None, less=None, rules=None))]
    #[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
    fn peaks<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'_, f64>,
        acceleration: PyReadonlyArray2<'_, f64>,
        wrench: Option<PyReadonlyArray2<'_, f64>>,
        method: &str,
        rtol: f64,
        step: Option<f64>,
        groups: List<PyReadonlyArray1<'_, i64>>,
        centers: PyReadonlyArray2<'_, f64>,
        start: StartState<'_>,
        travel: Option<PyReadonlyArray3<'_, f64>>,
        less: Option<PyReadonlyArray2<'_, f64>>,
        rules: Option<Rules<'_>>,
    ) -> PyResult<[Array2<'py>; 5]> {
        let (method, start) = (named_method(method)?, start.start()?);
        let samples = Samples::new(&time, &acceleration, wrench.as_ref())?;
        let travels = Travels::new(&self.1, travel.as_ref())?;
        let sought = Sought::new(groups.0.len(), less.as_ref(), rules)?;
        let loads = sought.loads(group_loads(&self.0, &groups.0, &centers, Part::Total)?);
        let extremes = try_compute(py, |watch| {
            let motions = travels.motions();
            let excitation = samples.excitation()?.with_riders(&motions)?;
            let mut extremes = sought.begin();
            let mut record =
                Watched { record: Peaks::new(&self.0, &excitation, &loads, &mut extremes), watch };
            let control = convert::control(rtol, step);
            method.run(&self.0, control, start, &excitation, Output::Samples, &mut record)?;
            Ok(extremes)
        })?;
        sought.arrays(py, &extremes)
    }

    /// Mass, damping and stiffness matrices, each (6, 6), and the weight (6,).
    fn matrices<'py>(&self, py: Python<'py>) -> PyResult<([Array2<'py>; 3], Array1<'py>)> {
        let matrices = self.0.matrices();
        let square =
            |m: &nalgebra::Matrix6<f64>| table(py, m.row_iter().map(|row| <[f64; 6]>::from(row.transpose())));
        let all = [square(&matrices.mass)?, square(&matrices.damping)?, square(&matrices.stiffness)?];
        Ok((all, matrices.weight.as_slice().to_pyarray(py)))
    }

    /// Angular frequencies (n,), damping ratios (n,), shapes (n, 6), eigenvalues (2 n,).
    fn modes<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Array1<'py>, Array1<'py>, Array2<'py>, Bound<'py, PyArray1<Complex64>>)> {
        let system = &self.0;
        let values = eigenvalues(system).ok_or(CoreError::Run(RunError::Eigenvalues))?;
        Ok((
            modes(system).map(|mode| mode.frequency).collect::<Vec<_>>().into_pyarray(py),
            modes(system).map(|mode| mode.damping_ratio).collect::<Vec<_>>().into_pyarray(py),
            table(py, modes(system).map(|mode| <[f64; 6]>::from(mode.shape)))?,
            values[..2 * system.mode_count()]
                .iter()
                .map(|z| Complex64::new(z.re, z.im))
                .collect::<Vec<_>>()
                .into_pyarray(py),
        ))
    }

    /// Static position of L (6,).
    fn static_position<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.0.static_position().as_slice().to_pyarray(py)
    }

    /// Static reaction of the held degrees of freedom (6,).
    fn static_reaction<'py>(&self, py: Python<'py>) -> Array1<'py> {
        reaction(&self.0).at_rest().to_pyarray(py)
    }

    /// Static load of each link (links,).
    fn static_link_loads<'py>(&self, py: Python<'py>) -> Array1<'py> {
        let load = |link| link_load(&self.0, link, Part::Total).at_rest()[0];
        (0..self.0.links().len()).map(load).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Static load of each group of links about its centre (groups, 6).
    fn static_group_loads<'py>(
        &self,
        py: Python<'py>,
        groups: List<PyReadonlyArray1<'_, i64>>,
        centers: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Array2<'py>> {
        let loads = group_loads(&self.0, &groups.0, &centers, Part::Total)?;
        let at_rest: Vec<[f64; 6]> = loads.iter().map(|load| load.at_rest()).collect();
        require_finite(at_rest.as_flattened().iter().all(|x| x.is_finite()))?;
        table(py, at_rest.into_iter())
    }

    /// Mean load of each group of links in each interval, less the mean of its loads at both ends (n - 1, groups, 6).
    #[allow(clippy::too_many_arguments)] // each has a name in Python
    fn group_load_bows<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        position: PyReadonlyArray2<'py, f64>,
        velocity: PyReadonlyArray2<'py, f64>,
        acceleration: PyReadonlyArray2<'py, f64>,
        groups: List<PyReadonlyArray1<'_, i64>>,
        centers: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (system, time) = (&*self.0, numbers(&time, "time")?);
        let [position, velocity, acceleration] =
            [(&position, "position"), (&velocity, "velocity"), (&acceleration, "acceleration")]
                .map(|(array, name)| convert::rows::<6>(array, name));
        let (position, velocity, acceleration) = (position?, velocity?, acceleration?);
        if [position.len(), velocity.len(), acceleration.len()] != [time.len(); 3] {
            return Err(PyValueError::new_err(
                "time, position, velocity, acceleration: lengths do not agree",
            ));
        }
        let loads = group_loads(system, &groups.0, &centers, Part::Total)?;
        let (width, intervals) = (6 * loads.len(), time.len().saturating_sub(1));
        filled(py, &[intervals, loads.len(), 6], |bows| {
            try_compute(py, |watch| {
                let mut is_finite = true;
                for from in (0..intervals).step_by(AT_A_TIME).take_while(|_| !watch.stops()) {
                    let to = usize::min(from + AT_A_TIME, intervals);
                    let motion = ReferenceMotion {
                        time: &time[from..=to],
                        position: &position[from..=to],
                        velocity: &velocity[from..=to],
                        acceleration: &acceleration[from..=to],
                    };
                    is_finite &= motion.load_bows(system, &loads, &mut bows[from * width..to * width]);
                }
                require_finite(is_finite)
            })
        })
    }
}

/// Rows of one length as a two-dimensional array.
pub fn table<'py, const N: usize>(
    py: Python<'py>,
    rows: impl Iterator<Item = [f64; N]>,
) -> PyResult<Array2<'py>> {
    let flat: Vec<f64> = rows.flatten().collect();
    let count = flat.len() / N;
    flat.into_pyarray(py).reshape([count, N])
}
