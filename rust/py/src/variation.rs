//! Scenes whose numbers vary, and their derivatives.

use std::sync::Arc;

use guideload::batch::{Base, Change, Group, Instance, NominalBody, Payload, Plan, Target};
use guideload::sensitivity::VariedSystem;
use guideload::{Free, LawParameter, Link, Stopped, System, eigenvalues};
use nalgebra::Matrix6;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{self, Array1, List, filled, matrix3, numbers};
use crate::error::CoreError;
use crate::interrupt::try_compute;
use crate::law::PyLaw;
use crate::links::{group_links, links};
use crate::varied_system::PyVariedSystem;

/// The third part of a target: an axis or a name.
#[derive(FromPyObject)]
enum Place {
    Index(usize),
    Name(String),
}

/// Mass, centre of mass and inertia of a payload, whether the inertia is about L, and the first sample and the one after the last of each
/// stay.
type PayloadArguments = (f64, [f64; 3], [[f64; 3]; 3], bool, List<(usize, usize)>);

/// A target, a constant, and columns with their factors.
type ChangeArguments = ((String, usize, Place), f64, List<(usize, f64)>);

/// The base of changes, with the data that it borrows.
#[derive(Clone)]
pub struct OwnedBase {
    pub body: NominalBody,
    pub gravity: [f64; 3],
    pub free: Free,
    pub base_compliance: Option<Matrix6<f64>>,
    pub links: Vec<Link>,
    pub groups: Vec<Group>,
    pub payloads: Vec<Payload>,
}

impl OwnedBase {
    pub fn base(&self) -> Base<'_> {
        Base {
            body: self.body,
            links: &self.links,
            gravity: self.gravity.into(),
            free: self.free,
            base_compliance: self.base_compliance,
            groups: &self.groups,
            payloads: &self.payloads,
        }
    }
}

fn body(mass: f64, center: [f64; 3], inertia: [[f64; 3]; 3], inertia_about_reference: bool) -> NominalBody {
    let (center_of_mass, inertia) = (center.into(), matrix3(inertia));
    NominalBody { mass, center_of_mass, inertia, inertia_about_reference }
}

fn payload((mass, center, inertia, inertia_about_reference, stays): PayloadArguments) -> Payload {
    let body = body(mass, center, inertia, inertia_about_reference);
    Payload { body, stays: stays.0.into_iter().map(|(from, to)| from..to).collect() }
}

fn change(((name, index, place), constant, terms): ChangeArguments) -> PyResult<Change> {
    let unknown = || PyValueError::new_err(format!("changes: there is no target ({name:?}, {index}, …)"));
    let target = match (name.as_str(), place) {
        ("mass", _) => Target::Mass,
        ("center_of_mass", _) => Target::CenterOfMass(index),
        ("inertia", Place::Index(column)) => Target::Inertia(index, column),
        ("gravity", _) => Target::Gravity(index),
        ("point", Place::Index(axis)) => Target::Point { link: index, axis },
        ("damping", _) => Target::Damping(index),
        ("offset", _) => Target::Offset(index),
        ("law", Place::Name(parameter)) => {
            Target::Law { link: index, parameter: LawParameter::from_name(&parameter).ok_or_else(unknown)? }
        }
        ("center", Place::Index(axis)) => Target::Center { group: index, axis },
        ("payload_mass", _) => Target::PayloadMass(index),
        ("payload_center_of_mass", Place::Index(axis)) => {
            Target::PayloadCenterOfMass { payload: index, axis }
        }
        ("acceleration", _) => Target::Acceleration,
        ("wrench", _) => Target::Wrench,
        _ => return Err(unknown()),
    };
    Ok(Change { target, constant, terms: terms.0 })
}

/// A scene whose numbers vary.
#[pyclass(name = "VariedScene", module = "guideload._core", frozen)]
pub struct PyVariedScene {
    pub base: OwnedBase,
    pub changes: Vec<Change>,
    plan: Plan,
    columns: usize,
}

