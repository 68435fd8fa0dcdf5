//! The extremes of the loads of groups and, after these, of the same loads less constant ones: of those only the largest magnitudes.

use guideload::{Extremes, RunError};
use numpy::PyArray2;
use pyo3::prelude::*;

use crate::convert::CoreError;
use crate::scene::table;

/// The extremes of so many loads before the first instant.
pub fn before(groups: usize, loads: usize) -> Vec<Extremes> {
    (0..loads).map(|load| if load < groups { Extremes::NONE } else { Extremes::ONLY_MAGNITUDES }).collect()
}

/// Smallest, largest, time of smallest, time of largest, each (loads, 8). An error if one is beyond the range of numbers.
pub fn arrays<'py>(
    py: Python<'py>,
    groups: usize,
    extremes: &[Extremes],
) -> PyResult<[Bound<'py, PyArray2<f64>>; 4]> {
    let (of_groups, of_others) = extremes.split_at(groups);
    let magnitudes = of_others.iter().flat_map(|extremes| &extremes.largest[6..]);
    if !of_groups.iter().all(Extremes::is_finite) || !magnitudes.copied().all(f64::is_finite) {
        return Err(CoreError::Run(RunError::OutOfRange).into());
    }
    let table = |pick: fn(&Extremes) -> [f64; 8]| table(py, extremes.iter().map(pick));
    Ok([
        table(|e| e.smallest)?,
        table(|e| e.largest)?,
        table(|e| e.time_of_smallest)?,
        table(|e| e.time_of_largest)?,
    ])
}
