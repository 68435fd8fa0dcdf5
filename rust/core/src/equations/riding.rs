//! The terms of moving riders in the equations of motion.
//!
//! A rider of mass m has its centre of mass at r(t) = r₀ + s(t) d. With G = [I, -skew(r)] and D = dG/ds = [0, -skew(d)] its point moves by
//! `x = X + G q + r`, linear in q = (u, φ), so Lagrange gives the force on the body
//!
//! ```text
//! -Gᵀ m (a - g + G q'' + 2 s' D q' + s'' (d + D q))
//! ```
//!
//! The system includes the rider at s = 0; here is what the travel changes. All of it stands on the right-hand side of the system's own
//! modes, but the change of the mass matrix, `m (GᵀG - G₀ᵀG₀)`, whose sum with the identity is solved at each evaluation. What depends on
//! the instant alone, above all the factors of this matrix, is computed for all instants of a step side by side ([`StageData`]).

use nalgebra::{Matrix3x6, Vector3, Vector6};

use crate::excitation::{Excitation, Instant, MAX_RIDERS, travel_after};
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::{add_scaled, fma};
use crate::numeric::simd::{LANES, Lanes, dispatch};
use crate::numeric::tensor::skew;
use crate::system::{Force, Input, NO_FORCE, Square, State, System};

/// Rows x, y, z of a matrix in the modes.
type Rows = [Force; 3];

/// A rider in the modes of a system.
#[derive(Debug, Clone, Copy)]
struct ModalRider {
    mass: f64,
    direction: [f64; 3],
    /// G₀ Φ: motion of its centre of mass at travel zero per unit of `η'`.
    start: Rows,
    /// D Φ: change of this motion per unit of travel.
    turn: Rows,
    /// D Φ / ω: per unit of `ω η`; and D q at rest.
    elastic_turn: Rows,
    rest_turn: [f64; 3],
    /// Columns of the change of the mass matrix, by travel and by its square.
    mass_change: [Square; 2],
}

const NONE: ModalRider = ModalRider {
    mass: 0.0,
    direction: [0.0; 3],
    start: [NO_FORCE; 3],
    turn: [NO_FORCE; 3],
    elastic_turn: [NO_FORCE; 3],
    rest_turn: [0.0; 3],
    mass_change: [[[0.0; 6]; 6]; 2],
};

/// What depends on the instant alone, at up to [`LANES`] instants of a step; nothing where no rider moves.
#[derive(Debug, Clone)]
pub struct StageData {
    /// Travel, speed and acceleration of each rider.
    travel: [[Lanes; 3]; MAX_RIDERS],
    /// Modal force of the riders on a body that is at rest.
    force: [Lanes; 6],
    /// Factors of the mass matrix: see [`factorised`].
    factors: [[Lanes; 6]; 6],
}

impl StageData {
    /// Before the first step.
    pub(crate) const NONE: Self = Self {
        travel: [[[0.0; LANES]; 3]; MAX_RIDERS],
        force: [[0.0; LANES]; 6],
        factors: [[[0.0; LANES]; 6]; 6],
    };

    /// Solves in place with the mass matrix at one of the instants.
    #[cfg_attr(feature = "std", inline(always))]
    fn solve(&self, lane: usize, x: &mut [f64; 6]) {
        for j in 0..6 {
            for i in j + 1..6 {
                x[i] = fma(-self.factors[j][i][lane], x[j], x[i]);
            }
        }
        for j in (0..6).rev() {
            x[j] *= self.factors[j][j][lane];
            for i in j + 1..6 {
                x[j] = fma(-self.factors[j][i][lane], x[i], x[j]);
            }
        }
    }
}

/// The moving riders of a run.
#[derive(Debug)]
pub(crate) struct Riders<'a> {
    excitation: &'a Excitation<'a>,
    gravity: [f64; 3],
    all: BoundedVec<ModalRider, MAX_RIDERS>,
}

impl<'a> Riders<'a> {
    /// The riders of an excitation on a system that includes them at travel zero.
    pub(crate) fn new(system: &System, excitation: &'a Excitation<'a>) -> Self {
        let motions = excitation.riders();
        let mut all = BoundedVec::filled(NONE, motions.len());
        for (to, motion) in all.as_mut_slice().iter_mut().zip(motions) {
            let body = motion.rider.body();
            *to = ModalRider::new(system, body.mass(), body.center_of_mass(), motion.rider.direction());
        }
        Self { excitation, gravity: system.gravity().into(), all }
    }

