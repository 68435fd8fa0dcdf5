//! Instances: the base scene with the values of one sample, by a plan of changes.

use core::ops::Range;

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::change::{Change, Target};
use super::error::{ChangeError, SampleError};
use super::group::Group;
use crate::model::{Body, Free, Link, Scene};
use crate::output::Axes;

/// Mass, centre of mass and inertia of a body without changes.
#[derive(Debug, Clone, Copy)]
pub struct NominalBody {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass from L, m.
    pub center_of_mass: Vector3<f64>,
    /// Inertia, kg m².
    pub inertia: Matrix3<f64>,
    /// Whether the inertia is about L instead of the centre of mass; it remains so if mass and centre of mass change.
    pub inertia_about_reference: bool,
}

impl NominalBody {
    /// The body.
    ///
    /// # Errors
    /// As [`Body::new`].
    pub fn body(&self) -> Result<Body, crate::SceneError> {
        let new = if self.inertia_about_reference { Body::about_reference } else { Body::new };
        new(self.mass, self.center_of_mass, self.inertia)
    }
}

/// A mass that the body grips and releases.
#[derive(Debug, Clone)]
pub struct Payload {
    /// Its numbers.
    pub body: NominalBody,
    /// Samples of the motion at which it is on the body. The sample before each change has the same time, as at a jump.
    pub stays: Vec<Range<usize>>,
}

/// The scene that samples change.
#[derive(Debug, Clone, Copy)]
pub struct Base<'a> {
    /// The body.
    pub body: NominalBody,
    /// The links.
    pub links: &'a [Link],
    /// m/s², pointing down.
    pub gravity: Vector3<f64>,
    /// The free degrees of freedom.
    pub free: Free,
    /// Compliance of an elastic base under all links; see [`Scene::on_base`].
    pub base_compliance: Option<Matrix6<f64>>,
    /// Groups of links (carriages) whose loads are measured.
    pub groups: &'a [Group],
    /// Masses that come and go.
    pub payloads: &'a [Payload],
}

/// The base scene with the values of one sample.
#[derive(Debug, Clone)]
pub struct Instance {
    body: Body,
    payloads: Vec<Body>,
    gravity: Vector3<f64>,
    free: Free,
    base_compliance: Option<Matrix6<f64>>,
    links: Vec<Link>,
    centers: Vec<Vector3<f64>>,
    axes: Vec<Axes>,
    factors: [f64; 2],
}

impl Instance {
    /// The base without changes.
    ///
    /// # Errors
    /// As [`NominalBody::body`] and [`Scene::new`].
    pub fn new(base: &Base) -> Result<Self, crate::SceneError> {
        let instance = Self {
            body: base.body.body()?,
            payloads: base.payloads.iter().map(|payload| payload.body.body()).collect::<Result<_, _>>()?,
            gravity: base.gravity,
            free: base.free,
            base_compliance: base.base_compliance,
            links: base.links.to_vec(),
            centers: base.groups.iter().map(|group| group.center).collect(),
            axes: base.groups.iter().map(|group| group.axes).collect(),
            factors: [1.0; 2],
        };
        instance.scene()?;
        Ok(instance)
    }

    /// The scene, without payloads.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn scene(&self) -> Result<Scene<'_>, crate::SceneError> {
        self.scene_of(self.body)
    }

    /// The scene with another body.
    pub(crate) fn scene_of(&self, body: Body) -> Result<Scene<'_>, crate::SceneError> {
        let scene = Scene::new(body, &self.links, self.gravity, self.free)?;
        self.base_compliance.map_or(Ok(scene), |compliance| scene.on_base(compliance))
    }

    /// The body with some of its payloads.
    pub(crate) fn carrying(&self, payloads: &[usize]) -> Body {
        payloads.iter().fold(self.body, |body, &payload| body.plus(&self.payloads[payload]))
    }

    /// The body, without payloads.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The payloads.
    pub(crate) fn payloads(&self) -> &[Body] {
        &self.payloads
    }

    /// The links.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Whether all links are linear, and on a rigid base.
    pub fn is_linear(&self) -> bool {
        self.base_compliance.is_none() && self.links.iter().all(|link| link.law().is_linear())
    }

    /// Whether links are preloaded, and none has clearance, one side or a curve.
    pub fn is_preloaded(&self) -> bool {
        let mut laws = self.links.iter().map(Link::law).filter(|law| !law.is_linear()).peekable();
        laws.peek().is_some() && laws.all(|law| !law.is_piecewise_linear())
    }

    /// Gravity, m/s².
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// The free degrees of freedom.
    pub fn free(&self) -> Free {
        self.free
    }

    /// Centres of the groups, m from L.
    pub fn centers(&self) -> &[Vector3<f64>] {
        &self.centers
    }

    /// Axes of the loads of the groups.
    pub fn axes(&self) -> &[Axes] {
        &self.axes
    }

    /// Factors on the accelerations of the motion and on its external loads.
    pub fn factors(&self) -> [f64; 2] {
        self.factors
    }
}

