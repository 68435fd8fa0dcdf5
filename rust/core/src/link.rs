//! Uniaxial links: a spring and a damper side by side between the moving body and the frame.

use nalgebra::{Vector3, Vector6};

use crate::error::SceneError;

/// One elastic and damping link along a fixed direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    point: Vector3<f64>,
    direction: Vector3<f64>,
    stiffness: f64,
    damping: f64,
}

impl Link {
    /// A link that holds the body at `point` (m from L) along `direction` (of any ordinary length; kept as a unit vector)
    /// with `stiffness` N/m and `damping` N s/m, either of which may be zero, but not both.
    ///
    /// # Errors
    /// [`SceneError`] for a direction without length, a negative or non-finite coefficient, or a link that does nothing.
    pub fn new(
        point: Vector3<f64>,
        direction: Vector3<f64>,
        stiffness: f64,
        damping: f64,
    ) -> Result<Self, SceneError> {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite { field: "point" });
        }
        let length = direction.norm();
        if !(length > 0.0 && length.is_finite()) {
            return Err(SceneError::Direction { got: direction.into() });
        }
        if !(stiffness >= 0.0 && stiffness.is_finite()) {
            return Err(SceneError::Stiffness { got: stiffness });
        }
        if !(damping >= 0.0 && damping.is_finite()) {
            return Err(SceneError::Damping { got: damping });
        }
        if stiffness == 0.0 && damping == 0.0 {
            return Err(SceneError::IdleLink);
        }
        Ok(Self { point, direction: direction / length, stiffness, damping })
    }

    /// Where it holds the body, m from L.
    pub fn point(&self) -> Vector3<f64> {
        self.point
    }

    /// Unit vector along which it acts.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// Stiffness k, N/m.
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// Damping b, N s/m.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Row d with which the deformation is `δ = d · (u, φ)`: `(o, p × o)` (eqs. 14-17, 26-28).
    pub fn row(&self) -> Vector6<f64> {
        let (o, m) = (self.direction, self.point.cross(&self.direction));
        Vector6::new(o.x, o.y, o.z, m.x, m.y, m.z)
    }
}

/// The four links of a carriage, two pairs (y and z) at `center.x ± length / 2` (paper section 4.1): end `-` y, end `-` z,
/// end `+` y, end `+` z. `stiffness` and `damping` are those of the whole carriage along y and z; each end carries half.
///
/// # Errors
/// As [`Link::new`].
pub fn carriage_links(
    center: Vector3<f64>,
    length: f64,
    stiffness: [f64; 2],
    damping: [f64; 2],
) -> Result<[Link; 4], SceneError> {
    let link = |end: f64, axis: usize| {
        let point = center + Vector3::new(end * length / 2.0, 0.0, 0.0);
        let direction = if axis == 0 { Vector3::y() } else { Vector3::z() };
        Link::new(point, direction, stiffness[axis] / 2.0, damping[axis] / 2.0)
    };
    Ok([link(-1.0, 0)?, link(-1.0, 1)?, link(1.0, 0)?, link(1.0, 1)?])
}
