//! Conversion of NumPy arrays and names.

use core::ops::Range;
use std::sync::OnceLock;

use guideload::{
    Control, Dof, Excitation, ExcitationError, Free, Output, Part, Start, Stopped, repeated_lengths,
};
use nalgebra::{Matrix3, Vector3};
use numpy::ndarray::Dimension;
use numpy::{
    Element, PyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray, PyReadonlyArray1,
    PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::Borrowed;
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};

use crate::error::{CoreError, exceptions};

/// A NumPy array with one axis.
pub type Array1<'py> = Bound<'py, PyArray1<f64>>;
/// A NumPy array with two axes.
pub type Array2<'py> = Bound<'py, PyArray2<f64>>;

/// A start by its name, or a state: position and velocity of L in the travelling frame, (2, 6).
#[derive(FromPyObject)]
pub enum StartState<'py> {
    Named(String),
    At(PyReadonlyArray2<'py, f64>),
}

impl StartState<'_> {
    pub fn rest() -> Self {
        Self::Named("rest".into())
    }

    pub fn start(&self) -> PyResult<Start> {
        match self {
            Self::Named(name) => start(name),
            Self::At(state) => match rows::<6>(state, "start")?[..] {
                [position, velocity] => {
                    Ok(Start::State { position: position.into(), velocity: velocity.into() })
                }
                ref other => Err(PyValueError::new_err(format!(
                    "start: expected position and velocity, shape (2, 6), got {} rows",
                    other.len()
                ))),
            },
        }
    }
}

/// The start of that name.
pub fn start(name: &str) -> PyResult<Start> {
    match name {
        "rest" => Ok(Start::AtRest),
        "quasi-static" => Ok(Start::QuasiStatic),
        _ => Err(PyValueError::new_err(format!("start: expected rest or quasi-static, got {name:?}"))),
    }
}

/// A copy of `array`, because other threads of Python may write to it while the interpreter is released; `name` appears in the error.
pub fn numbers<T: Element + Copy, D: Dimension>(
    array: &PyReadonlyArray<'_, T, D>,
    name: &str,
) -> PyResult<Vec<T>> {
    // `as_slice` alone would accept arrays in column order and take their columns for rows.
    if !array.is_c_contiguous() {
        return Err(not_contiguous(name));
    }
    let numbers = array.as_slice().map_err(|_| not_contiguous(name))?;
    let mut copy = room(numbers.len())?;
    copy.extend_from_slice(numbers);
    Ok(copy)
}

/// A copy of `array` as rows of `N` numbers; `name` appears in the error.
pub fn rows<const N: usize>(array: &PyReadonlyArray2<'_, f64>, name: &str) -> PyResult<Vec<[f64; N]>> {
    let shape = array.shape();
    if shape[1] != N {
        let message = format!("{name}: expected shape (n, {N}), got ({}, {})", shape[0], shape[1]);
        return Err(PyValueError::new_err(message));
    }
    if !array.is_c_contiguous() {
        return Err(not_contiguous(name));
    }
    let flat = array.as_slice().map_err(|_| not_contiguous(name))?;
    let mut copy = room(shape[0])?;
    copy.extend_from_slice(flat.as_chunks::<N>().0);
    Ok(copy)
}

/// An empty vector with room for `count` entries.
pub fn room<T>(count: usize) -> PyResult<Vec<T>> {
    let mut all = Vec::new();
    match all.try_reserve_exact(count) {
        Ok(()) => Ok(all),
        Err(_) => {
            Err(CoreError::from(Stopped::Memory { bytes: count.saturating_mul(size_of::<T>()) }).into())
        }
    }
}

/// A new array, made by `zeros` or `empty` of NumPy; their MemoryError says how much memory is missing.
fn new<'py, D: Dimension>(
    py: Python<'py>,
    by: &str,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    let made = py.import("numpy")?.call_method1(by, (PyTuple::new(py, shape)?,));
    let array = made.map_err(|error| {
        // The bytes of the array do not fit into 64 bits.
        let too_large = error.is_instance_of::<PyValueError>(py);
        if too_large { PyMemoryError::new_err(error.value(py).to_string()) } else { error }
    })?;
    Ok(array.cast_into()?)
}

/// A new array of zeros, or MemoryError.
pub fn zeros<'py, D: Dimension>(py: Python<'py>, shape: &[usize]) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    new(py, "zeros", shape)
}

/// A new array of zeros, into which `fill` writes.
pub fn filled<'py, D: Dimension>(
    py: Python<'py>,
    shape: &[usize],
    fill: impl FnOnce(&mut [f64]) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    written(zeros(py, shape)?, fill)
}

/// A new array. `write` must write every number or fail: the memory is not zeroed first, which saves a third of the time of large arrays.
pub fn overwritten<'py, D: Dimension>(
    py: Python<'py>,
    shape: &[usize],
    write: impl FnOnce(&mut [f64]) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    written(new(py, "empty", shape)?, write)
}

fn written<'py, D: Dimension>(
    array: Bound<'py, PyArray<f64, D>>,
    write: impl FnOnce(&mut [f64]) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    write(array.readwrite().as_slice_mut()?)?;
    Ok(array)
}

/// An error that names the first of the numbers that is not as `expected`, which `holds` tells.
pub fn check(numbers: &[f64], name: &str, expected: &str, holds: impl Fn(f64) -> bool) -> PyResult<()> {
    // Without an early end, so that it becomes vector code.
    if numbers.iter().fold(true, |all, &x| all & holds(x)) {
        return Ok(());
    }
    let at = numbers.iter().position(|&x| !holds(x)).unwrap_or(0);
    Err(PyValueError::new_err(format!("{name}[{at}]: expected {expected}, got {}", numbers[at])))
}

