//! Tensors of the equations of motion.

use nalgebra::{Matrix3, Vector3};

/// Antisymmetric tensor of a vector: `skew(r) * w == r × w` (paper eqs. 5, 19, 20, 29).
pub fn skew(r: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(
        0.0, -r.z, r.y, //
        r.z, 0.0, -r.x, //
        -r.y, r.x, 0.0,
    )
}

/// Projector on a unit direction, `o oᵀ` (paper eqs. 22, 31).
pub fn projector(direction: &Vector3<f64>) -> Matrix3<f64> {
    direction * direction.transpose()
}

/// Inertia tensor moved from the centre of mass to a point from which the centre of mass lies at `arm`
/// (parallel axes): `J - m skew(arm)²`, kg m².
pub fn parallel_axes(inertia: &Matrix3<f64>, mass: f64, arm: &Vector3<f64>) -> Matrix3<f64> {
    inertia - skew(arm) * skew(arm) * mass
}