#[pymethods]
impl PyVariedScene {
    #[new]
    #[pyo3(signature = (*, mass, center_of_mass, inertia, inertia_about_reference, gravity, free, points, directions, laws, damping, damping_in_contact, groups, centers, changes, columns=None, offsets=None, base_compliance=None, payloads=None))]
    #[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
    fn new(
        mass: f64,
        center_of_mass: [f64; 3],
        inertia: [[f64; 3]; 3],
        inertia_about_reference: bool,
        gravity: [f64; 3],
        free: List<String>,
        points: PyReadonlyArray2<'_, f64>,
        directions: PyReadonlyArray2<'_, f64>,
        laws: List<PyRef<'_, PyLaw>>,
        damping: PyReadonlyArray1<'_, f64>,
        damping_in_contact: PyReadonlyArray1<'_, bool>,
        groups: List<PyReadonlyArray1<'_, i64>>,
        centers: PyReadonlyArray2<'_, f64>,
        changes: List<ChangeArguments>,
        columns: Option<usize>,
        offsets: Option<PyReadonlyArray1<'_, f64>>,
        base_compliance: Option<[[f64; 6]; 6]>,
        payloads: Option<List<PayloadArguments>>,
    ) -> PyResult<Self> {
        let links = links(&points, &directions, &laws.0, &damping, &damping_in_contact, offsets.as_ref())?;
        let groups = group_links(links.len(), &groups.0, &centers)?;
        let base = OwnedBase {
            body: body(mass, center_of_mass, inertia, inertia_about_reference),
            gravity,
            free: convert::free(&free.0)?,
            base_compliance: base_compliance.map(convert::matrix6),
            links,
            groups: groups
                .into_iter()
                .map(|(links, center, axes)| Group { axes, ..Group::new(links, center) })
                .collect(),
            payloads: payloads.into_iter().flat_map(|payloads| payloads.0).map(payload).collect(),
        };
        let changes = changes.0.into_iter().map(change).collect::<PyResult<Vec<_>>>()?;
        let plan = Plan::new(&base.base(), &changes).map_err(CoreError::from)?;
        let columns = columns.unwrap_or(plan.columns());
        if plan.columns() > columns {
            let got = plan.columns();
            return Err(PyValueError::new_err(format!(
                "changes: expected at most {columns} columns, got {got}"
            )));
        }
        Ok(Self { base, changes, plan, columns })
    }

    /// Angular frequencies (n,) of the fastest vibration with values (n, columns), without payloads; NaN where there is no scene.
    fn fastest_vibrations<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Array1<'py>> {
        let (count, columns) = (values.shape()[0], values.shape()[1]);
        if columns != self.columns {
            let expected = self.columns;
            return Err(PyValueError::new_err(format!("values: expected {expected} columns, got {columns}")));
        }
        let values = numbers(&values, "values")?;
        filled(py, &[count], |fastest| {
            try_compute(py, |watch| {
                let base = self.base.base();
                let mut instance = Instance::new(&base)?;
                for (i, fastest) in fastest.iter_mut().enumerate() {
                    if watch.stops() {
                        return Err(Stopped::Interrupted.into());
                    }
                    let row = &values[i * columns..(i + 1) * columns];
                    *fastest = fastest_vibration(&base, &self.plan, row, &mut instance).unwrap_or(f64::NAN);
                }
                Ok(())
            })
        })
    }

    /// The system with these values, one for each column, which carries all payloads.
    fn at(&self, values: PyReadonlyArray1<'_, f64>) -> PyResult<PyVariedSystem> {
        let values = numbers(&values, "values")?;
        if values.len() != self.columns {
            let (expected, got) = (self.columns, values.len());
            return Err(PyValueError::new_err(format!("values: expected {expected}, got {got}")));
        }
        let carried: Vec<usize> = (0..self.base.payloads.len()).collect();
        let varied = VariedSystem::new(&self.base.base(), &self.plan, &values, &carried);
        Ok(PyVariedSystem {
            varied: Arc::new(varied.map_err(CoreError::from)?),
            groups: self.base.groups.clone(),
        })
    }
}

/// Angular frequency of the fastest vibration with these values, rad/s.
fn fastest_vibration(base: &Base, plan: &Plan, values: &[f64], instance: &mut Instance) -> Option<f64> {
    plan.apply(base, values, instance).ok()?;
    let system = System::new(&instance.scene().ok()?).ok()?;
    let values = eigenvalues(&system)?;
    Some(values[..2 * system.mode_count()].iter().fold(0.0, |most, value| f64::max(most, value.im.abs())))
}
