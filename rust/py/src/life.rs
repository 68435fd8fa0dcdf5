//! Equivalent loads, and integrals of their powers over the travel.

use guideload::{EquivalentLoad, Interval, LoadPower, Preload};
use numpy::{PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array1, Array2, not_contiguous, numbers, rows, zeros};
use crate::interrupt::compute;

/// Intervals between two looks for signals: about a millisecond.
const INTERVALS: usize = 16_384;

/// Weights (2, 5, 2), minor factor, preload in N, and how it acts: "power", "linear", or as rows of balls or rollers, "ball" or "roller".
pub type Rule<'py> = (PyReadonlyArray3<'py, f64>, f64, f64, String);

/// The rule of the equivalent load.
pub fn equivalent_load((weights, minor, preload, formula): &Rule<'_>) -> PyResult<EquivalentLoad> {
    let flat = weights.as_slice().map_err(|_| not_contiguous("weights"))?;
    let (pairs, _) = flat.as_chunks::<2>();
    let [first, second] = pairs.as_chunks::<5>().0 else {
        let shape = weights.shape();
        return Err(PyValueError::new_err(format!("weights: expected shape (2, 5, 2), got {shape:?}")));
    };
    let preload = match formula.as_str() {
        _ if *preload == 0.0 => Preload::None,
        "power" => Preload::Power(*preload),
        "linear" => Preload::Linear(*preload),
        "ball" => Preload::Balls(*preload),
        "roller" => Preload::Rollers(*preload),
        other => {
            return Err(PyValueError::new_err(format!(
                "formula: expected power, linear, ball or roller, got {other:?}"
            )));
        }
    };
    Ok(EquivalentLoad { weights: [*first, *second], minor: *minor, preload })
}

/// Travel and loads at n instants, and by how much the mean loads of the intervals differ from those of lines.
struct Course {
    time: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    loads: Vec<[f64; 6]>,
    bows: Option<Vec<[f64; 6]>>,
}