pub fn check_finite(numbers: &[f64], name: &str) -> PyResult<()> {
    check(numbers, name, "a finite number", f64::is_finite)
}

/// `numbers`, of which no one is less than the one before.
pub fn check_ascending(numbers: &[f64], name: &str) -> PyResult<()> {
    check_finite(numbers, name)?;
    match numbers.windows(2).position(|pair| pair[1] < pair[0]) {
        None => Ok(()),
        Some(at) => Err(PyValueError::new_err(format!(
            "{name}[{}]: expected >= {} (the one before), got {}",
            at + 1,
            numbers[at],
            numbers[at + 1]
        ))),
    }
}

/// An error if a result has left the range of numbers.
pub fn check_results(results: &[&[f64]]) -> PyResult<()> {
    let finite = |result: &&[f64]| result.iter().fold(true, |all, x| all & x.is_finite());
    if results.iter().all(finite) {
        return Ok(());
    }
    Err(exceptions::RunError::new_err(
        "the result is beyond the range of numbers: check the units of step, value, variance, covariance, density and unit",
    ))
}

/// The entries of a sequence. Unlike `Vec` it does not believe what the sequence says of its length.
pub struct List<T>(pub Vec<T>);

/// Most entries of a list.
const MOST_ENTRIES: usize = 1_000_000;

impl<'py, T: FromPyObjectOwned<'py>> FromPyObject<'_, 'py> for List<T> {
    type Error = PyErr;

    fn extract(list: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if list.is_instance_of::<PyString>() {
            return Err(PyTypeError::new_err("expected a list, got one text"));
        }
        let mut all = Vec::new();
        for entry in list.try_iter()? {
            if all.len() == MOST_ENTRIES {
                return Err(PyValueError::new_err(format!(
                    "expected a list of up to {MOST_ENTRIES} entries"
                )));
            }
            all.push(entry?.extract().map_err(Into::into)?);
        }
        Ok(Self(all))
    }
}

/// The samples of an excitation.
pub struct Samples {
    pub time: Vec<f64>,
    pub acceleration: Vec<[f64; 3]>,
    pub wrench: Option<Vec<[f64; 6]>>,
    /// Of the intervals, where they recur; see [`repeated_lengths`].
    lengths: OnceLock<Vec<f64>>,
}

impl Samples {
    pub fn new(
        time: &PyReadonlyArray1<'_, f64>,
        acceleration: &PyReadonlyArray2<'_, f64>,
        wrench: Option<&PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Self> {
        Ok(Self {
            time: numbers(time, "time")?,
            lengths: OnceLock::new(),
            acceleration: rows(acceleration, "acceleration")?,
            wrench: wrench.map(|wrench| rows(wrench, "wrench")).transpose()?,
        })
    }

    pub fn excitation(&self) -> Result<Excitation<'_>, CoreError> {
        self.excitation_of(0..self.time.len())
    }

    /// The excitation of some samples.
    pub fn excitation_of(&self, part: Range<usize>) -> Result<Excitation<'_>, CoreError> {
        let length = self.acceleration.len();
        let wrench = self.wrench.as_ref().map(|wrench| &wrench[..]);
        if part == (0..self.time.len()) {
            let excitation = Excitation::new(&self.time, &self.acceleration, wrench)?;
            return Ok(excitation.with_repeated_lengths(|| self.lengths()));
        }
        if part.end > usize::min(self.time.len(), length)
            || wrench.is_some_and(|wrench| wrench.len() < part.end)
        {
            let (field, expected, got) = ("acceleration", self.time.len(), length);
            return Err(ExcitationError::Length { field, expected, got }.into());
        }
        let wrench = wrench.map(|wrench| &wrench[part.clone()]);
        let excitation = Excitation::new(&self.time[part.clone()], &self.acceleration[part.clone()], wrench)?;
        let intervals = part.start..part.end.saturating_sub(1);
        Ok(excitation.with_repeated_lengths(|| self.lengths().get(intervals).unwrap_or_default()))
    }

    fn lengths(&self) -> &[f64] {
        self.lengths.get_or_init(|| repeated_lengths(&self.time).unwrap_or_default())
    }
}

pub fn not_contiguous(name: &str) -> PyErr {
    PyValueError::new_err(format!("{name}: expected a C-contiguous array; use numpy.ascontiguousarray"))
}

/// A 6 x 6 matrix from its rows.
pub fn matrix6(rows: [[f64; 6]; 6]) -> nalgebra::Matrix6<f64> {
    nalgebra::Matrix6::from_fn(|i, j| rows[i][j])
}

pub fn matrix3([a, b, c]: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_rows(&[
        Vector3::from(a).transpose(),
        Vector3::from(b).transpose(),
        Vector3::from(c).transpose(),
    ])
}

pub fn free(names: &[String]) -> PyResult<Free> {
    let mut dofs = Vec::with_capacity(names.len());
    for name in names {
        dofs.push(Dof::from_name(name).ok_or_else(|| {
            PyValueError::new_err(format!("free: expected names out of x y z rx ry rz, got {name:?}"))
        })?);
    }
    Ok(Free::only(&dofs))
}

pub fn part(name: &str) -> PyResult<Part> {
    match name {
        "total" => Ok(Part::Total),
        "elastic" => Ok(Part::Elastic),
        "damping" => Ok(Part::Damping),
        _ => Err(PyValueError::new_err(format!("part: expected total, elastic or damping, got {name:?}"))),
    }
}

pub fn control(rtol: f64, step: Option<f64>) -> Control {
    step.map_or(Control::Adaptive { rtol }, |step| Control::Fixed { step })
}

pub fn output(times: Option<&[f64]>) -> Output<'_> {
    times.map_or(Output::Samples, Output::Times)
}
