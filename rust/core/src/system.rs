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
use crate::equations::{Equations, Square};
use crate::error::SceneError;
use crate::factor::{Modes, factor};
use crate::float::{add_scaled, fma, sqrt};
use crate::link::Link;
use crate::many::Many;
use crate::rows::Row;
use crate::scene::Scene;
use crate::statics::{NOTHING, equilibrium};

/// Deviation from the static position in energy coordinates: `ω η` (six), then `η'` (six), both in √J. Entries past the number
/// of free degrees of freedom stay zero.
pub type State = [f64; 12];

/// Excitation at one instant: acceleration of L (3, m/s²), then external force (3, N) and moment about L (3, N m).
pub type Input = [f64; 9];

/// Modal force f: six entries, and two zeros that make a copy of it two whole registers.
pub(crate) type Force = [f64; 8];

/// No force.
pub(crate) const NO_FORCE: Force = [0.0; 8];

/// No excitation.
pub(crate) const NO_INPUT: Input = [0.0; 9];

/// An [`Input`] of its parts.
#[cfg_attr(feature = "std", inline(always))]
pub fn joined([x, y, z]: [f64; 3], [a, b, c, d, e, f]: [f64; 6]) -> Input {
    [x, y, z, a, b, c, d, e, f]
}

/// Size of a state: the square root of twice its energy, in the linear part of a scene.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn size(state: &State) -> f64 {
    // Four sums side by side.
    let mut sums = [0.0; 4];
    for entries in state.as_chunks::<4>().0 {
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum = fma(*entry, *entry, *sum);
        }
    }
    sqrt(sums[0] + sums[1] + (sums[2] + sums[3]))
}

/// What a scene holds that is not linear, and so how much of a model it needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rung {
    /// Every law is `F = k δ`.
    Linear,
    /// Laws of straight segments: clearance, sides, curves. Exact between contact changes.
    PiecewiseLinear,
    /// Preloaded contacts.
    SmoothNonlinear,
}

/// A scene, ready to integrate: its linear part, of the tangent at rest, and the links that are not linear.
#[derive(Debug, Clone)]
pub struct System {
    matrices: Matrices,
    free: Free,
    rung: Rung,
    shapes: Matrix6<f64>,
    pub(crate) frequency: [f64; 6],
    /// Columns of `Ĉ = Φᵀ C Φ`.
    pub(crate) damping: [[f64; 6]; 6],
    /// Columns of the influence of an [`Input`] on f.
    influence: [Force; 9],
    static_position: Vector6<f64>,
    /// Motions in which the body is loose at rest, in the first columns.
    loose: Matrix6<f64>,
    loose_count: usize,
    rows: Many<Row>,
}

