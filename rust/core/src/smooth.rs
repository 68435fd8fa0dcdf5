//! The equations of a scene with smooth laws: each law is asked at every state.

use crate::equations::{Equations, Square};
use crate::float::{add_scaled, sqrt};
use crate::many::{Many, ROOM};
use crate::piece::Piece;
use crate::rows::Row;
use crate::system::{Force, State, System};

/// Links side by side: two AVX2 registers.
const LANES: usize = 8;
type Lanes = [f64; LANES];

/// Equations of which the linear part is that of the tangent at rest.
#[derive(Debug)]
pub(crate) struct Smooth<'a> {
    linear: Piece,
    /// Links on preloaded balls, the common case.
    balls: Many<Balls, { ROOM / LANES }>,
    /// Links of other laws than linear ones.
    others: Many<&'a Row>,
}

/// Eight links on preloaded balls: `K [(d₀ + δ)₊^(3/2) - (d₀ - δ)₊^(3/2)]`. Those that are missing have no stiffness.
#[derive(Debug, Clone, Copy)]
struct Balls {
    deflection: [Lanes; 6],
    rate: [Lanes; 6],
    rest: Lanes,
    opening: Lanes,
    coefficient: Lanes,
    load: Lanes,
    stiffness: Lanes,
}

impl Balls {
    const NONE: Self = Self {
        deflection: [[0.0; LANES]; 6],
        rate: [[0.0; LANES]; 6],
        rest: [0.0; LANES],
        opening: [1.0; LANES],
        coefficient: [0.0; LANES],
        load: [0.0; LANES],
        stiffness: [0.0; LANES],
    };

    fn set(&mut self, lane: usize, row: &Row, [opening, coefficient]: [f64; 2]) {
        for j in 0..6 {
            self.deflection[j][lane] = row.deflection[j];
            self.rate[j][lane] = row.rate[j];
        }
        self.rest[lane] = row.rest;
        self.opening[lane] = opening;
        self.coefficient[lane] = coefficient;
        self.load[lane] = row.load;
        self.stiffness[lane] = row.stiffness;
    }

    #[inline(always)]
    fn deflections(&self, state: &State) -> Lanes {
        let mut at = [0.0; LANES];
        for j in 0..6 {
            add_scaled(&mut at, &self.deflection[j], state[j]);
        }
        at
    }

    /// Loads above those of the tangent at rest.
    #[inline(always)]
    fn excess(&self, state: &State) -> Lanes {
        let mut out = self.deflections(state);
        for (i, out) in out.iter_mut().enumerate() {
            let (moved, at) = (*out, self.rest[i] + *out);
            let closing = f64::max(self.opening[i] + at, 0.0);
            let opening = f64::max(self.opening[i] - at, 0.0);
            let force = self.coefficient[i] * (closing * sqrt(closing) - opening * sqrt(opening));
            *out = force - self.load[i] - self.stiffness[i] * moved;
        }
        out
    }
}

impl<'a> Smooth<'a> {
    pub(crate) fn new(system: &'a System) -> Self {
        let rows = system.rows();
        let is_balls = |row: &&Row| row.link.law().balls().is_some();
        let is_other = |row: &&Row| !row.link.law().is_linear() && row.link.law().balls().is_none();
        let count = rows.iter().filter(is_balls).count();
        let mut balls = Many::like(Balls::NONE, count.div_ceil(LANES));
        for (i, row) in rows.iter().filter(is_balls).enumerate() {
            if let Some(constants) = row.link.law().balls() {
                balls.all_mut()[i / LANES].set(i % LANES, row, constants);
            }
        }
        let mut others = Many::like(&rows[0], rows.iter().filter(is_other).count());
        for (to, row) in others.all_mut().iter_mut().zip(rows.iter().filter(is_other)) {
            *to = row;
        }
        let mut linear = Piece::of_linear_links(system);
        for row in rows.iter().filter(|row| !row.link.law().is_linear()) {
            linear.add(row, row.stiffness, 0.0, true);
        }
        Self { linear, balls, others }
    }
}

/// Load of a link above that of the linear part, and whether its damper is idle.
#[inline(always)]
fn excess(row: &Row, state: &State) -> (f64, bool) {
    let moved: f64 = (0..6).map(|j| row.deflection[j] * state[j]).sum();
    let at = row.rest + moved;
    let idle = row.link.is_damped_in_contact() && at.abs() < row.link.law().clearance();
    (row.link.law().force(at) - row.load - row.stiffness * moved, idle)
}

impl Equations for Smooth<'_> {
    const PIECES: bool = false;
    const LINEAR: bool = false;

    fn key(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn frequency(&self) -> &[f64; 6] {
        self.linear.frequency()
    }

    #[inline(always)]
    fn linear(&self, state: &State, force: &Force) -> State {
        self.linear.linear(state, force)
    }

    #[inline(always)]
    fn constant(&self) -> &Force {
        self.linear.constant()
    }

    #[inline(always)]
    fn rate(&self, state: &State, force: &Force) -> State {
        let mut rate = self.linear.linear(state, force);
        let mut sums = [[0.0; 4]; 6];
        for balls in self.balls.all() {
            let excess = balls.excess(state);
            for (sum, row) in sums.iter_mut().zip(&balls.rate) {
                for i in 0..LANES {
                    sum[i % 4] = crate::float::fma(row[i], excess[i], sum[i % 4]);
                }
            }
        }
        for (i, sum) in sums.iter().enumerate() {
            rate[6 + i] -= (sum[0] + sum[1]) + (sum[2] + sum[3]);
        }
        for row in self.others.all() {
            let (mut load, idle) = excess(row, state);
            if idle {
                load -= (0..6).map(|j| row.damping[j] * state[6 + j]).sum::<f64>();
            }
            for i in 0..6 {
                rate[6 + i] -= row.rate[i] * load;
            }
        }
        rate
    }

    fn tangent(&self, state: &State) -> (Square, Square) {
        let (mut stiffness, mut damping) = self.linear.tangent(state);
        let mut add = |rate: &[f64; 6], deflection: &[f64; 6], change: f64| {
            for j in 0..6 {
                add_scaled(&mut stiffness[j], rate, change * deflection[j]);
            }
        };
        for balls in self.balls.all() {
            let moved = balls.deflections(state);
            for i in 0..LANES {
                let at = balls.rest[i] + moved[i];
                let roots =
                    sqrt(f64::max(balls.opening[i] + at, 0.0)) + sqrt(f64::max(balls.opening[i] - at, 0.0));
                let change = 1.5 * balls.coefficient[i] * roots - balls.stiffness[i];
                add(&balls.rate.map(|row| row[i]), &balls.deflection.map(|row| row[i]), change);
            }
        }
        for row in self.others.all() {
            let moved: f64 = (0..6).map(|j| row.deflection[j] * state[j]).sum();
            add(&row.rate, &row.deflection, row.link.law().tangent(row.rest + moved) - row.stiffness);
            if excess(row, state).1 {
                for j in 0..6 {
                    add_scaled(&mut damping[j], &row.rate, -row.damping[j]);
                }
            }
        }
        (stiffness, damping)
    }
}