/// Changes sorted by target, so that those of one link are adjacent.
#[derive(Debug, Clone)]
pub struct Plan {
    changes: Vec<Change>,
    body: Range<usize>,
    gravity: Range<usize>,
    /// Per changed link: its index, and its changes.
    links: Vec<(usize, Range<usize>)>,
    /// The same of payloads.
    payloads: Vec<(usize, Range<usize>)>,
    /// Centres and factors.
    rest: Range<usize>,
    columns: usize,
}

impl Plan {
    /// Checks and sorts changes of a base.
    ///
    /// # Errors
    /// [`ChangeError`] for a target that the base does not have, or that is changed twice.
    pub fn new(base: &Base, changes: &[Change]) -> Result<Self, ChangeError> {
        let mut changes = changes.to_vec();
        for change in &changes {
            let target = change.target;
            let place = match target {
                Target::Mass | Target::Acceleration | Target::Wrench => true,
                Target::CenterOfMass(axis) | Target::Gravity(axis) => axis < 3,
                Target::Inertia(i, j) => i < 3 && j < 3,
                Target::Point { link, axis } => link < base.links.len() && axis < 3,
                Target::Damping(link) | Target::Offset(link) | Target::Law { link, .. } => {
                    link < base.links.len()
                }
                Target::Center { group, axis } => group < base.groups.len() && axis < 3,
                Target::PayloadMass(payload) => payload < base.payloads.len(),
                Target::PayloadCenterOfMass { payload, axis } => payload < base.payloads.len() && axis < 3,
            };
            if !place {
                return Err(ChangeError::Target { target });
            }
            if !change.constant.is_finite() || !change.terms.iter().all(|(_, factor)| factor.is_finite()) {
                return Err(ChangeError::NotFinite { target });
            }
        }
        changes.sort_by_key(|change| order(change.target));
        if let Some(pair) = changes.windows(2).find(|pair| order(pair[0].target) == order(pair[1].target)) {
            return Err(ChangeError::Repeated { target: pair[1].target });
        }
        let from = |kind: usize| changes.partition_point(|change| order(change.target).0 < kind);
        let ends = [0, 1, 2, 3, 4, 5].map(from);
        let columns = changes.iter().flat_map(|change| &change.terms).map(|(column, _)| column + 1);
        Ok(Self {
            columns: columns.max().unwrap_or(0),
            body: ends[0]..ends[1],
            gravity: ends[1]..ends[2],
            links: by_part(&changes, ends[2]..ends[3]),
            payloads: by_part(&changes, ends[4]..ends[5]),
            rest: ends[3]..ends[4],
            changes,
        })
    }

