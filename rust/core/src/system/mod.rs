//! A scene prepared for integration: static equilibrium, undamped modes about it, and the equations of motion in energy coordinates.
//!
//! With the undamped modes Φ (`Φᵀ M Φ = I`, `Φᵀ K Φ = ω²`) and `q = q_static + Φ η` the state is `s = (ω η, η')`:
//!
//! ```text
//! d/dt (ω η) =                 ω η'
//! d/dt  η'   = -ω (ω η) - Ĉ η' + f(t),      f = Φᵀ (E(t) - M_u a(t))
//! ```
//!
//! `|s|² / 2` is the energy of the motion. Without damping the system matrix is skew-symmetric; damping only dissipates energy. The
//! coordinates do not depend on the unit of length, and a small motion does not lose digits beside the static deflection.
//!
//! `state` (plain arrays), `state_box` (ranges of states), `assemble` (M, C, K), `base` (an elastic base under all links), `link_row` (each link
//! in the modes), `undamped_modes`, `statics` (equilibrium of any laws), `quasi_static` (states of equilibrium under a force), `modes` (damping
//! ratios, eigenvalues).

mod assemble;
mod base;
mod link_row;
mod modes;
mod quasi_static;
mod state;
mod state_box;
mod statics;
mod undamped_modes;

pub use assemble::{Matrices, assemble};
pub use modes::{Mode, eigenvalues, modes};
pub use state::{Input, State, input_from};
pub use state_box::StateBox;

pub(crate) use link_row::LinkRow;
pub(crate) use state::{Force, NO_FORCE, NO_INPUT, Square, energy_norm, finite, speed};
pub(crate) use state_box::{Bounded, SUM_ROUNDING, range_of};

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::error::SceneError;
use crate::model::{Free, Link, Scene};
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::{add_scaled, dot, fma};
use base::ElasticBase;
use statics::equilibrium;
use undamped_modes::{UndampedModes, undamped_modes};

/// Model level: the simplest equations that describe all laws of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelLevel {
    /// All laws are `F = k δ`.
    Linear,
    /// Laws of straight segments (clearance, sides, curves): linear between contact changes.
    PiecewiseLinear,
    /// Some laws are smooth and nonlinear: preloaded contacts.
    SmoothNonlinear,
}

impl ModelLevel {
    /// The lowest level that describes these links.
    fn of(links: &[Link]) -> Self {
        if links.iter().all(|link| link.law().is_linear()) {
            Self::Linear
        } else if links.iter().all(|link| link.law().is_piecewise_linear()) {
            Self::PiecewiseLinear
        } else {
            Self::SmoothNonlinear
        }
    }
}

/// A scene prepared for integration: its linear part (with the slopes of all laws at rest) and its links.
#[derive(Debug, Clone)]
pub struct System {
    matrices: Matrices,
    gravity: Vector3<f64>,
    free: Free,
    model_level: ModelLevel,
    shapes: Matrix6<f64>,
    pub(crate) frequency: [f64; 6],
    /// Columns of `Ĉ = Φᵀ C Φ`.
    pub(crate) damping: [[f64; 6]; 6],
    /// Columns of the influence of an [`Input`] on the modal force f.
    influence: [Force; 9],
    equilibrium: Rest,
    rows: BoundedVec<LinkRow>,
}