impl System {
    /// Assembles a scene, finds its static equilibrium (section 3.5; `K q = Q` where all links are linear) and its modes about it.
    ///
    /// Where the body is loose within its clearance, equilibrium is not one position. Taken is the one that springs of any common fraction
    /// of the nominal stiffnesses beside the links would choose as that fraction vanishes: the body as centred as it can be.
    /// A link that has no stiffness at rest counts in the modes with its nominal one.
    ///
    /// # Errors
    /// [`SceneError::Unsupported`] names the motion that no link resists, [`SceneError::NoEquilibrium`] the one in which the weight takes the
    /// body out of its links; [`SceneError::TooManyLinks`] only without `std`.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let links = scene.links();
        let mut matrices = assemble(scene);
        let mut rows = Many::new(Row::new(&links[0]), links.len())?;
        for (row, link) in rows.all_mut().iter_mut().zip(links) {
            *row = Row::new(link);
        }
        let mut modes = factor(scene, rows.all_mut())?;
        let rung = if links.iter().all(|link| link.law().is_linear()) {
            Rung::Linear
        } else if links.iter().all(|link| link.law().is_piecewise_linear()) {
            Rung::PiecewiseLinear
        } else {
            Rung::SmoothNonlinear
        };
        let count = scene.free().count();
        let mut rest = [0.0; 6];
        let weight = modes.shapes.transpose() * matrices.weight;
        for mode in 0..count {
            rest[mode] = weight[mode] / modes.frequency[mode];
        }
        let (mut loose, mut loose_count) = (Matrix6::zeros(), 0);
        let static_position;
        if rung == Rung::Linear {
            static_position = position(&modes, &rest);
            for row in rows.all_mut() {
                row.rest = dot(&row.deflection, &rest);
                row.load = dot(&row.elastic, &rest);
            }
        } else {
            if !rest.iter().all(|x| x.is_finite()) {
                return Err(OUT_OF_RANGE);
            }
            let springs = rows.all().iter().map(|row| (row.link.law(), row.deflection));
            let found = equilibrium(springs, &rest, count).map_err(|direction| {
                let motion = position(&modes, &direction);
                let largest = motion.amax();
                if largest > 0.0 {
                    SceneError::NoEquilibrium { motion: motion / largest }
                } else {
                    OUT_OF_RANGE
                }
            })?;
            static_position = position(&modes, &found.position);
            loose_count = found.loose_count;
            for (i, direction) in found.loose[..loose_count].iter().enumerate() {
                loose.set_column(i, &position(&modes, direction));
            }
            for row in rows.all_mut() {
                row.rest = dot(&row.deflection, &found.position);
                row.load = row.link.law().force(row.rest);
                let tangent = row.link.law().tangent(row.rest);
                let nominal = row.link.law().nominal();
                row.stiffness = if tangent > NOTHING * nominal { tangent } else { nominal };
            }
            modes = factor(scene, rows.all_mut())?;
            matrices.stiffness = Matrix6::zeros();
            for row in rows.all() {
                let d = row.link.row();
                matrices.stiffness.ger(row.stiffness, &d, &d, 1.0);
            }
        }
        let Modes { shapes, frequency } = modes;
        let mut damping = [[0.0; 6]; 6];
        for row in rows.all() {
            for (j, column) in damping.iter_mut().enumerate() {
                add_scaled(column, &row.damping, row.rate[j]);
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
        let loads = rows.all().iter().map(|row| &row.load);
        let numbers = frequency.iter().chain(&static_position).chain(damping.as_flattened()).chain(loads);
        if !numbers.chain(influence.as_flattened()).all(|x| x.is_finite()) {
            return Err(OUT_OF_RANGE);
        }
        let free = scene.free();
        Ok(Self {
            matrices,
            free,
            rung,
            shapes,
            frequency,
            damping,
            influence,
            static_position,
            loose,
            loose_count,
            rows,
        })
    }

    /// How much of a model the scene needs.
    pub fn rung(&self) -> Rung {
        self.rung
    }

    /// Motions `(u, φ)` of L in which the body is loose within its clearance at rest, so that the static position is a choice: m, rad.
    pub fn free_at_rest(&self) -> impl ExactSizeIterator<Item = Vector6<f64>> {
        (0..self.loose_count).map(|i| self.loose.column(i).into_owned())
    }

    /// The first link that has no exact solution.
    pub(crate) fn first_smooth(&self) -> Option<usize> {
        self.links().position(|link| !link.law().is_piecewise_linear())
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

    /// Undamped angular natural frequencies ω, ascending, rad/s, of the tangent at rest; zeros past the number of modes.
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
        self.static_position
    }

    /// Modal force of a unit of each component of an [`Input`].
    pub(crate) fn influence(&self) -> &[Force; 9] {
        &self.influence
    }
}

impl Equations for System {
    const PIECES: bool = false;
    const LINEAR: bool = true;

    #[cfg_attr(feature = "std", inline(always))]
    fn key(&self) -> u32 {
        0
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn frequency(&self) -> &[f64; 6] {
        &self.frequency
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn linear(&self, state: &State, force: &Force) -> State {
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

    #[cfg_attr(feature = "std", inline(always))]
    fn constant(&self) -> &Force {
        &NO_FORCE
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn rate(&self, state: &State, force: &Force) -> State {
        self.linear(state, force)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn tangent(&self, _: &State) -> (Square, Square) {
        let mut stiffness = [[0.0; 6]; 6];
        for (i, column) in stiffness.iter_mut().enumerate() {
            column[i] = self.frequency[i];
        }
        (stiffness, self.damping)
    }
}

const OUT_OF_RANGE: SceneError =
    SceneError::NotFinite { field: "scene: mass, inertia, stiffness, damping or gravity out of range" };

/// `(u, φ)` of the elastic half of a state.
fn position(modes: &Modes, elastic: &[f64; 6]) -> Vector6<f64> {
    let mut q = Vector6::zeros();
    for (mode, frequency) in modes.frequency.iter().enumerate().filter(|(_, frequency)| **frequency > 0.0) {
        q += modes.shapes.column(mode) * (elastic[mode] / frequency);
    }
    q
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
