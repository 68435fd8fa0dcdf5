//! Credible bands of loads, and random motions and peaks, over arrays.

use std::sync::Arc;

use guideload::bands::{self, Deviation, NominalLoads, StandardDeviations};
use guideload::batch::MotionDraws;
use guideload::smoother::{self, Posterior, PosteriorInput};
use guideload::{Part, Stopped, Watch, Wrench};
use numpy::{
    IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::chain::{Chain, OscillatorOfModel};
use crate::convert::{
    Array1, Array2, List, check_ascending, check_finite, check_results, filled, numbers, zeros,
};
use crate::interrupt::try_compute;
use crate::links::group_loads;
use crate::scene::PyScene;

type Array3<'py> = Bound<'py, PyArray3<f64>>;

/// The arrays of a chain: step, variance, covariance, segment, density, oscillator.
type ChainArrays<'py> = (
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, f64>,
    OscillatorOfModel,
);

/// Checked copies of the arrays of a chain.
fn checked(
    (step, variance, covariance, segment, density, oscillator): &ChainArrays<'_>,
    derivative: usize,
) -> PyResult<Chain> {
    let chain = Chain::new(step, variance, covariance, segment, density, *oscillator)?;
    let order = chain.order;
    if derivative >= order {
        return Err(PyValueError::new_err(format!(
            "derivative: expected one below {order}, got {derivative}"
        )));
    }
    Ok(chain)
}

fn posterior<'a>(chain: &'a Chain, watch: Watch<'a>) -> Result<Posterior<'a>, Stopped> {
    let Chain { step, variance, covariance, .. } = chain;
    let given = PosteriorInput { step, variance, covariance, noise: chain.noise(), watch };
    match Posterior::new(chain.order, given)? {
        Some(posterior) => Ok(posterior),
        None => unreachable!("the order has been checked"),
    }
}

/// Random deviations of a derivative, (count, n).
#[pyfunction]
pub fn draw_motion<'py>(
    py: Python<'py>,
    chain: ChainArrays<'py>,
    derivative: usize,
    count: usize,
    seed: u64,
) -> PyResult<Array2<'py>> {
    let model = checked(&chain, derivative)?;
    filled(py, &[count, model.variance.len()], |out| {
        try_compute(py, |watch| Ok(smoother::draw(&posterior(&model, watch)?, derivative, seed, out)?))?;
        check_results(&[out])
    })
}

/// Draws of the motion for the samples of a batch.
#[pyclass(name = "MotionDraws", module = "guideload._core", frozen)]
pub struct PyMotionDraws(pub Arc<MotionDraws>);

#[pymethods]
impl PyMotionDraws {
    #[new]
    fn new(
        py: Python<'_>,
        chain: ChainArrays<'_>,
        derivative: usize,
        unit: PyReadonlyArray1<'_, f64>,
        stamps: PyReadonlyArray1<'_, f64>,
        time: PyReadonlyArray1<'_, f64>,
        seed: u64,
    ) -> PyResult<Self> {
        let model = checked(&chain, derivative)?;
        let (stamps, unit) = (per_sample(&stamps, "stamps", &model)?, per_sample(&unit, "unit", &model)?);
        check_ascending(&stamps, "stamps")?;
        let time = numbers(&time, "time")?;
        check_finite(&time, "time")?;
        let draws = try_compute(py, |watch| {
            Ok(MotionDraws::new(&posterior(&model, watch)?, (derivative, &unit), &stamps, &time, seed)?)
        })?;
        Ok(Self(Arc::new(draws)))
    }

    /// The deviation of a draw at the samples of the motion (n,).
    fn deviation<'py>(&self, py: Python<'py>, number: u64) -> PyResult<Array1<'py>> {
        let deviation = self.0.deviation(number);
        check_results(&[&deviation])?;
        Ok(deviation.into_pyarray(py))
    }
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
        let groups = group_loads(&scene.0, groups, centers, Part::Total)?;
        let instants = numbers(instants, "instants")?;
        check_ascending(&instants, "instants")?;
        if loads.shape() != [instants.len(), groups.len(), 6] || !loads.is_c_contiguous() {
            return Err(PyValueError::new_err(format!(
                "loads: expected shape ({}, {}, 6), C-contiguous, got {:?}",
                instants.len(),
                groups.len(),
                loads.shape()
            )));
        }
        let loads = numbers(loads, "loads")?;
        check_finite(&loads, "loads")?;
        Ok(Self { instants, loads, groups })
    }
}

