//! Credible bands of loads, and random motions and peaks, over arrays.

use guideload::bands::{self, Deviation, NominalLoads, StandardDeviations};
use guideload::smoother::{self, Posterior, PosteriorInput, ProcessNoise};
use guideload::{Part, Wrench};
use numpy::{
    IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, Array2, not_contiguous, rows, slice};
use crate::links::group_loads;
use crate::scene::PyScene;

type Array3<'py> = Bound<'py, PyArray3<f64>>;

/// The arrays of a chain: step, variance, covariance, segment, density.
type Chain<'py> = (
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, f64>,
);

/// The checked arrays of a chain.
struct Checked<'a> {
    order: usize,
    given: PosteriorInput<'a>,
}

impl<'a> Checked<'a> {
    fn new(
        (step, variance, covariance, segment, density): &'a Chain<'_>,
        derivative: usize,
    ) -> PyResult<Self> {
        let order = covariance.shape()[0];
        let noise = ProcessNoise { segment: slice(segment, "segment")?, density: slice(density, "density")? };
        let given = PosteriorInput {
            step: slice(step, "step")?,
            variance: slice(variance, "variance")?,
            covariance: covariance.as_slice().map_err(|_| not_contiguous("covariance"))?,
            noise,
        };
        let intervals = [given.step.len(), given.noise.segment.len()];
        let fits = intervals.iter().all(|length| length + 1 == given.variance.len());
        let segments = given.noise.density.len();
        if !fits
            || covariance.shape()[1] != order
            || given.noise.segment.iter().any(|&segment| segment as usize >= segments)
        {
            return Err(PyValueError::new_err(
                "step, variance, covariance, segment, density: lengths do not agree",
            ));
        }
        if !(2..=smoother::MAX_ORDER).contains(&order) {
            return Err(PyValueError::new_err(format!("covariance: expected 2 to 6 rows, got {order}")));
        }
        if derivative >= order {
            return Err(PyValueError::new_err(format!(
                "derivative: expected one below {order}, got {derivative}"
            )));
        }
        for (name, values) in [("step", given.step), ("variance", given.variance)] {
            if let Some(at) = values.iter().position(|&x| x.is_nan() || x <= 0.0) {
                return Err(PyValueError::new_err(format!("{name}[{at}]: expected > 0, got {}", values[at])));
            }
        }
        Ok(Self { order, given })
    }

    fn chain(&self) -> Posterior<'a> {
        match Posterior::new(self.order, self.given) {
            Some(chain) => chain,
            None => unreachable!("the order has been checked"),
        }
    }
}

/// Random deviations of a derivative, (count, n).
#[pyfunction]
pub fn draw_motion<'py>(
    py: Python<'py>,
    chain: Chain<'py>,
    derivative: usize,
    count: usize,
    seed: u64,
) -> PyResult<Array2<'py>> {
    let checked = Checked::new(&chain, derivative)?;
    let width = checked.given.variance.len();
    let drawn = py.detach(|| {
        let mut out = vec![0.0; count * width];
        smoother::draw(&checked.chain(), derivative, seed, &mut out);
        out
    });
    drawn.into_pyarray(py).reshape([count, width])
}

/// Nominal loads, and their groups of links.
struct Loads<'a> {
    instants: &'a [f64],
    loads: &'a [f64],
    groups: Vec<Wrench<'a>>,
}

impl<'a> Loads<'a> {
    fn new(
        scene: &'a PyScene,
        instants: &'a PyReadonlyArray1<'_, f64>,
        loads: &'a PyReadonlyArray3<'_, f64>,
        groups: &[PyReadonlyArray1<'_, i64>],
        centers: &PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let groups = group_loads(&scene.0, groups, rows::<3>(centers, "centers")?, Part::Total)?;
        let instants = slice(instants, "instants")?;
        if loads.shape() != [instants.len(), groups.len(), 6] || !loads.is_c_contiguous() {
            return Err(PyValueError::new_err(format!(
                "loads: expected shape ({}, {}, 6), C-contiguous, got {:?}",
                instants.len(),
                groups.len(),
                loads.shape()
            )));
        }
        let loads = loads.as_slice().map_err(|_| not_contiguous("loads"))?;
        Ok(Self { instants, loads, groups })
    }
}

/// One number for each sample.
fn per_sample<'a>(
    array: &'a PyReadonlyArray1<'_, f64>,
    name: &str,
    checked: &Checked,
) -> PyResult<&'a [f64]> {
    let numbers = slice(array, name)?;
    let expected = checked.given.variance.len();
    if numbers.len() != expected {
        return Err(PyValueError::new_err(format!(
            "{name}: expected {expected} numbers, got {}",
            numbers.len()
        )));
    }
    Ok(numbers)
}

