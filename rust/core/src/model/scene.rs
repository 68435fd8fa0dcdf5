//! A scene: one body on its links, under gravity, with its free degrees of freedom. Immutable.

use nalgebra::{Matrix6, SymmetricEigen, Vector3};

use super::body::Body;
use super::dof::Free;
use super::link::Link;
use crate::error::SceneError;
use crate::numeric::float::sqrt;

/// A checked scene: body, links, gravity, free degrees of freedom.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    body: Body,
    links: &'a [Link],
    gravity: Vector3<f64>,
    free: Free,
    base_compliance: Option<Matrix6<f64>>,
}

impl<'a> Scene<'a> {
    /// A `body` on `links` under `gravity` (m/s², pointing down) with the degrees of freedom `free`.
    ///
    /// # Errors
    /// [`SceneError`] if nothing is free, there is no link, or gravity is not finite.
    pub fn new(body: Body, links: &'a [Link], gravity: Vector3<f64>, free: Free) -> Result<Self, SceneError> {
        if free.count() == 0 {
            return Err(SceneError::NothingFree);
        }
        if links.is_empty() {
            return Err(SceneError::NoLinks);
        }
        if !gravity.iter().all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite { field: "gravity" });
        }
        Ok(Self { body, links, gravity, free, base_compliance: None })
    }

    /// The scene on an elastic base under all links, which gives way by `compliance` times the sum of the link loads: a displacement of L
    /// and a rotation, per force and moment about L (m/N, 1/N, rad/(N m)).
    ///
    /// # Errors
    /// [`SceneError::NotFinite`]; [`SceneError::BaseCompliance`] unless it is symmetric and positive semidefinite;
    /// [`SceneError::NonlinearOnBase`].
    pub fn on_base(self, compliance: Matrix6<f64>) -> Result<Self, SceneError> {
        if !compliance.iter().all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite { field: "base compliance" });
        }
        let smallest = smallest_part(&compliance);
        if smallest < -COMPLIANCE_TOLERANCE {
            return Err(SceneError::BaseCompliance { smallest });
        }
        if let Some(link) = self.links.iter().position(|link| !link.law().is_linear()) {
            return Err(SceneError::NonlinearOnBase { link, law: self.links[link].law().kind() });
        }
        Ok(Self { base_compliance: Some(compliance), ..self })
    }

    /// Compliance of the base under all links, if it is elastic.
    pub fn base_compliance(&self) -> Option<&Matrix6<f64>> {
        self.base_compliance.as_ref()
    }

    /// The body.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The links.
    pub fn links(&self) -> &'a [Link] {
        self.links
    }

    /// Gravity, m/s², pointing down.
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// The free degrees of freedom.
    pub fn free(&self) -> Free {
        self.free
    }
}

/// Rounding of a compliance matrix from a finite element program, relative to its diagonal.
const COMPLIANCE_TOLERANCE: f64 = 1e-6;

/// Smallest eigenvalue of a matrix scaled to a diagonal of ones, less its largest asymmetry.
fn smallest_part(compliance: &Matrix6<f64>) -> f64 {
    let largest = compliance.amax();
    let scale = |i: usize| {
        let entry = compliance[(i, i)].abs();
        if entry > 0.0 { 1.0 / sqrt(entry) } else { 1.0 / sqrt(f64::max(largest, f64::MIN_POSITIVE)) }
    };
    let scaled = Matrix6::from_fn(|i, j| scale(i) * compliance[(i, j)] * scale(j));
    let skew = (scaled - scaled.transpose()).amax();
    SymmetricEigen::new((scaled + scaled.transpose()) * 0.5).eigenvalues.min() - skew
}
