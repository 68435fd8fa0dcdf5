//! Payloads: masses that the body carries for parts of the motion, and the windows of the motion between their changes.

use core::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::error::BatchError;
use super::requirements::Requirements;
use crate::excitation::Excitation;
use crate::model::Body;
use crate::numeric::tensor::parallel_axes;

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

/// Bodies that move as one.
pub(super) fn united(bodies: impl Iterator<Item = Body> + Clone) -> Result<Body, crate::SceneError> {
    let mass = bodies.clone().map(|body| body.mass()).sum();
    let moment: Vector3<f64> = bodies.clone().map(|body| body.center_of_mass() * body.mass()).sum();
    let center = moment / mass;
    let about = |body: Body| parallel_axes(&body.inertia(), body.mass(), &(body.center_of_mass() - center));
    Body::new(mass, center, bodies.map(about).sum())
}

/// A part of the motion with the same payloads throughout.
#[derive(Debug, Clone)]
pub(super) struct Window<'a> {
    pub excitation: Excitation<'a>,
    /// Largest magnitude of each component.
    pub peak: [f64; 9],
    /// Index of its first sample in the motion.
    pub first: usize,
    /// The payloads on the body, and those of them that it carried before too.
    pub payloads: Vec<usize>,
    pub kept: Vec<usize>,
    /// Requirements with the weights of its samples.
    pub requirements: Requirements,
}

/// The windows of a motion.
pub(super) fn windows<'a>(
    excitation: &Excitation<'a>,
    payloads: &[Payload],
    requirements: Requirements,
) -> Result<Vec<Window<'a>>, BatchError> {
    let count = excitation.count();
    let mut bounds = vec![0, count];
    for (payload, stay) in
        payloads.iter().enumerate().flat_map(|(i, one)| one.stays.iter().map(move |s| (i, s)))
    {
        let changes_at = |k: usize| k == 0 || k == count || excitation.time(k - 1) == excitation.time(k);
        if stay.is_empty() || stay.end > count || !changes_at(stay.start) || !changes_at(stay.end) {
            return Err(BatchError::Payload { payload, stay: [stay.start, stay.end], count });
        }
        bounds.extend([stay.start, stay.end]);
    }
    bounds.sort_unstable();
    bounds.dedup();
    let mut windows: Vec<Window> = Vec::with_capacity(bounds.len() - 1);
    for part in bounds.windows(2).map(|pair| pair[0]..pair[1]) {
        let is_on = |payload: &usize| payloads[*payload].stays.iter().any(|stay| stay.contains(&part.start));
        let on: Vec<usize> = (0..payloads.len()).filter(is_on).collect();
        let before = windows.last().map_or(&[][..], |window| &window.payloads);
        let kept = on.iter().copied().filter(|payload| before.contains(payload)).collect();
        let excitation = excitation.part(part.clone());
        let requirements = requirements.part(&part, count);
        let peak = excitation.peak();
        windows.push(Window { peak, excitation, first: part.start, payloads: on, kept, requirements });
    }
    Ok(windows)
}
