//! A scene: one body on its links, under gravity, with its free degrees of freedom. Immutable.

use nalgebra::Vector3;

use super::body::Body;
use super::dof::Free;
use super::link::Link;
use crate::error::SceneError;

/// A checked scene: body, links, gravity, free degrees of freedom.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    body: Body,
    links: &'a [Link],
    gravity: Vector3<f64>,
    free: Free,
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
        Ok(Self { body, links, gravity, free })
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
