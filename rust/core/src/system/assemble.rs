//! Mass, damping and stiffness matrices, paper eqs. 2-33: `M q'' + C q' + K q = Q + E(t) - M_u a(t)`.

use nalgebra::{Matrix6, Vector6};

use crate::model::Scene;

/// Matrices of all six degrees of freedom `q = (u, φ)` of L, free and held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matrices {
    /// Mass matrix M (eqs. 11, 12): kg, kg m, kg m².
    pub mass: Matrix6<f64>,
    /// Damping matrix `C = Σ b d dᵀ` (eqs. 32, 33): N s/m, N s, N m s.
    pub damping: Matrix6<f64>,
    /// Stiffness matrix `K = Σ k d dᵀ` (eqs. 23, 24): N/m, N, N m. k is the nominal stiffness; in a [`crate::System`] the slope of the
    /// law at rest.
    pub stiffness: Matrix6<f64>,
    /// Weight Q as force and moment about L: N, N m.
    pub weight: Vector6<f64>,
}

/// Assembles the matrices of a scene.
///
/// With `P = skew(p)` and `Ω = o oᵀ` the blocks of `d dᵀ` are the paper's: `Ω`, `-Ω P`, `P Ω`, `-P Ω P`.
pub fn assemble(scene: &Scene) -> Matrices {
    let mut damping = Matrix6::zeros();
    let mut stiffness = Matrix6::zeros();
    for link in scene.links() {
        let d = link.row();
        damping.ger(link.damping(), &d, &d, 1.0);
        stiffness.ger(link.stiffness(), &d, &d, 1.0);
    }
    Matrices {
        mass: scene.body().mass_matrix(),
        damping,
        stiffness,
        weight: scene.body().weight(&scene.gravity()),
    }
}
