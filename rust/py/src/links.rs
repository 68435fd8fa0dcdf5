//! Links and groups of links from arrays.

use guideload::{Axes, Link, Part, System, Wrench, group_load_along};
use nalgebra::Vector3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

use crate::convert::{numbers, rows};
use crate::error::CoreError;
use crate::law::PyLaw;

/// The links of a scene, one per row of the arrays.
pub fn links(
    points: &PyReadonlyArray2<'_, f64>,
    directions: &PyReadonlyArray2<'_, f64>,
    laws: &[PyRef<'_, PyLaw>],
    damping: &PyReadonlyArray1<'_, f64>,
    damping_in_contact: &PyReadonlyArray1<'_, bool>,
    offsets: Option<&PyReadonlyArray1<'_, f64>>,
) -> PyResult<Vec<Link>> {
    let (points, directions) = (rows::<3>(points, "points")?, rows::<3>(directions, "directions")?);
    let damping = numbers(damping, "damping")?;
    let damping_in_contact = numbers(damping_in_contact, "damping_in_contact")?;
    let offsets = match offsets {
        Some(offsets) => numbers(offsets, "offsets")?,
        None => vec![0.0; points.len()],
    };
    for (name, length) in [
        ("directions", directions.len()),
        ("laws", laws.len()),
        ("damping", damping.len()),
        ("damping_in_contact", damping_in_contact.len()),
        ("offsets", offsets.len()),
    ] {
        if length != points.len() {
            let message = format!("{name}: expected {}, one per link, got {length}", points.len());
            return Err(PyValueError::new_err(message));
        }
    }
    let mut links = Vec::with_capacity(points.len());
    for i in 0..points.len() {
        let link = Link::with_law(points[i].into(), directions[i].into(), laws[i].0, damping[i]);
        let link = if damping_in_contact[i] { link.and_then(Link::damped_in_contact) } else { link };
        let link = link.and_then(|link| link.with_offset(offsets[i]));
        links.push(link.map_err(|error| CoreError::Link(i, error))?);
    }
    Ok(links)
}

/// A group: the indices of its links, its centre and its axes.
type GroupLinks = (Vec<usize>, Vector3<f64>, Axes);

/// Centres and axes of groups, from rows of x, y, z and, where axes are turned, their roll angle.
fn places(centers: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 4]>> {
    if centers.shape()[1] == 4 {
        return rows::<4>(centers, "centers");
    }
    Ok(rows::<3>(centers, "centers")?.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect())
}

/// The links, out of `count`, the centre and the axes of each group.
pub fn group_links(
    count: usize,
    groups: &[PyReadonlyArray1<'_, i64>],
    centers: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<GroupLinks>> {
    let centers = places(centers)?;
    if groups.len() != centers.len() {
        let message =
            format!("centers: expected {} rows, one per group, got {}", groups.len(), centers.len());
        return Err(PyValueError::new_err(message));
    }
    if !centers.as_flattened().iter().all(|x| x.is_finite()) {
        return Err(PyValueError::new_err("centers: expected finite numbers"));
    }
    let mut all = Vec::with_capacity(groups.len());
    for (group, [x, y, z, roll]) in groups.iter().zip(centers) {
        let mut links = Vec::new();
        for index in numbers(group, "groups")? {
            let link = usize::try_from(index).ok().filter(|&link| link < count);
            links.push(link.ok_or_else(|| {
                PyIndexError::new_err(format!("groups: there is no link {index} of {count}"))
            })?);
        }
        let axes = if roll == 0.0 { Axes::MACHINE } else { Axes::rolled(roll) };
        all.push((links, Vector3::new(x, y, z), axes));
    }
    Ok(all)
}

/// The load of each group of links about its centre, in its axes.
pub fn group_loads<'a>(
    system: &'a System,
    groups: &[PyReadonlyArray1<'_, i64>],
    centers: &PyReadonlyArray2<'_, f64>,
    part: Part,
) -> PyResult<Vec<Wrench<'a>>> {
    Ok(group_links(system.links().len(), groups, centers)?
        .into_iter()
        .map(|(links, center, axes)| group_load_along(system, links, center, axes, part))
        .collect())
}
