//! Links with preloaded balls, eight at a time: their loads, slopes and rates, and how far they are off a tangent.

use crate::model::ball_compressions;
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::numeric::simd::{LANES, Lanes, dispatch};
use crate::system::{Force, LinkRow, NO_FORCE, State, StateBox};

/// Eight links with preloaded balls: `K [(d₀ + δ)₊^(3/2) - (d₀ - δ)₊^(3/2)]`. Unused lanes have no stiffness.
#[derive(Debug, Clone, Copy)]
pub(super) struct BallLinks {
    pub deflection: [Lanes; 6],
    /// Modal force per unit of load of each link.
    pub rate: [Force; LANES],
    pub rest: Lanes,
    pub opening: Lanes,
    pub coefficient: Lanes,
    /// Load at rest, N, computed by `loads`, and stiffness there, N/m.
    pub load: Lanes,
    pub stiffness: Lanes,
}

impl BallLinks {
    pub(super) const NONE: Self = Self {
        deflection: [[0.0; LANES]; 6],
        rate: [NO_FORCE; LANES],
        rest: [0.0; LANES],
        opening: [1.0; LANES],
        coefficient: [0.0; LANES],
        load: [0.0; LANES],
        stiffness: [0.0; LANES],
    };

    pub(super) fn set(&mut self, lane: usize, row: &LinkRow, [opening, coefficient]: [f64; 2]) {
        for j in 0..6 {
            self.deflection[j][lane] = row.deflection[j];
            self.rate[lane][j] = row.rate[j];
        }
        self.rest[lane] = row.rest;
        self.opening[lane] = opening;
        self.coefficient[lane] = coefficient;
        self.stiffness[lane] = row.stiffness;
    }

    /// Deflections from rest, m.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn deflections(&self, state: &State) -> Lanes {
        // Two sums side by side: each addition of a single sum would wait for the one before.
        let [mut from_rest, mut second] = [[0.0; LANES]; 2];
        for j in 0..3 {
            add_scaled(&mut from_rest, &self.deflection[j], state[j]);
            add_scaled(&mut second, &self.deflection[3 + j], state[3 + j]);
        }
        add_scaled(&mut from_rest, &second, 1.0);
        from_rest
    }

    /// Bounds on how much the loads in a box are off the tangent at the state `at`, N; infinite if a row opens or closes. See
    /// [`LinkRow::tangent_error`].
    #[inline(always)]
    pub(super) fn tangent_errors(&self, at: &State, states: &StateBox) -> Lanes {
        let (at, mut middle, mut reach) = (self.deflections(at), [0.0; LANES], [0.0; LANES]);
        for j in 0..6 {
            add_scaled(&mut middle, &self.deflection[j], states.middle[j]);
            for i in 0..LANES {
                reach[i] = fma(self.deflection[j][i].abs(), states.radius[j], reach[i]);
            }
        }
        let mut worst = [0.0; LANES];
        let mut open = [[0.0; LANES]; 2];
        for i in 0..LANES {
            reach[i] += (middle[i] - at[i]).abs();
        }
        for (side, open) in [-1.0, 1.0].into_iter().zip(&mut open) {
            for i in 0..LANES {
                let [a, b] = ball_compressions(self.opening[i], self.rest[i] + at[i]);
                let [c, d] = ball_compressions(self.opening[i], self.rest[i] + fma(side, reach[i], at[i]));
                let slope = 1.5 * (sqrt(a) + sqrt(b));
                let rise = c * sqrt(c) - d * sqrt(d) - (a * sqrt(a) - b * sqrt(b));
                let off = self.coefficient[i] * fma(-side * slope, reach[i], rise).abs();
                worst[i] = if off <= worst[i] { worst[i] } else { off }; // NaN of both sides stays
                let [of_c, of_d] = [if c > 0.0 { 1.0 } else { 0.0 }, if d > 0.0 { 1.0 } else { 0.0 }];
                open[i] = of_c - of_d;
            }
        }
        for i in 0..LANES {
            worst[i] = if open[0][i] == open[1][i] { worst[i] } else { f64::INFINITY };
        }
        worst
    }

    /// Loads beyond the linear part at a state, N, and their slopes over the deflection, N/m.
    ///
    /// Out of line and by reference: where single numbers of the arrays are used at once, the compiler makes vectors of two of them.
    #[inline(never)]
    pub(super) fn loads(&self, state: &State, out: &mut BallLoads) {
        dispatch!(loads(self, state, None, out));
    }

    /// The same with rates of change of the loads, N/s, in place of the slopes, and which rows are open. `moving`: a state whose deflections
    /// are the rates of deflection.
    #[inline(never)]
    pub(super) fn load_rates(&self, state: &State, moving: &State, out: &mut BallLoads) {
        dispatch!(loads(self, state, Some(moving), out));
    }
}

/// What [`BallLinks::loads`] and [`BallLinks::load_rates`] find.
#[derive(Debug, Clone, Copy)]
pub(super) struct BallLoads {
    pub loads: Lanes,
    pub slopes: Lanes,
    /// `Σ ± 3^lane` over the open rows; the sign is that of the row.
    pub contact_signature: f64,
}

impl BallLoads {
    pub(super) const NONE: Self = Self { loads: [0.0; LANES], slopes: [0.0; LANES], contact_signature: 0.0 };
}

/// [`BallLinks::loads`] and [`BallLinks::load_rates`].
#[cfg_attr(feature = "std", inline(always))]
fn loads(balls: &BallLinks, state: &State, moving: Option<&State>, out: &mut BallLoads) {
    let from_rest = balls.deflections(state);
    // Local arrays and one loop for each: the compiler makes no vectors of stores that might overlap what is read.
    let [mut a, mut b, mut root_a, mut root_b, mut loads, mut slopes] = [[0.0; LANES]; 6];
    for i in 0..LANES {
        [a[i], b[i]] = ball_compressions(balls.opening[i], balls.rest[i] + from_rest[i]);
    }
    for i in 0..LANES {
        (root_a[i], root_b[i]) = (sqrt(a[i]), sqrt(b[i]));
    }
    for i in 0..LANES {
        let linear = fma(balls.stiffness[i], from_rest[i], balls.load[i]);
        loads[i] = fma(balls.coefficient[i], a[i] * root_a[i] - b[i] * root_b[i], -linear);
    }
    for i in 0..LANES {
        slopes[i] = fma(1.5 * balls.coefficient[i], root_a[i] + root_b[i], -balls.stiffness[i]);
    }
    let mut contact_signature = 0.0;
    if let Some(moving) = moving {
        let speeds = balls.deflections(moving);
        let mut open = [0.0; LANES];
        for i in 0..LANES {
            slopes[i] *= speeds[i];
        }
        for i in 0..LANES {
            let [of_a, of_b] = [if a[i] > 0.0 { 0.0 } else { 1.0 }, if b[i] > 0.0 { 0.0 } else { 1.0 }];
            open[i] = (of_a - of_b) * POWERS_OF_3[i];
        }
        contact_signature =
            (open[0] + open[1] + (open[2] + open[3])) + (open[4] + open[5] + (open[6] + open[7]));
    }
    *out = BallLoads { loads, slopes, contact_signature };
}

/// 3^lane.
pub(super) const POWERS_OF_3: Lanes = [1.0, 3.0, 9.0, 27.0, 81.0, 243.0, 729.0, 2187.0];
