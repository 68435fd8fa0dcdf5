//! The equations of a scene with preloaded laws or moving riders, which are evaluated at every state.

use super::ball_links::{BallLinks, BallLoads};
use super::piecewise::SegmentEquations;
use super::riding::{Riders, StageData};
use super::{Equations, Remainder};
use crate::excitation::{Excitation, Instant, Ramp};
use crate::model::ball_compressions;
use crate::numeric::bounded_vec::{BoundedVec, MAX_LINKS};
use crate::numeric::float::{add_scaled, fma};
use crate::numeric::simd::LANES;
use crate::system::{Force, LinkRow, NO_FORCE, Square, State, StateBox, System};

/// Equations with preloaded links. The linear part contains the links with straight segments, each on its present one, the preloaded links
/// with their stiffness at rest, and all dampers. To it, preloaded links add their loads less those at rest and less that stiffness times
/// the deflection from rest, so a body at rest stays at rest but for rounding of the preloads.
#[derive(Debug)]
pub(crate) struct SmoothEquations<'a> {
    linear: SegmentEquations,
    /// Links with preloaded balls, the common case, eight at a time.
    balls: BoundedVec<BallLinks, { MAX_LINKS / LANES }>,
    /// Links with other preloaded rolling elements.
    others: BoundedVec<&'a LinkRow>,
    riders: Riders<'a>,
}

/// Weight of the open rows of earlier links; no sums of whole numbers below ten cancel with it.
pub(super) const SIGNATURE_FACTOR: f64 = 0.9;

impl<'a> SmoothEquations<'a> {
    /// The equations of a system without straight segments and riders.
    pub(crate) fn at_rest(system: &'a System, excitation: &'a Excitation<'a>) -> Self {
        let linear = SegmentEquations::of_linear_links(system);
        let linear = linear.with_links(system, |row| row.link.law().segment_of(row.rest));
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
    pub(super) fn balls(&self) -> &[BallLinks] {
        self.balls.as_slice()
    }

    /// Whether all preloaded links have balls.
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
    fn prepare(&self, ramp: &Ramp, nodes: &[f64], stage_data: &mut StageData) {
        if !self.riders.is_empty() {
            self.riders.prepare(ramp.begin, ramp.h, nodes, stage_data);
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn rate(&self, state: &State, force: &Force, at: (&StageData, usize)) -> State {
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
        let ([mut force, mut second, mut rate, mut second_rate], mut contact_signature) =
            ([NO_FORCE; 4], 0.0);
        let mut found = BallLoads::NONE;
        let mut moving = [0.0; 12];
        for i in 0..6 {
            moving[i] = self.frequency()[i] * state[6 + i];
        }
        for balls in self.balls.as_slice() {
            balls.load_rates(state, &moving, &mut found);
            let BallLoads { loads, slopes: rates, contact_signature: open } = &found;
            for i in (0..LANES).step_by(2) {
                add_scaled(&mut force, &balls.rate[i], -loads[i]);
                add_scaled(&mut rate, &balls.rate[i], -rates[i]);
                add_scaled(&mut second, &balls.rate[i + 1], -loads[i + 1]);
                add_scaled(&mut second_rate, &balls.rate[i + 1], -rates[i + 1]);
            }
            contact_signature = fma(contact_signature, SIGNATURE_FACTOR, *open);
        }
        for row in self.others.as_slice() {
            let (load, slope) = row.beyond_spring(state);
            let load_rate = slope * (row.deflection_at(&moving) - row.rest);
            for j in 0..6 {
                force[j] -= row.rate[j] * load;
                rate[j] -= row.rate[j] * load_rate;
            }
            contact_signature = fma(contact_signature, SIGNATURE_FACTOR, row.segment_at(state) as f64 - 1.0);
        }
        add_scaled(&mut force, &second, 1.0);
        add_scaled(&mut rate, &second_rate, 1.0);
        Remainder { force, rate, contact_signature }
    }

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
            count += usize::from(row.segment_at(state) != row.segment_at(other));
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