    /// Whether there is none.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn is_empty(&self) -> bool {
        self.all.as_slice().is_empty()
    }

    /// Computes the stage_data at the fractions `nodes` of a step of length `h`, at most [`LANES`]. Out of line, as are the other functions
    /// of steps, so that runs without riders keep their code.
    #[inline(never)]
    pub(crate) fn prepare(&self, begin: Instant, h: f64, nodes: &[f64], stage_data: &mut StageData) {
        dispatch!(stage_data_at(self, begin, h, nodes, stage_data));
    }

    /// Turns the rate of change of the system at a state into that with its riders, at one of the stage_data.
    #[inline(never)]
    pub(crate) fn change(&self, rate: &mut State, state: &State, stage_data: &StageData, lane: usize) {
        dispatch!(change_rate(self, rate, state, stage_data, lane));
    }

    /// Turns stiffness and damping of the tangent of the system into those with its riders.
    #[inline(never)]
    pub(crate) fn change_tangent(&self, stiffness: &mut Square, damping: &mut Square, at: Instant) {
        let mut stage_data = StageData::NONE;
        self.prepare(at, 0.0, &[0.0], &mut stage_data);
        for (rider, travel) in self.all.as_slice().iter().zip(&stage_data.travel) {
            let [travel, speed, acceleration] = travel.map(|lanes| lanes[0]);
            for axis in 0..3 {
                let now: [f64; 6] =
                    core::array::from_fn(|j| fma(travel, rider.turn[axis][j], rider.start[axis][j]));
                for j in 0..6 {
                    let factor = rider.mass * rider.turn[axis][j];
                    add_scaled(&mut damping[j], &now, 2.0 * speed * factor);
                    let factor = rider.mass * rider.elastic_turn[axis][j];
                    add_scaled(&mut stiffness[j], &now, acceleration * factor);
                }
            }
        }
        for column in stiffness.iter_mut().chain(damping) {
            stage_data.solve(0, column);
        }
    }

    /// The modal force of the riders at the start of a run, of a body in its static equilibrium.
    pub(crate) fn first_force(&self) -> Force {
        let mut stage_data = StageData::NONE;
        self.prepare(Instant::FIRST, 0.0, &[0.0], &mut stage_data);
        core::array::from_fn(|j| stage_data.force.get(j).map_or(0.0, |lanes| lanes[0]))
    }

    /// Passes bounds on the modal forces of the riders to `add`, for an excitation with these peaks.
    pub(crate) fn peak_forces(&self, peak: &Input, mut add: impl FnMut(&Force)) {
        for (rider, motion) in self.all.as_slice().iter().zip(self.excitation.riders()) {
            let [travel, _, acceleration] = motion.peak();
            let mut force = |rows: &Rows, vector: [f64; 3]| {
                let mut force = NO_FORCE;
                for axis in 0..3 {
                    add_scaled(&mut force, &rows[axis], rider.mass * vector[axis]);
                }
                add(&force);
            };
            force(&rider.start, rider.direction.map(|d| d * acceleration));
            force(&rider.turn, self.gravity.map(|g| g * travel));
            for axis in 0..3 {
                let mut vector = [0.0; 3];
                vector[axis] = peak[axis] * travel;
                force(&rider.turn, vector);
            }
        }
    }
}

impl ModalRider {
    fn new(system: &System, mass: f64, center: Vector3<f64>, direction: Vector3<f64>) -> Self {
        let shapes = system.shapes();
        let mut start = Matrix3x6::zeros();
        start.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        start.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&center));
        let mut turn = Matrix3x6::zeros();
        turn.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&direction));
        let rest: Vector6<f64> = system.static_position();
        let (rest_turn, start, turn) = (turn * rest, start * shapes, turn * shapes);
        let rows = |matrix: &Matrix3x6<f64>| -> Rows {
            core::array::from_fn(|axis| core::array::from_fn(|j| if j < 6 { matrix[(axis, j)] } else { 0.0 }))
        };
        let columns = |matrix: nalgebra::Matrix6<f64>| -> Square {
            core::array::from_fn(|j| core::array::from_fn(|i| mass * matrix[(i, j)]))
        };
        let mixed = start.transpose() * turn;
        let mass_change = [columns(mixed + mixed.transpose()), columns(turn.transpose() * turn)];
        let mut elastic_turn = rows(&turn);
        for row in &mut elastic_turn {
            for (entry, frequency) in row.iter_mut().zip(&system.frequency) {
                *entry = if *frequency > 0.0 { *entry / frequency } else { 0.0 };
            }
        }
        Self {
            mass,
            direction: direction.into(),
            start: rows(&start),
            turn: rows(&turn),
            elastic_turn,
            rest_turn: rest_turn.into(),
            mass_change,
        }
    }
}