/// One number for each sample.
fn per_sample(array: &PyReadonlyArray1<'_, f64>, name: &str, model: &Chain) -> PyResult<Vec<f64>> {
    let expected = model.variance.len();
    if array.len() != expected {
        return Err(PyValueError::new_err(format!(
            "{name}: expected {expected} numbers, got {}",
            array.len()
        )));
    }
    let numbers = numbers(array, name)?;
    check_finite(&numbers, name)?;
    Ok(numbers)
}

fn not_linear() -> PyErr {
    PyValueError::new_err("scene: expected one whose links are all linear")
}

/// Standard deviations: acceleration (m,), groups (m, groups, 6), sizes (m, groups, 2), links (m, links).
#[pyfunction]
#[pyo3(signature = (scene, chain, derivative, unit, time, instants, loads, groups, centers, *, quasi_static=false))]
#[allow(clippy::too_many_arguments, clippy::type_complexity)] // named in the stub
pub fn load_spread<'py>(
    py: Python<'py>,
    scene: PyRef<'py, PyScene>,
    chain: ChainArrays<'py>,
    derivative: usize,
    unit: PyReadonlyArray1<'py, f64>,
    time: PyReadonlyArray1<'py, f64>,
    instants: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray3<'py, f64>,
    groups: List<PyReadonlyArray1<'py, i64>>,
    centers: PyReadonlyArray2<'py, f64>,
    quasi_static: bool,
) -> PyResult<(Array1<'py>, Array3<'py>, Array3<'py>, Array2<'py>)> {
    let model = checked(&chain, derivative)?;
    let (time, unit) = (per_sample(&time, "time", &model)?, per_sample(&unit, "unit", &model)?);
    check_ascending(&time, "time")?;
    let Loads { instants, loads, groups } = Loads::new(&scene, &instants, &loads, &groups.0, &centers)?;
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
        try_compute(py, |watch| {
            let chain = posterior(&model, watch)?;
            let deviation =
                Deviation { posterior: &chain, time: &time, derivative, unit: &unit, quasi_static };
            Ok(bands::standard_deviations(system, deviation, &instants, &groups, &loads, &mut out)?)
        })?
        .ok_or_else(not_linear)?;
        check_results(&[out.acceleration, out.groups, out.sizes, out.links])?;
    }
    Ok((acceleration, of_groups, sizes, of_links))
}

/// Random largest y-z resultants, (groups, count).
#[pyfunction]
#[pyo3(signature = (scene, chain, derivative, unit, time, instants, loads, wanted, groups, centers, count, seed, threads, *, quasi_static=false))]
#[allow(clippy::too_many_arguments)] // named in the stub
pub fn draw_peaks<'py>(
    py: Python<'py>,
    scene: PyRef<'py, PyScene>,
    chain: ChainArrays<'py>,
    derivative: usize,
    unit: PyReadonlyArray1<'py, f64>,
    time: PyReadonlyArray1<'py, f64>,
    instants: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray3<'py, f64>,
    wanted: PyReadonlyArray2<'py, bool>,
    groups: List<PyReadonlyArray1<'py, i64>>,
    centers: PyReadonlyArray2<'py, f64>,
    count: usize,
    seed: u64,
    threads: usize,
    quasi_static: bool,
) -> PyResult<Array2<'py>> {
    let model = checked(&chain, derivative)?;
    let (time, unit) = (per_sample(&time, "time", &model)?, per_sample(&unit, "unit", &model)?);
    check_ascending(&time, "time")?;
    let Loads { instants, loads, groups } = Loads::new(&scene, &instants, &loads, &groups.0, &centers)?;
    if wanted.shape() != [instants.len(), groups.len()] || !wanted.is_c_contiguous() {
        return Err(PyValueError::new_err("wanted: expected shape (instants, groups), C-contiguous"));
    }
    let wanted = numbers(&wanted, "wanted")?;
    let system = &scene.0;
    filled(py, &[groups.len(), count], |out| {
        try_compute(py, |watch| {
            let chain = posterior(&model, watch)?;
            let deviation =
                Deviation { posterior: &chain, time: &time, derivative, unit: &unit, quasi_static };
            let nominal = NominalLoads { instants: &instants, loads: &loads, wanted: &wanted };
            Ok(bands::draw_peaks(system, deviation, nominal, &groups, seed, threads, out)?)
        })?
        .ok_or_else(not_linear)?;
        check_results(&[out])
    })
}
