//! Credible bands of loads, and random motions and peaks, over arrays.

use guideload::bands::{self, Deviation, NominalLoads, StandardDeviations};
use guideload::smoother::{self, Posterior, PosteriorInput, ProcessNoise};
use guideload::{Part, Stopped, Watch, Wrench};
use numpy::{
    PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, Array2, CoreError, numbers, rows, zeros};
use crate::interrupt::compute;
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

/// Checked copies of the arrays of a chain.
struct Checked {
    order: usize,
    step: Vec<f64>,
    variance: Vec<f64>,
    covariance: Vec<f64>,
    segment: Vec<u32>,
    density: Vec<f64>,
}

impl Checked {
    fn new((step, variance, covariance, segment, density): &Chain<'_>, derivative: usize) -> PyResult<Self> {
        let order = covariance.shape()[0];
        let given = Self {
            order,
            step: numbers(step, "step")?,
            variance: numbers(variance, "variance")?,
            covariance: numbers(covariance, "covariance")?,
            segment: numbers(segment, "segment")?,
            density: numbers(density, "density")?,
        };
        let intervals = [given.step.len(), given.segment.len()];
        let fits = intervals.iter().all(|length| length + 1 == given.variance.len());
        let segments = given.density.len();
        if !fits
            || covariance.shape()[1] != order
            || given.segment.iter().any(|&segment| segment as usize >= segments)
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
        for (name, values) in [("step", &given.step), ("variance", &given.variance)] {
            if let Some(at) = values.iter().position(|&x| x.is_nan() || x <= 0.0) {
                return Err(PyValueError::new_err(format!("{name}[{at}]: expected > 0, got {}", values[at])));
            }
        }
        Ok(given)
    }

    fn chain<'a>(&'a self, watch: Watch<'a>) -> Result<Posterior<'a>, Stopped> {
        let given = PosteriorInput {
            step: &self.step,
            variance: &self.variance,
            covariance: &self.covariance,
            noise: ProcessNoise { segment: &self.segment, density: &self.density },
            watch,
        };
        match Posterior::new(self.order, given)? {
            Some(chain) => Ok(chain),
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
    let drawn = zeros(py, &[count, checked.variance.len()])?;
    {
        let mut out = drawn.readwrite();
        let out = out.as_slice_mut()?;
        compute(py, |watch| smoother::draw(&checked.chain(watch)?, derivative, seed, out))?
            .map_err(CoreError::from)?;
    }
    Ok(drawn)
}

/// Nominal loads, and their groups of links.
struct Loads<'a> {
    instants: Vec<f64>,
    loads: Vec<f64>,
    groups: Vec<Wrench<'a>>,
}

impl<'a> Loads<'a> {
    fn new(
        scene: &'a PyScene,
        instants: &PyReadonlyArray1<'_, f64>,
        loads: &PyReadonlyArray3<'_, f64>,
        groups: &[PyReadonlyArray1<'_, i64>],
        centers: &PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let groups = group_loads(&scene.0, groups, &rows::<3>(centers, "centers")?, Part::Total)?;
        let instants = numbers(instants, "instants")?;
        if loads.shape() != [instants.len(), groups.len(), 6] || !loads.is_c_contiguous() {
            return Err(PyValueError::new_err(format!(
                "loads: expected shape ({}, {}, 6), C-contiguous, got {:?}",
                instants.len(),
                groups.len(),
                loads.shape()
            )));
        }
        Ok(Self { instants, loads: numbers(loads, "loads")?, groups })
    }
}

/// One number for each sample.
fn per_sample(array: &PyReadonlyArray1<'_, f64>, name: &str, checked: &Checked) -> PyResult<Vec<f64>> {
    let expected = checked.variance.len();
    if array.len() != expected {
        return Err(PyValueError::new_err(format!(
            "{name}: expected {expected} numbers, got {}",
            array.len()
        )));
    }
    numbers(array, name)
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
    let width = groups.len();
    let acceleration = zeros(py, &[count])?;
    let (of_groups, sizes) = (zeros(py, &[count, width, 6])?, zeros(py, &[count, width, 2])?);
    let of_links = zeros(py, &[count, links])?;
    {
        let (mut a, mut g) = (acceleration.readwrite(), of_groups.readwrite());
        let (mut s, mut l) = (sizes.readwrite(), of_links.readwrite());
        let mut out = StandardDeviations {
            acceleration: a.as_slice_mut()?,
            groups: g.as_slice_mut()?,
            sizes: s.as_slice_mut()?,
            links: l.as_slice_mut()?,
        };
        compute(py, |watch| {
            let chain = checked.chain(watch)?;
            let deviation = Deviation { posterior: &chain, time: &time, derivative, unit: &unit };
            bands::standard_deviations(system, deviation, &instants, &groups, &loads, &mut out)
        })?
        .map_err(CoreError::from)?
        .ok_or_else(not_linear)?;
    }
    Ok((acceleration, of_groups, sizes, of_links))
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
    let wanted = numbers(&wanted, "wanted")?;
    let system = &scene.0;
    let peaks = zeros(py, &[groups.len(), count])?;
    {
        let mut out = peaks.readwrite();
        let out = out.as_slice_mut()?;
        compute(py, |watch| {
            let chain = checked.chain(watch)?;
            let deviation = Deviation { posterior: &chain, time: &time, derivative, unit: &unit };
            let nominal = NominalLoads { instants: &instants, loads: &loads, wanted: &wanted };
            bands::draw_peaks(system, deviation, nominal, &groups, seed, threads, out)
        })?
        .map_err(CoreError::from)?
        .ok_or_else(not_linear)?;
    }
    Ok(peaks)
}
