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
//! modes, but the change of the mass matrix, `m (GᵀG - G₀ᵀG₀)`, whose sum with the identity is solved at each evaluation.

use nalgebra::{Matrix3x6, Vector3, Vector6};

use crate::excitation::{Excitation, Instant, MAX_RIDERS};
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::{add_scaled, fma};
use crate::numeric::simd::{Kernel, dispatch};
use crate::numeric::tensor::skew;
use crate::system::{Force, Input, NO_FORCE, Square, State, System};

/// Rows x, y, z of a matrix in the modes.
type Rows = [[f64; 6]; 3];

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
    start: [[0.0; 6]; 3],
    turn: [[0.0; 6]; 3],
    elastic_turn: [[0.0; 6]; 3],
    rest_turn: [0.0; 3],
    mass_change: [[[0.0; 6]; 6]; 2],
};

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

    /// Turns the rate of change of the system at a state into that with its riders. Out of line, so that runs without riders keep their
    /// code.
    #[inline(never)]
    pub(crate) fn change(&self, rate: &mut State, state: &State, at: Instant) {
        dispatch(RateKernel { riders: self, rate, state, at });
    }

    /// Turns stiffness and damping of the tangent of the system into those with its riders.
    #[inline(never)]
    pub(crate) fn change_tangent(&self, stiffness: &mut Square, damping: &mut Square, at: Instant) {
        let mut mass = IDENTITY;
        for (index, rider) in self.all.as_slice().iter().enumerate() {
            let [travel, speed, acceleration] = self.excitation.travel(index, at);
            rider.add_mass(&mut mass, travel);
            let now = rider.now(travel);
            for axis in 0..3 {
                for j in 0..6 {
                    let factor = rider.mass * rider.turn[axis][j];
                    add_scaled(&mut damping[j], &now[axis], 2.0 * speed * factor);
                    let factor = rider.mass * rider.elastic_turn[axis][j];
                    add_scaled(&mut stiffness[j], &now[axis], acceleration * factor);
                }
            }
        }
        let factors = factorised(mass);
        for column in stiffness.iter_mut().chain(damping) {
            solve(&factors, column);
        }
    }

    /// Passes bounds on the modal forces of the riders to `add`, for an excitation with these peaks.
    pub(crate) fn peak_forces(&self, peak: &Input, mut add: impl FnMut(&Force)) {
        for (rider, motion) in self.all.as_slice().iter().zip(self.excitation.riders()) {
            let [travel, _, acceleration] = motion.peak();
            let mut force = |rows: &Rows, vector: [f64; 3]| {
                let mut force = NO_FORCE;
                for axis in 0..3 {
                    for j in 0..6 {
                        force[j] = fma(rider.mass * vector[axis], rows[axis][j], force[j]);
                    }
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

const IDENTITY: Square = {
    let mut unit = [[0.0; 6]; 6];
    let mut i = 0;
    while i < 6 {
        unit[i][i] = 1.0;
        i += 1;
    }
    unit
};

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
            core::array::from_fn(|axis| core::array::from_fn(|j| matrix[(axis, j)]))
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

    /// G Φ at a travel.
    #[cfg_attr(feature = "std", inline(always))]
    fn now(&self, travel: f64) -> Rows {
        let mut now = self.start;
        for axis in 0..3 {
            add_scaled(&mut now[axis], &self.turn[axis], travel);
        }
        now
    }

    /// Adds the change of the mass matrix at a travel.
    #[cfg_attr(feature = "std", inline(always))]
    fn add_mass(&self, mass: &mut Square, travel: f64) {
        for j in 0..6 {
            add_scaled(&mut mass[j], &self.mass_change[0][j], travel);
            add_scaled(&mut mass[j], &self.mass_change[1][j], travel * travel);
        }
    }
}

/// [`Riders::change`] as a kernel.
struct RateKernel<'a, 'b> {
    riders: &'a Riders<'b>,
    rate: &'a mut State,
    state: &'a State,
    at: Instant,
}

impl Kernel for RateKernel<'_, '_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Self { riders, rate, state, at } = self;
        let mut force: [f64; 6] = core::array::from_fn(|i| rate[6 + i]);
        let mut mass = IDENTITY;
        riders.add(&mut force, &mut mass, state, at);
        solve(&factorised(mass), &mut force);
        rate[6..].copy_from_slice(&force);
    }
}

impl Riders<'_> {
    /// The modal force of the riders at the start of a run, of a body in its static equilibrium.
    pub(crate) fn first_force(&self) -> Force {
        let (mut force, mut whole) = ([0.0; 6], NO_FORCE);
        self.add(&mut force, &mut { IDENTITY }, &[0.0; 12], Instant::FIRST);
        whole[..6].copy_from_slice(&force);
        whole
    }

    /// Adds the modal force of the riders, but for the change of the mass matrix, and this change.
    #[cfg_attr(feature = "std", inline(always))]
    fn add(&self, force: &mut [f64; 6], mass: &mut Square, state: &State, at: Instant) {
        let drive = self.excitation.acceleration(at);
        for (index, rider) in self.all.as_slice().iter().enumerate() {
            let [travel, speed, acceleration] = self.excitation.travel(index, at);
            rider.add_mass(mass, travel);
            for axis in 0..3 {
                let (mut turning, mut turned) = (0.0, rider.direction[axis] + rider.rest_turn[axis]);
                for j in 0..6 {
                    turning = fma(rider.turn[axis][j], state[6 + j], turning);
                    turned = fma(rider.elastic_turn[axis][j], state[j], turned);
                }
                // At travel zero only this part is not in the system yet.
                let own = 2.0 * speed * turning + acceleration * turned;
                let all = own + drive[axis] - self.gravity[axis];
                add_scaled(force, &rider.start[axis], -rider.mass * own);
                add_scaled(force, &rider.turn[axis], -rider.mass * travel * all);
            }
        }
    }
}

/// The factors L and, on the diagonal, D⁻¹ of a symmetric positive definite matrix, by columns: `L D Lᵀ`.
#[cfg_attr(feature = "std", inline(always))]
fn factorised(mut matrix: Square) -> Square {
    for j in 0..6 {
        let inverse = 1.0 / matrix[j][j];
        let column = matrix[j];
        for k in j + 1..6 {
            let factor = column[k] * inverse;
            for i in k..6 {
                matrix[k][i] = fma(-factor, column[i], matrix[k][i]);
            }
            matrix[j][k] = factor;
        }
        matrix[j][j] = inverse;
    }
    matrix
}

/// Solves in place with the factors of a matrix.
#[cfg_attr(feature = "std", inline(always))]
fn solve(factors: &Square, x: &mut [f64; 6]) {
    for j in 0..6 {
        for i in j + 1..6 {
            x[i] = fma(-factors[j][i], x[j], x[i]);
        }
    }
    for j in (0..6).rev() {
        x[j] *= factors[j][j];
        for i in j + 1..6 {
            x[j] = fma(-factors[j][i], x[i], x[j]);
        }
    }
}
