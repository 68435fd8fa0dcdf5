//! A body that rides on the main body: it moves along a fixed direction of the main body and turns with it.

use nalgebra::Vector3;

use super::body::Body;
use super::link::unit;
use crate::error::SceneError;

/// A body on a slide of the main body, at its zero position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rider {
    body: Body,
    direction: Vector3<f64>,
}

impl Rider {
    /// A rider whose centre of mass is that of `body` at travel zero, and moves along `direction` (of any length).
    ///
    /// # Errors
    /// [`SceneError::Direction`] for a direction without length.
    pub fn new(body: Body, direction: Vector3<f64>) -> Result<Self, SceneError> {
        Ok(Self { body, direction: unit(direction)? })
    }

    /// The rider's mass, centre of mass at travel zero, and inertia.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Unit vector of its travel.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// The body at a travel, m.
    pub fn at(&self, travel: f64) -> Body {
        self.body.moved(self.direction * travel)
    }
}
