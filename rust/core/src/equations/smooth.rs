//! The equations of a scene with preloaded laws or moving riders, which are evaluated at every state.

use super::piecewise::SegmentEquations;
use super::riding::{Moments, Riders};
use super::{Equations, Remainder};
use crate::excitation::{Excitation, Instant, Ramp};
use crate::model::ball_compressions;
use crate::numeric::bounded_vec::{BoundedVec, MAX_LINKS};
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::numeric::simd::{Kernel, LANES, Lanes, dispatch};
#[cfg(feature = "std")]
use crate::system::StateBox;
use crate::system::{Force, LinkRow, NO_FORCE, Square, State, System};

/// Equations with preloaded links. The linear part contains the links with straight segments, each on its present one, the preloaded links
/// with their stiffness at rest, and all dampers. To it, preloaded links add their loads less those at rest and less that stiffness times
/// the deflection from rest, so a body at rest stays at rest but for
/// rounding of the preloads.
#[derive(Debug)]
pub(crate) struct SmoothEquations<'a> {
    linear: SegmentEquations,
    /// Links with preloaded balls, the common case, eight at a time.
    balls: BoundedVec<BallLinks, { MAX_LINKS / LANES }>,
    /// Links with other preloaded rolling elements.
    others: BoundedVec<&'a LinkRow>,
    riders: Riders<'a>,
}

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
    const NONE: Self = Self {
        deflection: [[0.0; LANES]; 6],
        rate: [NO_FORCE; LANES],
        rest: [0.0; LANES],
        opening: [1.0; LANES],
        coefficient: [0.0; LANES],
        load: [0.0; LANES],
        stiffness: [0.0; LANES],
    };

    fn set(&mut self, lane: usize, row: &LinkRow, [opening, coefficient]: [f64; 2]) {
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
    fn deflections(&self, state: &State) -> Lanes {
        // Two sums side by side: each addition of a single sum would wait for the one before.
        let [mut from_rest, mut second] = [[0.0; LANES]; 2];
        for j in 0..3 {
            add_scaled(&mut from_rest, &self.deflection[j], state[j]);
            add_scaled(&mut second, &self.deflection[3 + j], state[3 + j]);
        }
        add_scaled(&mut from_rest, &second, 1.0);
        from_rest
    }

    /// Bounds on how much the loads in a box are off the tangent at the state `at`, N; infinite if a row opens or closes.
    ///
    /// Between the edges of a law its slope falls with |δ|, and ever faster; beyond them it only rises. So the tangent is farthest off at an
    /// end of a range that is as wide on both sides.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn tangent_errors(&self, at: &State, states: &StateBox) -> Lanes {
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
    fn loads(&self, state: &State, out: &mut BallLoads) {
        dispatch(LoadsKernel { balls: self, state, moving: None, out });
    }

    /// The same with rates of change of the loads, N/s, in place of the slopes, and which rows are open. `moving`: a state whose deflections
    /// are the rates of deflection.
    #[inline(never)]
    fn load_rates(&self, state: &State, moving: &State, out: &mut BallLoads) {
        dispatch(LoadsKernel { balls: self, state, moving: Some(moving), out });
    }
}

/// What [`BallLinks::loads`] and [`BallLinks::load_rates`] find.
#[derive(Debug, Clone, Copy)]
struct BallLoads {
    loads: Lanes,
    slopes: Lanes,
    /// `Σ ± 3^lane` over the open rows; the sign is that of the row.
    open_rows: f64,
}

impl BallLoads {
    const NONE: Self = Self { loads: [0.0; LANES], slopes: [0.0; LANES], open_rows: 0.0 };
}

/// [`BallLinks::loads`] and [`BallLinks::load_rates`].
struct LoadsKernel<'a> {
    balls: &'a BallLinks,
    state: &'a State,
    moving: Option<&'a State>,
    out: &'a mut BallLoads,
}

impl Kernel for LoadsKernel<'_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Self { balls, state, moving, out } = self;
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
        let mut open_rows = 0.0;
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
            open_rows = (open[0] + open[1] + (open[2] + open[3])) + (open[4] + open[5] + (open[6] + open[7]));
        }
        *out = BallLoads { loads, slopes, open_rows };
    }
}

