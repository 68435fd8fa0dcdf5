//! Natural frequencies, damping ratios and mode shapes.

use nalgebra::{Complex, SMatrix, Schur, Vector6};

use super::System;
use super::state::NO_FORCE;

/// One mode of vibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Undamped angular natural frequency ω, rad/s.
    pub frequency: f64,
    /// Damping ratio ζ = ĉ / 2ω of the mode on its own; exact where damping is proportional to stiffness and mass.
    pub damping_ratio: f64,
    /// Undamped shape `(u, φ)` of L, mass-normalised: 1/√kg, 1/√(kg m²).
    pub shape: Vector6<f64>,
}

/// The modes of a scene, by ascending frequency.
pub fn modes(system: &System) -> impl Iterator<Item = Mode> {
    (0..system.mode_count()).map(move |index| Mode {
        frequency: system.frequency[index],
        damping_ratio: system.damping[index][index] / (2.0 * system.frequency[index]),
        shape: system.shapes().column(index).into_owned(),
    })
}

/// Eigenvalues of the damped system, 1/s: conjugate pairs `-ζω ± iω√(1-ζ²)`, or real where overdamped. The first
/// `2 * mode_count` entries, slowest first; `None` if the iteration does not converge, or if numbers overflow.
pub fn eigenvalues(system: &System) -> Option<[Complex<f64>; 12]> {
    let mut columns = SMatrix::<f64, 12, 12>::zeros();
    for j in 0..12 {
        let mut unit = [0.0; 12];
        unit[j] = 1.0;
        columns.set_column(j, &system.linear_rate(&unit, &NO_FORCE).into());
    }
    let schur = Schur::try_new(columns, f64::EPSILON, 1000)?;
    let mut values: [Complex<f64>; 12] = schur.complex_eigenvalues().into();
    if !values.iter().all(|value| value.re.is_finite() && value.im.is_finite()) {
        return None;
    }
    values.sort_unstable_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr()));
    // The rows of absent modes are zero, and so are their eigenvalues: they come first.
    values.rotate_left(12 - 2 * system.mode_count());
    Some(values)
}
