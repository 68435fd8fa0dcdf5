//! Uniaxial links: a spring with a [`Law`] and a damper in parallel between the moving body and the frame.

use nalgebra::{Vector3, Vector6};

use super::law::Law;
use crate::error::SceneError;

/// One elastic and damping link along a fixed direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    point: Vector3<f64>,
    direction: Vector3<f64>,
    law: Law,
    damping: f64,
    damping_in_contact: bool,
    offset: f64,
}

impl Link {
    /// A link that holds the body at `point` (m from L) along `direction` (of any length; stored as a unit vector)
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
        Self::with_law(point, direction, Law::linear(stiffness)?, damping)
    }

    /// A link as by [`Link::new`], with any elastic law. A deflection is positive where the body moves along `direction`.
    ///
    /// # Errors
    /// As [`Link::new`].
    pub fn with_law(
        point: Vector3<f64>,
        direction: Vector3<f64>,
        law: Law,
        damping: f64,
    ) -> Result<Self, SceneError> {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite { field: "point" });
        }
        let direction = unit(direction)?;
        let link = Self { point, direction, law, damping, damping_in_contact: false, offset: 0.0 };
        link.check()?;
        Ok(link)
    }

    /// Checks everything but the direction.
    fn check(&self) -> Result<(), SceneError> {
        if !self.point.iter().all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite { field: "point" });
        }
        if !self.offset.is_finite() {
            return Err(SceneError::NotFinite { field: "offset" });
        }
        if !(self.damping >= 0.0 && self.damping.is_finite()) {
            return Err(SceneError::Damping { got: self.damping });
        }
        if self.law.nominal() == 0.0 && self.damping == 0.0 {
            return Err(SceneError::IdleLink);
        }
        if self.damping_in_contact && self.law.clearance() == 0.0 {
            return Err(SceneError::AlwaysInContact);
        }
        Ok(())
    }

    /// Changes point, law, damping and offset in place; direction and kind of damping stay.
    ///
    /// # Errors
    /// As [`Link::with_law`], [`Link::damped_in_contact`] and [`Link::with_offset`]; the link must then not be used.
    pub(crate) fn set(
        &mut self,
        point: Vector3<f64>,
        law: Option<Law>,
        damping: f64,
        offset: f64,
    ) -> Result<(), SceneError> {
        (self.point, self.damping, self.offset) = (point, damping, offset);
        if let Some(law) = law {
            self.law = law;
        }
        self.check()
    }

    /// The link with a damper that acts only in contact, outside the clearance.
    ///
    /// # Errors
    /// [`SceneError::AlwaysInContact`] if its law has no clearance.
    pub fn damped_in_contact(self) -> Result<Self, SceneError> {
        let link = Self { damping_in_contact: true, ..self };
        link.check()?;
        Ok(link)
    }

    /// The link while it stays on a segment of its law, about the load there, with its damper if `damped`.
    pub(crate) fn on_segment(&self, segment: usize, damped: bool) -> Self {
        let damping = if damped { self.damping } else { 0.0 };
        Self { law: self.law.slope_of(segment), damping, damping_in_contact: false, ..*self }
    }

    /// The link with its foot moved by `offset` m along its direction, as by a mounting error of its rail: its deflection is
    /// `d · (u, φ) - offset`.
    ///
    /// # Errors
    /// [`SceneError::NotFinite`].
    pub fn with_offset(self, offset: f64) -> Result<Self, SceneError> {
        let link = Self { offset, ..self };
        link.check()?;
        Ok(link)
    }

    /// Point of the body at which it acts, m from L.
    pub fn point(&self) -> Vector3<f64> {
        self.point
    }

    /// Unit vector along which it acts.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// Elastic law.
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// Nominal stiffness k, N/m; see [`Law::nominal`].
    pub fn stiffness(&self) -> f64 {
        self.law.nominal()
    }

    /// Damping b, N s/m.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Whether its damper acts only outside its clearance.
    pub fn is_damped_in_contact(&self) -> bool {
        self.damping_in_contact
    }

    /// Displacement of its foot along its direction, m; zero unless set by [`Link::with_offset`].
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Row d of the deflection `δ = d · (u, φ)`, less the offset: `(o, p × o)` (eqs. 14-17, 26-28).
    pub fn row(&self) -> Vector6<f64> {
        let (o, m) = (self.direction, self.point.cross(&self.direction));
        Vector6::new(o.x, o.y, o.z, m.x, m.y, m.z)
    }
}

/// The unit vector of a direction of any length.
pub(super) fn unit(direction: Vector3<f64>) -> Result<Vector3<f64>, SceneError> {
    // Squares of entries far from one leave the range of numbers.
    let largest = direction.amax();
    let near_one =
        if (1e-100..1e100).contains(&largest) { direction } else { direction.map(|entry| entry / largest) };
    let length = near_one.norm();
    if !(length > 0.0 && length.is_finite()) {
        return Err(SceneError::Direction { got: direction.into() });
    }
    Ok(near_one / length)
}

/// Points and directions of the four links of a carriage: two pairs (y and z) at `center.x ± length / 2` (paper section 4.1), in the
/// order end `-` y, end `-` z, end `+` y, end `+` z.
pub fn carriage_ends(center: Vector3<f64>, length: f64) -> [(Vector3<f64>, Vector3<f64>); 4] {
    let end = |sign: f64| center + Vector3::new(sign * length / 2.0, 0.0, 0.0);
    let (low, high) = (end(-1.0), end(1.0));
    [(low, Vector3::y()), (low, Vector3::z()), (high, Vector3::y()), (high, Vector3::z())]
}

/// The four linear links of a carriage at its [`carriage_ends`]. `stiffness` and `damping` are those of the whole carriage along y and z;
/// each end has half. For nonlinear laws, use [`Link::with_law`] and [`Law::scaled`] at the same ends.
///
/// # Errors
/// As [`Link::new`].
pub fn carriage_links(
    center: Vector3<f64>,
    length: f64,
    stiffness: [f64; 2],
    damping: [f64; 2],
) -> Result<[Link; 4], SceneError> {
    let ends = carriage_ends(center, length);
    let link = |i: usize| Link::new(ends[i].0, ends[i].1, stiffness[i % 2] / 2.0, damping[i % 2] / 2.0);
    Ok([link(0)?, link(1)?, link(2)?, link(3)?])
}