/// [`Riders::prepare`].
#[cfg_attr(feature = "std", inline(always))]
fn stage_data_at(riders: &Riders, begin: Instant, h: f64, nodes: &[f64], stage_data: &mut StageData) {
    let mut since = [begin.since; LANES];
    for (since, node) in since.iter_mut().zip(nodes) {
        *since = fma(*node, h, begin.since);
    }
    let mut drive = [[0.0; LANES]; 3];
    let [value, slope] = riders.excitation.acceleration_line(begin);
    for axis in 0..3 {
        for i in 0..LANES {
            drive[axis][i] = fma(slope[axis], since[i], value[axis] - riders.gravity[axis]);
        }
    }
    let mut mass = [[[0.0; LANES]; 6]; 6];
    for j in 0..6 {
        mass[j][j] = [1.0; LANES];
    }
    let mut force = [[0.0; LANES]; 6];
    for (index, rider) in riders.all.as_slice().iter().enumerate() {
        let terms = riders.excitation.travel_terms(index, begin);
        let [travel, speeds, accelerations] = &mut stage_data.travel[index];
        for i in 0..LANES {
            [travel[i], speeds[i], accelerations[i]] = travel_after(terms, since[i]);
        }
        for j in 0..6 {
            for k in j..6 {
                let [first, second] = [rider.mass_change[0][j][k], rider.mass_change[1][j][k]];
                for i in 0..LANES {
                    mass[j][k][i] = fma(travel[i], fma(travel[i], second, first), mass[j][k][i]);
                }
            }
        }
        for axis in 0..3 {
            let along = rider.direction[axis] + rider.rest_turn[axis];
            for j in 0..6 {
                let [start, turn] = [-rider.mass * rider.start[axis][j], -rider.mass * rider.turn[axis][j]];
                for i in 0..LANES {
                    // At travel zero only this part is not in the system yet.
                    let own = accelerations[i] * along;
                    let arm = turn * travel[i];
                    force[j][i] = fma(start, own, fma(arm, own + drive[axis][i], force[j][i]));
                }
            }
        }
    }
    stage_data.force = force;
    stage_data.factors = factorised(mass);
}

/// [`Riders::change`].
#[cfg_attr(feature = "std", inline(always))]
fn change_rate(riders: &Riders, rate: &mut State, state: &State, stage_data: &StageData, lane: usize) {
    let mut force = NO_FORCE;
    for j in 0..6 {
        force[j] = rate[6 + j] + stage_data.force[j][lane];
    }
    for (rider, [travel, speed, acceleration]) in riders.all.as_slice().iter().zip(&stage_data.travel) {
        let (speed, acceleration) = (-2.0 * rider.mass * speed[lane], -rider.mass * acceleration[lane]);
        for axis in 0..3 {
            let (mut turning, mut turned) = (0.0, 0.0);
            for j in 0..6 {
                turning = fma(rider.turn[axis][j], state[6 + j], turning);
                turned = fma(rider.elastic_turn[axis][j], state[j], turned);
            }
            let push = speed * turning + acceleration * turned;
            add_scaled(&mut force, &rider.start[axis], push);
            add_scaled(&mut force, &rider.turn[axis], push * travel[lane]);
        }
    }
    let mut solved = [0.0; 6];
    solved.copy_from_slice(&force[..6]);
    stage_data.solve(lane, &mut solved);
    rate[6..].copy_from_slice(&solved);
}

/// The factors L and, on the diagonal, D⁻¹ of symmetric positive definite matrices, by columns: `L D Lᵀ`.
#[cfg_attr(feature = "std", inline(always))]
fn factorised(mut matrix: [[Lanes; 6]; 6]) -> [[Lanes; 6]; 6] {
    for j in 0..6 {
        let column = matrix[j];
        let mut inverse = column[j];
        for i in 0..LANES {
            inverse[i] = 1.0 / inverse[i];
        }
        for k in j + 1..6 {
            let mut factor = column[k];
            for i in 0..LANES {
                factor[i] *= inverse[i];
            }
            for row in k..6 {
                for i in 0..LANES {
                    matrix[k][row][i] = fma(-factor[i], column[row][i], matrix[k][row][i]);
                }
            }
            matrix[j][k] = factor;
        }
        matrix[j][j] = inverse;
    }
    matrix
}