fn not_linear() -> PyErr {
    PyValueError::new_err("scene: expected one whose links are all linear")
}

/// Standard deviations: acceleration (m,), groups (m, groups, 6), sizes (m, groups, 2), links (m, links).
#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)] // named in the stub
pub fn load_spread<'py>(
    py: Python<'py>,
    scene: PyRef<'py, PyScene>,
    chain: Chain<'py>,
    derivative: usize,
    unit: PyReadonlyArray1<'py, f64>,
    time: PyReadonlyArray1<'py, f64>,
    instants: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray3<'py, f64>,
    groups: Vec<PyReadonlyArray1<'py, i64>>,
    centers: PyReadonlyArray2<'py, f64>,
) -> PyResult<(Array1<'py>, Array3<'py>, Array3<'py>, Array2<'py>)> {
    let checked = Checked::new(&chain, derivative)?;
    let (time, unit) = (per_sample(&time, "time", &checked)?, per_sample(&unit, "unit", &checked)?);
    let Loads { instants, loads, groups } = Loads::new(&scene, &instants, &loads, &groups, &centers)?;
    let system = &scene.0;
    let (count, links) = (instants.len(), system.links().len());
    let (mut acceleration, mut of_groups) = (vec![0.0; count], vec![0.0; loads.len()]);
    let (mut sizes, mut of_links) = (vec![0.0; loads.len() / 3], vec![0.0; count * links]);
    py.detach(|| {
        let chain = checked.chain();
        let deviation = Deviation { posterior: &chain, time, derivative, unit };
        let mut out = StandardDeviations {
            acceleration: &mut acceleration,
            groups: &mut of_groups,
            sizes: &mut sizes,
            links: &mut of_links,
        };
        bands::standard_deviations(system, deviation, instants, &groups, loads, &mut out)
    })
    .ok_or_else(not_linear)?;
    Ok((
        acceleration.into_pyarray(py),
        of_groups.into_pyarray(py).reshape([count, groups.len(), 6])?,
        sizes.into_pyarray(py).reshape([count, groups.len(), 2])?,
        of_links.into_pyarray(py).reshape([count, links])?,
    ))
}

/// Random largest y-z resultants, (groups, count).
#[pyfunction]
#[allow(clippy::too_many_arguments)] // named in the stub
pub fn draw_peaks<'py>(
    py: Python<'py>,
    scene: PyRef<'py, PyScene>,
    chain: Chain<'py>,
    derivative: usize,
    unit: PyReadonlyArray1<'py, f64>,
    time: PyReadonlyArray1<'py, f64>,
    instants: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray3<'py, f64>,
    wanted: PyReadonlyArray2<'py, bool>,
    groups: Vec<PyReadonlyArray1<'py, i64>>,
    centers: PyReadonlyArray2<'py, f64>,
    count: usize,
    seed: u64,
    threads: usize,
) -> PyResult<Array2<'py>> {
    let checked = Checked::new(&chain, derivative)?;
    let (time, unit) = (per_sample(&time, "time", &checked)?, per_sample(&unit, "unit", &checked)?);
    let Loads { instants, loads, groups } = Loads::new(&scene, &instants, &loads, &groups, &centers)?;
    if wanted.shape() != [instants.len(), groups.len()] || !wanted.is_c_contiguous() {
        return Err(PyValueError::new_err("wanted: expected shape (instants, groups), C-contiguous"));
    }
    let wanted = wanted.as_slice().map_err(|_| not_contiguous("wanted"))?;
    let system = &scene.0;
    let mut out = vec![0.0; count * groups.len()];
    py.detach(|| {
        let chain = checked.chain();
        let deviation = Deviation { posterior: &chain, time, derivative, unit };
        let nominal = NominalLoads { instants, loads, wanted };
        bands::draw_peaks(system, deviation, nominal, &groups, seed, threads, &mut out)
    })
    .ok_or_else(not_linear)?;
    out.into_pyarray(py).reshape([groups.len(), count])
}