impl System {
    /// Assembles a scene and finds its static equilibrium (section 3.5; `K q = Q` where all links are linear) and its undamped modes
    /// about it.
    ///
    /// A body that is free within its clearance has many equilibria. The system has the most central one: the limit for vanishing springs
    /// parallel to the links, whose stiffness is the same fraction of each nominal stiffness. A link without stiffness at rest enters the
    /// modes with its nominal stiffness.
    ///
    /// # Errors
    /// [`SceneError::Unsupported`] with the motion that no link resists; [`SceneError::NoEquilibrium`] with the motion in which the weight
    /// pushes the body away from its links; [`SceneError::FarEquilibrium`] if it rests a million times its size away; without `std` also
    /// [`SceneError::TooManyLinks`].
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let links = scene.links();
        let mut matrices = assemble(scene);
        let mut rows = BoundedVec::new(LinkRow::new(&links[0]), links.len())?;
        for (row, link) in rows.as_mut_slice().iter_mut().zip(links) {
            *row = LinkRow::new(link);
        }
        let mut modes = undamped_modes(scene, rows.as_mut_slice())?;
        let mut base = None;
        if let Some(compliance) = scene.base_compliance() {
            let found = ElasticBase::under(compliance, &mut matrices).ok_or(OUT_OF_RANGE)?;
            modes = found.modes(&matrices.stiffness, &modes, scene.free().count(), rows.as_mut_slice());
            base = Some(found);
        }
        let model_level = ModelLevel::of(links);
        let weight = modes.shapes.transpose() * matrices.weight;
        let mut rest = [0.0; 6];
        for mode in 0..scene.free().count() {
            rest[mode] = weight[mode] / modes.frequency[mode];
        }
        let unloaded = LinkRow::set_offsets(rows.as_mut_slice());
        if let Some(base) = &base {
            let moved = base.moved_by_offsets(rows.as_slice());
            for row in rows.as_mut_slice() {
                row.rest -= row.link.row().dot(&moved);
            }
        }
        let origin = modes.position(&unloaded);
        let mut equilibrium = if model_level == ModelLevel::Linear {
            linear_equilibrium(&modes, &rest, rows.as_mut_slice())
        } else {
            let found = nonlinear_equilibrium(scene, &modes, &rest, rows.as_mut_slice())?;
            modes = undamped_modes(scene, rows.as_mut_slice())?;
            matrices.stiffness = Matrix6::zeros();
            for row in rows.as_slice() {
                let d = row.link.row();
                matrices.stiffness.ger(row.stiffness, &d, &d, 1.0);
            }
            found
        };
        equilibrium.position += origin;
        let damping = modal_damping(rows.as_slice());
        if let Some(base) = &base {
            base.drag(&modes, rows.as_mut_slice());
        }
        let UndampedModes { shapes, frequency } = modes;
        let influence = modal_influence(&matrices, &shapes);
        let loads = rows.as_slice().iter().map(|row| &row.load);
        let position = &equilibrium.position;
        let numbers = frequency.iter().chain(position).chain(damping.as_flattened()).chain(loads);
        let Matrices { mass, damping: dampers, stiffness, weight } = &matrices;
        let numbers = numbers.chain(mass).chain(dampers).chain(stiffness).chain(weight);
        if !numbers.chain(influence.as_flattened()).all(|x| x.is_finite()) {
            return Err(OUT_OF_RANGE);
        }
        check_travel(scene, &equilibrium.position)?;
        let free = scene.free();
        let gravity = scene.gravity();
        Ok(Self {
            matrices,
            gravity,
            free,
            model_level,
            shapes,
            frequency,
            damping,
            influence,
            equilibrium,
            rows,
        })
    }

    /// Model level of the scene.
    pub fn model_level(&self) -> ModelLevel {
        self.model_level
    }

    /// Motions `(u, φ)` of L, m and rad, in which the body at rest is free within its clearance. If there are any, the static position is one
    /// of many.
    pub fn free_at_rest(&self) -> impl ExactSizeIterator<Item = Vector6<f64>> {
        let Rest { loose, loose_count, .. } = &self.equilibrium;
        (0..*loose_count).map(|i| loose.column(i).into_owned())
    }

    /// Index of the first preloaded link.
    pub(crate) fn first_smooth(&self) -> Option<usize> {
        self.links().position(|link| !link.law().is_piecewise_linear())
    }

    /// Index of the first link with clearance, one side or a curve: a law of straight segments between edges.
    pub fn first_segmented(&self) -> Option<usize> {
        self.links().position(|link| !link.law().is_linear() && link.law().is_piecewise_linear())
    }

    /// The links, in the order of the scene.
    pub fn links(&self) -> impl ExactSizeIterator<Item = &Link> {
        self.rows.as_slice().iter().map(|row| &row.link)
    }

    /// The link rows, in the order of the scene.
    pub(crate) fn rows(&self) -> &[LinkRow] {
        self.rows.as_slice()
    }

    /// The links whose laws are not linear, with their indices.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn nonlinear(&self) -> impl Iterator<Item = (usize, &LinkRow)> + Clone {
        self.rows().iter().enumerate().filter(|(_, row)| !row.link.law().is_linear())
    }

    /// The linear system in which every link keeps the stiffness that it has in the modes.
    pub(crate) fn linearised(&self) -> Self {
        let mut out = Self { model_level: ModelLevel::Linear, ..self.clone() };
        for row in out.rows_mut() {
            row.link = row.link.on_segment(0, true);
        }
        out
    }

    /// The link rows, to be changed with what follows from them.
    pub(crate) fn rows_mut(&mut self) -> &mut [LinkRow] {
        self.rows.as_mut_slice()
    }

    /// The matrices of all six degrees of freedom.
    pub fn matrices(&self) -> &Matrices {
        &self.matrices
    }

    /// Gravity, m/s², pointing down.
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// The free degrees of freedom.
    pub fn free(&self) -> Free {
        self.free
    }

    /// Number of modes, equal to the number of free degrees of freedom.
    pub fn mode_count(&self) -> usize {
        self.free.count()
    }

    /// Undamped angular natural frequencies ω about rest, ascending, rad/s; zeros past the number of modes.
    pub fn frequencies(&self) -> &[f64; 6] {
        &self.frequency
    }

    /// The highest of them.
    pub(crate) fn highest_frequency(&self) -> f64 {
        self.frequency.iter().fold(0.0, |most, &frequency| f64::max(most, frequency))
    }

    /// Undamped mode shapes in columns, `(u, φ)` of L, mass-normalised (`Φᵀ M Φ = I`).
    pub fn shapes(&self) -> &Matrix6<f64> {
        &self.shapes
    }

    /// `(u, φ)` of the elastic half of a state.
    pub(crate) fn position_of(&self, elastic: &[f64; 6]) -> Vector6<f64> {
        UndampedModes { shapes: self.shapes, frequency: self.frequency }.position(elastic)
    }

    /// Modal damping `Ĉ = Φᵀ C Φ`, 1/s; diagonal where damping is proportional.
    pub fn modal_damping(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.damping[j][i])
    }

    /// Static position `(u, φ)` under the weight: m, rad.
    pub fn static_position(&self) -> Vector6<f64> {
        self.equilibrium.position
    }

    /// Modal force of a unit of each component of an [`Input`].
    pub(crate) fn influence(&self) -> &[Force; 9] {
        &self.influence
    }

    /// Rate of change of a state under the modal force `force`, with the tangent stiffness at rest in all links.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn linear_rate(&self, state: &State, force: &Force) -> State {
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

