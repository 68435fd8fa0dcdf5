//! The rigid body: mass, centre of mass, inertia.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};

use crate::error::SceneError;
use crate::numeric::tensor::{parallel_axes, skew};

/// Relative tolerance of the symmetry and triangle checks: CAD systems print six digits, so an entry may be wrong by 5e-6.
const PRINTED_DIGITS: f64 = 1e-5;

/// A principal moment below this fraction of the largest counts as zero, because rotating or moving a tensor has rounding errors of that
/// size.
const LEAST_MOMENT: f64 = 1e-12;

/// One rigid body, described about the reference point L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    mass: f64,
    center_of_mass: Vector3<f64>,
    inertia: Matrix3<f64>,
}

impl Body {
    /// A body of `mass` kg with its centre of mass at `center_of_mass` m from L and `inertia` kg m² about the centre of mass (the
    /// tensor of eq. 10).
    ///
    /// # Errors
    /// [`SceneError`] for a mass that is not positive, a tensor that is not symmetric or not positive definite, or principal moments that
    /// break the triangle rule.
    pub fn new(mass: f64, center_of_mass: Vector3<f64>, inertia: Matrix3<f64>) -> Result<Self, SceneError> {
        check_mass(mass, &center_of_mass)?;
        if !inertia.iter().all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite { field: "body.inertia" });
        }
        let size = inertia.amax();
        let asymmetry = (inertia - inertia.transpose()).amax();
        if asymmetry > PRINTED_DIGITS * size {
            return Err(SceneError::InertiaAsymmetric { by: asymmetry });
        }
        let inertia = (inertia + inertia.transpose()) * 0.5;
        let mut principal: [f64; 3] = SymmetricEigen::new(inertia).eigenvalues.into();
        principal.sort_unstable_by(f64::total_cmp);
        if principal[0] <= LEAST_MOMENT * principal[2] {
            return Err(SceneError::InertiaNotPositive { principal });
        }
        if principal[2] > (principal[0] + principal[1]) * (1.0 + PRINTED_DIGITS) {
            return Err(SceneError::InertiaTriangle { principal });
        }
        Ok(Self { mass, center_of_mass, inertia })
    }

    /// A body as by [`Body::new`], but with the inertia about L (eq. 10).
    ///
    /// # Errors
    /// As [`Body::new`], for the tensor moved to the centre of mass.
    pub fn about_reference(
        mass: f64,
        center_of_mass: Vector3<f64>,
        inertia: Matrix3<f64>,
    ) -> Result<Self, SceneError> {
        Self::new(mass, center_of_mass, parallel_axes(&inertia, -mass, &center_of_mass))
    }

    /// The body with a new mass and centre of mass, and the same inertia tensor about the new centre.
    ///
    /// # Errors
    /// As [`Body::new`].
    pub(crate) fn with_mass(&self, mass: f64, center_of_mass: Vector3<f64>) -> Result<Self, SceneError> {
        check_mass(mass, &center_of_mass)?;
        Ok(Self { mass, center_of_mass, inertia: self.inertia })
    }

    /// This body and another one, fixed to each other.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let center_of_mass = (self.center_of_mass * self.mass + other.center_of_mass * other.mass) / mass;
        let about =
            |body: &Self| parallel_axes(&body.inertia, body.mass, &(body.center_of_mass - center_of_mass));
        Self { mass, center_of_mass, inertia: about(self) + about(other) }
    }

    /// The body moved by a vector, m.
    #[must_use]
    pub fn moved(&self, by: Vector3<f64>) -> Self {
        Self { center_of_mass: self.center_of_mass + by, ..*self }
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Centre of mass from L, m.
    pub fn center_of_mass(&self) -> Vector3<f64> {
        self.center_of_mass
    }

    /// Inertia about the centre of mass, kg m².
    pub fn inertia(&self) -> Matrix3<f64> {
        self.inertia
    }

    /// Mass matrix for `(u, φ)` of L: `[[m I, -S], [S, J_L]]` with `S = m skew(r_S)` (eqs. 8, 11, 12).
    pub fn mass_matrix(&self) -> Matrix6<f64> {
        let s = skew(&self.center_of_mass) * self.mass;
        let mut m = Matrix6::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(self.mass);
        m.fixed_view_mut::<3, 3>(0, 3).copy_from(&-s);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&s);
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&parallel_axes(
            &self.inertia,
            self.mass,
            &self.center_of_mass,
        ));
        m
    }

    /// Weight as a force and a moment about L: `(m g, r_S × m g)`, N and N m, `gravity` pointing down
    /// (eqs. 13, 23, 24 with the sign corrected: a body sags, it does not rise).
    pub fn weight(&self, gravity: &Vector3<f64>) -> Vector6<f64> {
        let force = gravity * self.mass;
        let moment = self.center_of_mass.cross(&force);
        Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    }
}

fn check_mass(mass: f64, center_of_mass: &Vector3<f64>) -> Result<(), SceneError> {
    if !(mass > 0.0 && mass.is_finite()) {
        return Err(SceneError::Mass { got: mass });
    }
    if !center_of_mass.iter().all(|x| x.is_finite()) {
        return Err(SceneError::NotFinite { field: "body.center_of_mass" });
    }
    Ok(())
}