/// Weight of the open rows of earlier links; no sums of whole numbers below ten cancel with it.
pub(super) const MIX: f64 = 0.9;

/// 3^lane.
pub(super) const POWERS_OF_3: Lanes = [1.0, 3.0, 9.0, 27.0, 81.0, 243.0, 729.0, 2187.0];

impl<'a> SmoothEquations<'a> {
    /// The equations of a system without straight segments and riders.
    pub(crate) fn at_rest(system: &'a System, excitation: &'a Excitation<'a>) -> Self {
        let mut linear = SegmentEquations::of_linear_links(system);
        for row in system.rows().iter().filter(|row| !row.link.law().is_linear()) {
            linear.add(row, row.stiffness, 0.0, true);
        }
        Self::new(system, linear, Riders::new(system, excitation))
    }

    /// The equations of the preloaded links and the riders beside a `linear` part.
    pub(crate) fn new(system: &'a System, linear: SegmentEquations, riders: Riders<'a>) -> Self {
        let rows = system.rows();
        let is_balls = |row: &&LinkRow| row.link.law().balls().is_some();
        let is_other =
            |row: &&LinkRow| !row.link.law().is_piecewise_linear() && row.link.law().balls().is_none();
        let count = rows.iter().filter(is_balls).count();
        let mut balls = BoundedVec::filled(BallLinks::NONE, count.div_ceil(LANES));
        for (i, row) in rows.iter().filter(is_balls).enumerate() {
            if let Some(constants) = row.link.law().balls() {
                balls.as_mut_slice()[i / LANES].set(i % LANES, row, constants);
            }
        }
        let mut at_rest = BallLoads::NONE;
        for balls in balls.as_mut_slice() {
            balls.loads(&[0.0; 12], &mut at_rest);
            balls.load = at_rest.loads;
        }
        let mut others = BoundedVec::filled(&rows[0], rows.iter().filter(is_other).count());
        for (to, row) in others.as_mut_slice().iter_mut().zip(rows.iter().filter(is_other)) {
            *to = row;
        }
        Self { linear, balls, others, riders }
    }

    /// The links with preloaded balls, eight at a time.
    #[cfg(feature = "std")]
    pub(super) fn balls(&self) -> &[BallLinks] {
        self.balls.as_slice()
    }

    /// Whether all preloaded links have balls.
    #[cfg(feature = "std")]
    pub(super) fn has_only_balls(&self) -> bool {
        self.others.as_slice().is_empty()
    }

    /// The same equations with another linear part, whose key they take.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn set_linear(&mut self, linear: &SegmentEquations) {
        self.linear = *linear;
    }
}