const OUT_OF_RANGE: SceneError =
    SceneError::OutOfRange { what: "scene: mass, inertia, stiffness, damping or gravity" };

/// Largest travel of the body under its weight, in sizes of the machine. The model holds for small deflections, of which the audit warns
/// much earlier. Beyond this a deflection is rounded to 1e-10 of the machine, so its dynamic part has few digits left.
const MAX_TRAVEL: f64 = 1e6;

/// Smallest machine that the largest travel is measured by, m.
const SMALLEST_MACHINE: f64 = 1.0;

/// The error for a body that its links hold, but so softly that it rests far from them.
fn check_travel(scene: &Scene, position: &Vector6<f64>) -> Result<(), SceneError> {
    let links = scene.links().iter();
    let sizes = links.map(|link| f64::max(link.point().norm(), link.law().clearance()));
    let size = sizes.fold(f64::max(SMALLEST_MACHINE, scene.body().center_of_mass().norm()), f64::max);
    let [u, phi] = [0, 3].map(|first| position.fixed_rows::<3>(first).norm());
    let travel = u + phi * size;
    if travel <= MAX_TRAVEL * size {
        return Ok(());
    }
    Err(SceneError::FarEquilibrium { motion: position / position.amax(), travel })
}

/// Static position, and the motions in which nothing resists the body there.
#[derive(Debug, Clone, Copy)]
struct Rest {
    /// `(u, φ)`: m, rad.
    position: Vector6<f64>,
    /// Motions in which the body is loose, in the first columns.
    loose: Matrix6<f64>,
    loose_count: usize,
}

/// Rest on linear links, `rest` in energy coordinates from where they rest without weight; sets the deflections and loads at rest in
/// `rows`.
fn linear_equilibrium(modes: &UndampedModes, rest: &[f64; 6], rows: &mut [LinkRow]) -> Rest {
    for row in rows {
        let offset = row.rest;
        row.rest = dot(&row.deflection, rest) - offset;
        row.load = dot(&row.elastic, rest) - row.stiffness * offset;
    }
    Rest { position: modes.position(rest), loose: Matrix6::zeros(), loose_count: 0 }
}

/// Rest on links of any laws, from `linear` in energy coordinates; sets the deflections, loads and tangent stiffnesses at rest in `rows`.
fn nonlinear_equilibrium(
    scene: &Scene,
    modes: &UndampedModes,
    linear: &[f64; 6],
    rows: &mut [LinkRow],
) -> Result<Rest, SceneError> {
    if !linear.iter().all(|x| x.is_finite()) {
        return Err(OUT_OF_RANGE);
    }
    let springs = rows.iter().map(|row| (row.link.law(), row.deflection, row.rest));
    let found = equilibrium(springs, linear, scene.free().count()).map_err(|direction| {
        let motion = modes.position(&direction);
        let largest = motion.amax();
        if largest > 0.0 { SceneError::NoEquilibrium { motion: motion / largest } } else { OUT_OF_RANGE }
    })?;
    let mut loose = Matrix6::zeros();
    for (i, direction) in found.loose[..found.loose_count].iter().enumerate() {
        loose.set_column(i, &modes.position(direction));
    }
    for row in rows {
        row.rest = dot(&row.deflection, &found.position) - row.rest;
        row.load = row.link.law().force(row.rest);
        let (slope, is_stiffness) = row.slope_at_rest();
        row.stiffness = if is_stiffness { slope } else { row.link.law().nominal() };
    }
    Ok(Rest { position: modes.position(&found.position), loose, loose_count: found.loose_count })
}

/// Columns of `Ĉ = Φᵀ C Φ`, link by link.
fn modal_damping(rows: &[LinkRow]) -> Square {
    let mut damping = [[0.0; 6]; 6];
    for row in rows {
        for (j, column) in damping.iter_mut().enumerate() {
            add_scaled(column, &row.damping, row.rate[j]);
        }
    }
    damping
}

/// Modal force of a unit of each component of an [`Input`].
fn modal_influence(matrices: &Matrices, shapes: &Matrix6<f64>) -> [Force; 9] {
    let mut influence = [NO_FORCE; 9];
    for (axis, column) in influence.iter_mut().enumerate() {
        let force = match axis {
            0..3 => -matrices.mass.column(axis),
            _ => Matrix6::identity().column(axis - 3).into_owned(),
        };
        column[..6].copy_from_slice((shapes.transpose() * force).as_slice());
    }
    influence
}
