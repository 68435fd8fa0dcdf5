//! The axes in which the load of a group of links is given.

use nalgebra::Vector3;

use crate::numeric::float::{cos, sin};

/// Axes turned about x from those of the machine, such as those of a rail that stands on its side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    cosine: f64,
    sine: f64,
}

impl Axes {
    /// The axes of the machine.
    pub const MACHINE: Self = Self { cosine: 1.0, sine: 0.0 };

    /// Axes turned by `roll` about x, in rad; a positive angle turns y towards z.
    pub fn rolled(roll: f64) -> Self {
        Self { cosine: cos(roll), sine: sin(roll) }
    }

    /// Components in these axes of a vector that is given in those of the machine.
    pub fn components(&self, vector: Vector3<f64>) -> Vector3<f64> {
        let (y, z) = (vector.y, vector.z);
        Vector3::new(vector.x, self.cosine * y + self.sine * z, self.cosine * z - self.sine * y)
    }
}