impl Equations for SmoothEquations<'_> {
    const PIECEWISE: bool = false;
    const LINEAR: bool = false;

    #[cfg_attr(feature = "std", inline(always))]
    fn key(&self) -> u32 {
        self.linear.key()
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn frequency(&self) -> &[f64; 6] {
        self.linear.frequency()
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn linear(&self, state: &State, force: &Force) -> State {
        self.linear.linear(state, force)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn constant(&self) -> &Force {
        self.linear.constant()
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn prepare(&self, ramp: &Ramp, nodes: &[f64], moments: &mut Moments) {
        if !self.riders.is_empty() {
            self.riders.prepare(ramp.begin, ramp.h, nodes, moments);
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn rate(&self, state: &State, force: &Force, at: (&Moments, usize)) -> State {
        let mut rate = self.linear.rate(state, force, at);
        let ([mut pull, mut second], mut found) = ([NO_FORCE; 2], BallLoads::NONE);
        for balls in self.balls.as_slice() {
            balls.loads(state, &mut found);
            let loads = &found.loads;
            for i in (0..LANES).step_by(2) {
                add_scaled(&mut pull, &balls.rate[i], loads[i]);
                add_scaled(&mut second, &balls.rate[i + 1], loads[i + 1]);
            }
        }
        add_scaled(&mut pull, &second, 1.0);
        for j in 0..6 {
            rate[6 + j] -= pull[j];
        }
        for row in self.others.as_slice() {
            let (load, _) = row.beyond_spring(state);
            for j in 0..6 {
                rate[6 + j] -= row.rate[j] * load;
            }
        }
        if !self.riders.is_empty() {
            self.riders.change(&mut rate, state, at.0, at.1);
        }
        rate
    }

    /// Without the loads of the riders.
    #[cfg_attr(feature = "std", inline(always))]
    fn remainder(&self, state: &State) -> Remainder {
        // Two sums of each, side by side.
        let ([mut force, mut second, mut rate, mut second_rate], mut open_rows) = ([NO_FORCE; 4], 0.0);
        let mut found = BallLoads::NONE;
        let mut moving = [0.0; 12];
        for i in 0..6 {
            moving[i] = self.frequency()[i] * state[6 + i];
        }
        for balls in self.balls.as_slice() {
            balls.load_rates(state, &moving, &mut found);
            let BallLoads { loads, slopes: rates, open_rows: open } = &found;
            for i in (0..LANES).step_by(2) {
                add_scaled(&mut force, &balls.rate[i], -loads[i]);
                add_scaled(&mut rate, &balls.rate[i], -rates[i]);
                add_scaled(&mut second, &balls.rate[i + 1], -loads[i + 1]);
                add_scaled(&mut second_rate, &balls.rate[i + 1], -rates[i + 1]);
            }
            open_rows = fma(open_rows, MIX, *open);
        }
        for row in self.others.as_slice() {
            let (load, slope) = row.beyond_spring(state);
            let load_rate = slope * (row.deflection_at(&moving) - row.rest);
            for j in 0..6 {
                force[j] -= row.rate[j] * load;
                rate[j] -= row.rate[j] * load_rate;
            }
            let segment = row.link.law().segment_of(row.deflection_at(state));
            open_rows = fma(open_rows, MIX, segment as f64 - 1.0);
        }
        add_scaled(&mut force, &second, 1.0);
        add_scaled(&mut rate, &second_rate, 1.0);
        Remainder { force, rate, open_rows }
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn tangent_error(&self, at: &State, states: &StateBox) -> Force {
        let mut bounds = NO_FORCE;
        for balls in self.balls.as_slice() {
            let errors = balls.tangent_errors(at, states);
            for i in 0..LANES {
                for j in 0..6 {
                    bounds[j] = fma(balls.rate[i][j].abs(), errors[i], bounds[j]);
                }
            }
        }
        for row in self.others.as_slice() {
            let error = row.tangent_error(at, states);
            for j in 0..6 {
                bounds[j] = fma(row.rate[j].abs(), error, bounds[j]);
            }
        }
        bounds
    }

    fn changed_rows(&self, state: &State, other: &State) -> usize {
        let mut count = 0;
        for balls in self.balls.as_slice() {
            let [one, other] = [state, other].map(|state| balls.deflections(state));
            for i in 0..LANES {
                let open = |from_rest: f64| {
                    ball_compressions(balls.opening[i], balls.rest[i] + from_rest).map(|row| row > 0.0)
                };
                count += usize::from(open(one[i]) != open(other[i]));
            }
        }
        for row in self.others.as_slice() {
            let [one, other] =
                [state, other].map(|state| row.link.law().segment_of(row.deflection_at(state)));
            count += usize::from(one != other);
        }
        count
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn tangent(&self, state: &State, at: Instant) -> (Square, Square) {
        let (mut stiffness, mut damping) = self.linear.tangent(state, at);
        let mut found = BallLoads::NONE;
        for balls in self.balls.as_slice() {
            balls.loads(state, &mut found);
            let tangents = &found.slopes;
            for i in 0..LANES {
                for j in 0..6 {
                    let pull = tangents[i] * balls.deflection[j][i];
                    for (entry, rate) in stiffness[j].iter_mut().zip(&balls.rate[i]) {
                        *entry = fma(*rate, pull, *entry);
                    }
                }
            }
        }
        for row in self.others.as_slice() {
            let (_, tangent) = row.beyond_spring(state);
            for j in 0..6 {
                add_scaled(&mut stiffness[j], &row.rate, tangent * row.deflection[j]);
            }
        }
        if !self.riders.is_empty() {
            self.riders.change_tangent(&mut stiffness, &mut damping, at);
        }
        (stiffness, damping)
    }
}