    /// The changes: those of the body, of gravity, of the links one after the other, of all else, of the payloads.
    pub(crate) fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// Number of columns of values that the changes use.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Applies the changes with the values of a sample to an instance of the base.
    ///
    /// # Errors
    /// Those of [`Body`], [`Link`] and [`Scene`]; the instance is then not valid for this sample, but can be used for the next one.
    pub fn apply(&self, base: &Base, values: &[f64], to: &mut Instance) -> Result<(), SampleError> {
        if !self.body.is_empty() {
            to.body = changed(&base.body, &self.changes[self.body.clone()], values, &to.body)?;
        }
        for (index, range) in &self.payloads {
            let (nominal, payload) = (&base.payloads[*index].body, &mut to.payloads[*index]);
            *payload = changed(nominal, &self.changes[range.clone()], values, payload)
                .map_err(|error| SampleError::Payload(*index, error))?;
        }
        for change in &self.changes[self.gravity.clone()] {
            let Target::Gravity(axis) = change.target else { continue };
            to.gravity[axis] = change.at(values);
        }
        for (index, range) in &self.links {
            let changes = &self.changes[range.clone()];
            set(&base.links[*index], changes, values, &mut to.links[*index])
                .map_err(|error| SampleError::Link(*index, error))?;
        }
        for change in &self.changes[self.rest.clone()] {
            let got = change.at(values);
            if !got.is_finite() {
                return Err(SampleError::NotFinite { target: change.target, got });
            }
            match change.target {
                Target::Center { group, axis } => to.centers[group][axis] = got,
                Target::Acceleration => to.factors[0] = got,
                Target::Wrench => to.factors[1] = got,
                _ => {}
            }
        }
        Ok(to.scene().map(|_| ())?)
    }
}

/// Changes of adjacent parts: the index of each part, and its changes.
fn by_part(changes: &[Change], of: Range<usize>) -> Vec<(usize, Range<usize>)> {
    let mut parts: Vec<(usize, Range<usize>)> = Vec::new();
    for index in of {
        let part = order(changes[index].target).1;
        match parts.last_mut() {
            Some((last, range)) if *last == part => range.end = index + 1,
            _ => parts.push((part, index..index + 1)),
        }
    }
    parts
}

/// A body of a sample; `last`: that of the sample before.
fn changed(
    nominal: &NominalBody,
    changes: &[Change],
    values: &[f64],
    last: &Body,
) -> Result<Body, crate::SceneError> {
    let mut to = *nominal;
    // An inertia about the centre of mass that no change touches has been checked already.
    let mut same = !nominal.inertia_about_reference;
    for change in changes {
        let value = change.at(values);
        match change.target {
            Target::Mass | Target::PayloadMass(_) => to.mass = value,
            Target::CenterOfMass(axis) | Target::PayloadCenterOfMass { axis, .. } => {
                to.center_of_mass[axis] = value;
            }
            Target::Inertia(i, j) => {
                (to.inertia[(i, j)], to.inertia[(j, i)], same) = (value, value, false);
            }
            _ => {}
        }
    }
    if same { last.with_mass(to.mass, to.center_of_mass) } else { to.body() }
}

/// Sort key: kind (body, gravity, links, all else, payloads), then link or payload, then target.
fn order(target: Target) -> (usize, usize, Target) {
    match target {
        // Mirrored entries are one target.
        Target::Inertia(i, j) => (0, 0, Target::Inertia(usize::min(i, j), usize::max(i, j))),
        Target::Mass | Target::CenterOfMass(_) => (0, 0, target),
        Target::Gravity(_) => (1, 0, target),
        Target::Point { link, .. }
        | Target::Damping(link)
        | Target::Offset(link)
        | Target::Law { link, .. } => (2, link, target),
        Target::Center { .. } | Target::Acceleration | Target::Wrench => (3, 0, target),
        Target::PayloadMass(payload) | Target::PayloadCenterOfMass { payload, .. } => (4, payload, target),
    }
}

/// Changes a link of the base.
fn set(base: &Link, changes: &[Change], values: &[f64], to: &mut Link) -> Result<(), crate::SceneError> {
    let (mut point, mut damping, mut offset, mut law) = (base.point(), base.damping(), base.offset(), None);
    for change in changes {
        let value = change.at(values);
        match change.target {
            Target::Point { axis, .. } => point[axis] = value,
            Target::Damping(_) => damping = value,
            Target::Offset(_) => offset = value,
            // In the order of `LawParameter`, the factor last.
            Target::Law { parameter, .. } => {
                law = Some(law.as_ref().unwrap_or(base.law()).with(parameter, value)?);
            }
            _ => {}
        }
    }
    to.set(point, law, damping, offset)
}
