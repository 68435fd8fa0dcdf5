//! The equations of a scene with preloaded laws or moving riders, which are evaluated at every state.

use super::Equations;
use super::piecewise::SegmentEquations;
use super::riding::{Moments, Riders};
use crate::excitation::{Instant, Ramp};
use crate::model::{ball_compressions, ball_force};
use crate::numeric::bounded_vec::{BoundedVec, MAX_LINKS};
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::numeric::simd::{Kernel, LANES, Lanes, dispatch};
use crate::system::{Force, LinkRow, NO_FORCE, Square, State, System};

/// Equations with preloaded links. The linear part contains the links with straight segments, each on its present one, and all dampers.
/// Preloaded links enter by their loads minus those at rest, so a body at rest stays at rest to the last bit.
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
struct BallLinks {
    deflection: [Lanes; 6],
    /// Modal force per unit of load of each link.
    rate: [Force; LANES],
    rest: Lanes,
    opening: Lanes,
    coefficient: Lanes,
    /// Load at rest, N, computed by `loads`.
    load: Lanes,
}

impl BallLinks {
    const NONE: Self = Self {
        deflection: [[0.0; LANES]; 6],
        rate: [NO_FORCE; LANES],
        rest: [0.0; LANES],
        opening: [1.0; LANES],
        coefficient: [0.0; LANES],
        load: [0.0; LANES],
    };

    fn set(&mut self, lane: usize, row: &LinkRow, [opening, coefficient]: [f64; 2]) {
        for j in 0..6 {
            self.deflection[j][lane] = row.deflection[j];
            self.rate[lane][j] = row.rate[j];
        }
        self.rest[lane] = row.rest;
        self.opening[lane] = opening;
        self.coefficient[lane] = coefficient;
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn deflections(&self, state: &State) -> Lanes {
        let mut at = self.rest;
        for j in 0..6 {
            add_scaled(&mut at, &self.deflection[j], state[j]);
        }
        at
    }

    /// Loads above those at rest, N.
    ///
    /// Out of line: where the loads are used one by one at once, the compiler makes vectors of only two of them.
    #[inline(never)]
    fn loads(&self, state: &State, loads: &mut Lanes) {
        dispatch(LoadsKernel { balls: self, state, loads });
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn tangents(&self, state: &State) -> Lanes {
        let mut at = self.deflections(state);
        for i in 0..LANES {
            let [a, b] = ball_compressions(self.opening[i], at[i]);
            at[i] = 1.5 * self.coefficient[i] * (sqrt(a) + sqrt(b));
        }
        at
    }
}

/// [`BallLinks::loads`] as a kernel.
struct LoadsKernel<'a> {
    balls: &'a BallLinks,
    state: &'a State,
    loads: &'a mut Lanes,
}

impl Kernel for LoadsKernel<'_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Self { balls, state, loads } = self;
        // In a local array, because the compiler makes no vectors of stores that might change what is read.
        let mut at = balls.deflections(state);
        for i in 0..LANES {
            at[i] = fma(balls.coefficient[i], ball_force(balls.opening[i], at[i]), -balls.load[i]);
        }
        *loads = at;
    }
}

impl<'a> SmoothEquations<'a> {
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
        let mut at_rest = [0.0; LANES];
        for balls in balls.as_mut_slice() {
            balls.loads(&[0.0; 12], &mut at_rest);
            balls.load = at_rest;
        }
        let mut others = BoundedVec::filled(&rows[0], rows.iter().filter(is_other).count());
        for (to, row) in others.as_mut_slice().iter_mut().zip(rows.iter().filter(is_other)) {
            *to = row;
        }
        Self { linear, balls, others, riders }
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
        let (mut pull, mut loads) = (NO_FORCE, [0.0; LANES]);
        for balls in self.balls.as_slice() {
            balls.loads(state, &mut loads);
            for i in 0..LANES {
                add_scaled(&mut pull, &balls.rate[i], loads[i]);
            }
        }
        for j in 0..6 {
            rate[6 + j] -= pull[j];
        }
        for row in self.others.as_slice() {
            let load = row.link.law().force(row.deflection_at(state)) - row.load;
            for j in 0..6 {
                rate[6 + j] -= row.rate[j] * load;
            }
        }
        if !self.riders.is_empty() {
            self.riders.change(&mut rate, state, at.0, at.1);
        }
        rate
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn tangent(&self, state: &State, at: Instant) -> (Square, Square) {
        let (mut stiffness, mut damping) = self.linear.tangent(state, at);
        for balls in self.balls.as_slice() {
            let tangents = balls.tangents(state);
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
            let tangent = row.link.law().tangent(row.deflection_at(state));
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
