//! The equations of motion in energy coordinates, in which every method integrates.
//!
//! With the undamped modes Φ (`Φᵀ M Φ = I`, `Φᵀ K Φ = ω²`) and `q = q_static + Φ η` the state is `s = (ω η, η')`:
//!
//! ```text
//! d/dt (ω η) =                 ω η'
//! d/dt  η'   = -ω (ω η) - Ĉ η' + f(t),      f = Φᵀ (E(t) - M_u a(t))
//! ```
//!
//! `|s|² / 2` is the energy of the motion, so without damping the system matrix is skew and with damping it only
//! dissipates: nothing in it depends on whether lengths are metres or millimetres, and small motion is not lost beside
//! the sag.

use nalgebra::{Matrix6, Vector6};

use crate::assemble::{Matrices, assemble};
use crate::dof::Free;
use crate::error::SceneError;
use crate::factor::{Modes, factor};
use crate::float::{add_scaled, fma};
use crate::link::Link;
use crate::rows::{Row, Rows};
use crate::scene::Scene;

/// Deviation from the static position in energy coordinates: `ω η` (six), then `η'` (six), both in √J. Entries past the number
/// of free degrees of freedom stay zero.
pub type State = [f64; 12];

/// Excitation at one instant: acceleration of L (3, m/s²), then external force (3, N) and moment about L (3, N m).
pub type Input = [f64; 9];

/// Modal force f: six entries, and two zeros that make a copy of it two whole registers.
pub(crate) type Force = [f64; 8];

/// No force.
pub(crate) const NO_FORCE: Force = [0.0; 8];

/// An [`Input`] of its parts.
#[inline(always)]
pub fn joined([x, y, z]: [f64; 3], [a, b, c, d, e, f]: [f64; 6]) -> Input {
    [x, y, z, a, b, c, d, e, f]
}

/// A linear scene, ready to integrate.
#[derive(Debug, Clone)]
pub struct System {
    matrices: Matrices,
    free: Free,
    shapes: Matrix6<f64>,
    pub(crate) frequency: [f64; 6],
    /// Columns of `Ĉ = Φᵀ C Φ`.
    pub(crate) damping: [[f64; 6]; 6],
    /// Columns of the influence of an [`Input`] on f.
    influence: [Force; 9],
    rest: [f64; 6],
    rows: Rows,
}

impl System {
    /// Assembles a scene, finds its modes and its static equilibrium `K q = Q` (section 3.5).
    ///
    /// # Errors
    /// [`SceneError::Unsupported`] names the motion that no link resists; [`SceneError::TooManyLinks`] only without `std`.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let matrices = assemble(scene);
        let mut rows = Rows::new(scene.links())?;
        let Modes { shapes, frequency } = factor(scene, rows.all_mut())?;
        let mut damping = [[0.0; 6]; 6];
        for row in rows.all().iter().filter(|row| row.link.damping() > 0.0) {
            for (j, column) in damping.iter_mut().enumerate() {
                add_scaled(column, &row.damping, row.damping[j] / row.link.damping());
            }
        }
        let mut influence = [NO_FORCE; 9];
        for (axis, column) in influence.iter_mut().enumerate() {
            let force = match axis {
                0..3 => -matrices.mass.column(axis),
                _ => Matrix6::identity().column(axis - 3).into_owned(),
            };
            column[..6].copy_from_slice((shapes.transpose() * force).as_slice());
        }
        let weight = shapes.transpose() * matrices.weight;
        let mut rest = [0.0; 6];
        for mode in 0..scene.free().count() {
            rest[mode] = weight[mode] / frequency[mode];
        }
        let numbers = frequency.iter().chain(&rest).chain(damping.as_flattened());
        if !numbers.chain(influence.as_flattened()).all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite {
                field: "scene: mass, inertia, stiffness, damping or gravity out of range",
            });
        }
        Ok(Self { matrices, free: scene.free(), shapes, frequency, damping, influence, rest, rows })
    }

    /// The links, in the order of the scene.
    pub fn links(&self) -> impl ExactSizeIterator<Item = &Link> {
        self.rows.all().iter().map(|row| &row.link)
    }

    /// The links with their loads in the modes.
    pub(crate) fn rows(&self) -> &[Row] {
        self.rows.all()
    }

    /// The matrices of all six degrees of freedom.
    pub fn matrices(&self) -> &Matrices {
        &self.matrices
    }

    /// The free degrees of freedom.
    pub fn free(&self) -> Free {
        self.free
    }

    /// Number of modes: of free degrees of freedom.
    pub fn mode_count(&self) -> usize {
        self.free.count()
    }

    /// Undamped angular natural frequencies ω, ascending, rad/s; zeros past the number of modes.
    pub fn frequencies(&self) -> &[f64; 6] {
        &self.frequency
    }

    /// Undamped mode shapes in columns, `(u, φ)` of L, mass-normalised (`Φᵀ M Φ = I`).
    pub fn shapes(&self) -> &Matrix6<f64> {
        &self.shapes
    }

    /// Modal damping `Ĉ = Φᵀ C Φ`, 1/s; diagonal where damping is proportional.
    pub fn modal_damping(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.damping[j][i])
    }

    /// Static position `(u, φ)` under the weight: m, rad.
    pub fn static_position(&self) -> Vector6<f64> {
        self.position(&self.rest)
    }

    /// Static part of the state: what `ω η` would be, had it been counted from the unloaded position.
    pub(crate) fn rest(&self) -> &[f64; 6] {
        &self.rest
    }

    /// `(u, φ)` of the elastic half of a state (or of [`System::rest`]).
    fn position(&self, elastic: &[f64; 6]) -> Vector6<f64> {
        let mut q = Vector6::zeros();
        for mode in 0..self.mode_count() {
            q += self.shapes.column(mode) * (elastic[mode] / self.frequency[mode]);
        }
        q
    }

    /// Modal force of a unit of each component of an [`Input`].
    pub(crate) fn influence(&self) -> &[Force; 9] {
        &self.influence
    }

    /// Rate of change of a state under the modal force `force`.
    #[inline(always)]
    pub(crate) fn rate(&self, state: &State, force: &Force) -> State {
        let mut fast = [0.0; 6];
        let mut slow: [f64; 6] = core::array::from_fn(|i| force[i]);
        for i in 0..6 {
            fast[i] = self.frequency[i] * state[6 + i];
            slow[i] = fma(-self.frequency[i], state[i], slow[i]);
        }
        for (j, column) in self.damping.iter().enumerate() {
            add_scaled(&mut slow, column, -state[6 + j]);
        }
        let mut rate = [0.0; 12];
        rate[..6].copy_from_slice(&fast);
        rate[6..].copy_from_slice(&slow);
        rate
    }
}