impl Course {
    fn new(
        [time, velocity, acceleration]: [&PyReadonlyArray1<'_, f64>; 3],
        loads: &PyReadonlyArray2<'_, f64>,
        bows: Option<&PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Self> {
        let course = Self {
            time: numbers(time, "time")?,
            velocity: numbers(velocity, "velocity")?,
            acceleration: numbers(acceleration, "acceleration")?,
            loads: rows::<6>(loads, "loads")?,
            bows: bows.map(|bows| rows::<6>(bows, "bows")).transpose()?,
        };
        let lengths = [course.velocity.len(), course.acceleration.len(), course.loads.len()];
        if lengths.iter().any(|&length| length != course.time.len()) {
            return Err(PyValueError::new_err("time, velocity, acceleration, loads: lengths do not agree"));
        }
        if course.bows.as_ref().is_some_and(|bows| bows.len() != course.intervals()) {
            return Err(PyValueError::new_err("bows: expected one per interval"));
        }
        Ok(course)
    }

    fn intervals(&self) -> usize {
        self.time.len().saturating_sub(1)
    }

    /// The travel between instant k and the next one, and the loads Fy to Mz at both: of the line with the mean of the interval.
    fn interval(&self, k: usize) -> (Interval, [[f64; 5]; 2]) {
        let ends = |of: &[f64]| [of[k], of[k + 1]];
        let travel = Interval {
            length: self.time[k + 1] - self.time[k],
            velocity: ends(&self.velocity),
            acceleration: ends(&self.acceleration),
        };
        let bow = self.bows.as_ref().map_or([0.0; 6], |bows| bows[k]);
        (travel, [k, k + 1].map(|end| core::array::from_fn(|i| self.loads[end][1 + i] + bow[1 + i])))
    }
}

/// Integrals of `P^p |v|` and `|v|` over each interval between n instants, two of (n - 1,). bows: (n - 1, 6), see `group_load_bows`.
#[pyfunction]
#[pyo3(signature = (time, velocity, acceleration, loads, rule, exponent, bows=None))]
#[allow(clippy::too_many_arguments)] // each has a name in Python
pub fn equivalent_load_integrals<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    velocity: PyReadonlyArray1<'py, f64>,
    acceleration: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray2<'py, f64>,
    rule: Rule<'py>,
    exponent: f64,
    bows: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<(Array1<'py>, Array1<'py>)> {
    let course = Course::new([&time, &velocity, &acceleration], &loads, bows.as_ref())?;
    let rule = equivalent_load(&rule)?;
    let count = course.intervals();
    let power_of = load_power(exponent)?;
    let (powers, paths) = (zeros(py, &[count])?, zeros(py, &[count])?);
    {
        let (mut powers, mut paths) = (powers.readwrite(), paths.readwrite());
        let (powers, paths) = (powers.as_slice_mut()?, paths.as_slice_mut()?);
        let rule = rule.rule();
        compute(py, |watch| {
            for (k, (power, path)) in powers.iter_mut().zip(paths).enumerate() {
                if k % INTERVALS == 0 && watch.stops() {
                    return;
                }
                let (travel, [first, last]) = course.interval(k);
                let found = rule.integrals(&power_of, &travel, [&first, &last]);
                (*power, *path) = (found.power, found.path);
            }
        })?;
    }
    Ok((powers, paths))
}

/// The powers of an exponent.
fn load_power(exponent: f64) -> PyResult<LoadPower> {
    LoadPower::new(exponent)
        .ok_or_else(|| PyValueError::new_err(format!("exponent: expected 1 to 100, got {exponent}")))
}

/// Derivatives of the sum of the integrals of `P^p |v|` by the loads at each instant (n, 6).
#[pyfunction]
pub fn equivalent_load_weights<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    velocity: PyReadonlyArray1<'py, f64>,
    acceleration: PyReadonlyArray1<'py, f64>,
    loads: PyReadonlyArray2<'py, f64>,
    rule: Rule<'py>,
    exponent: f64,
) -> PyResult<Array2<'py>> {
    let (rule, course) =
        (equivalent_load(&rule)?, Course::new([&time, &velocity, &acceleration], &loads, None)?);
    load_power(exponent)?;
    let weights = zeros(py, &[course.loads.len(), 6])?;
    {
        let mut weights = weights.readwrite();
        let weights = weights.as_slice_mut()?.as_chunks_mut::<6>().0;
        compute(py, |watch| {
            for k in (0..course.intervals()).take_while(|k| k % INTERVALS != 0 || !watch.stops()) {
                let (travel, [first, last]) = course.interval(k);
                let ends = rule.integral_weights(exponent, &travel, [&first, &last]);
                for (end, of) in ends.iter().enumerate() {
                    for (component, slope) in of.iter().enumerate() {
                        weights[k + end][1 + component] += slope;
                    }
                }
            }
        })?;
    }
    Ok(weights)
}

/// Loads (n,) with the effect of the preload of a rule, from loads without it.
#[pyfunction]
pub fn raised_loads<'py>(
    py: Python<'py>,
    loads: PyReadonlyArray1<'py, f64>,
    rule: Rule<'py>,
) -> PyResult<Array1<'py>> {
    let (rule, loads) = (equivalent_load(&rule)?.rule(), numbers(&loads, "loads")?);
    let raised = zeros(py, &[loads.len()])?;
    for (to, load) in raised.readwrite().as_slice_mut()?.iter_mut().zip(loads) {
        *to = rule.with_preload(load);
    }
    Ok(raised)
}

/// The index of the largest equivalent load, this load, and the largest size of each component (6,).
#[pyfunction]
pub fn largest_equivalent_load<'py>(
    py: Python<'py>,
    loads: PyReadonlyArray2<'py, f64>,
    rule: Rule<'py>,
) -> PyResult<(usize, f64, [f64; 6])> {
    let (rule, loads) = (equivalent_load(&rule)?.rule(), rows::<6>(&loads, "loads")?);
    py.detach(|| {
        let (mut instant, mut peak, mut sizes) = (0, f64::NEG_INFINITY, [0.0; 6]);
        for (k, load) in loads.iter().enumerate() {
            for (size, value) in sizes.iter_mut().zip(load) {
                *size = f64::max(*size, value.abs());
            }
            let [_, rest @ ..] = load;
            let found = rule.combined(rule.weigh(rest).groups);
            if found > peak {
                (instant, peak) = (k, found);
            }
        }
        Ok((instant, rule.with_preload(peak), sizes))
    })
}
