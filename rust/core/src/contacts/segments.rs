//! The present segment of each nonlinear link, and the linear equations that hold while none of them changes.

use super::block::{LinkBlock, NO_LINKS};
use crate::equations::{Equations, LongStepBounds, PowerSeries, SegmentEquations, growth, growth_rate};
use crate::excitation::Ramp;
use crate::numeric::bounded_vec::{BoundedVec, MAX_LINKS};
use crate::numeric::float::{add_scaled, norm};
use crate::numeric::simd::LANES;
use crate::system::{Force, LinkRow, NO_FORCE, State, System, energy_norm};

/// Combinations of segments whose equations are cached.
const CACHED_COMBINATIONS: usize = if cfg!(feature = "std") { 32 } else { 4 };

/// Tolerance of an edge, relative to the deflections of the run: some hundred roundings. A link counts as beyond its edge if it exceeds the
/// edge by more than this. The error of the load is no larger, and rounding alone cannot move a link back across an edge.
const EDGE_TOLERANCE: f64 = 1e-13;

/// The next contact change of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Change {
    /// Fraction of the step at which it happens.
    pub theta: f64,
    /// The link that passes an edge, and whether upwards; none if the search stopped before it found one.
    pub crossing: Option<(usize, bool)>,
}

/// The equations of one combination of segments.
#[derive(Debug, Clone, Copy)]
pub(super) struct Combination {
    pub equations: SegmentEquations,
    pub series: PowerSeries,
    /// Bound on the logarithmic norm of A, 1/s.
    growth_rate: f64,
}

/// The present segments of all nonlinear links.
#[derive(Debug, Clone)]
pub(super) struct Segments<'a, const CACHED: usize = CACHED_COMBINATIONS> {
    system: &'a System,
    /// Index of each nonlinear link in the system, and its present segment.
    links: BoundedVec<(usize, u8)>,
    pub blocks: BoundedVec<LinkBlock, { MAX_LINKS / LANES }>,
    /// Equations of the linear links alone.
    linear: SegmentEquations,
    pub current: Combination,
    /// The last combinations of straight segments.
    cache: [Option<(BoundedVec<u8>, Combination)>; CACHED],
    /// Number of combinations made so far; the key of the last one.
    combinations: u32,
}

impl<'a, const CACHED: usize> Segments<'a, CACHED> {
    /// The segments in `state`. `load_scale`: size of the loads, N; `slack`: tolerance of a load beyond an edge, over the load scale.
    pub(super) fn new(system: &'a System, state: &State, load_scale: f64, slack: f64) -> Self {
        let count = system.nonlinear().count();
        let mut links = BoundedVec::filled((0, 0), count);
        let mut blocks = BoundedVec::filled(NO_LINKS, count.div_ceil(LANES));
        for (place, (index, row)) in system.nonlinear().enumerate() {
            let law = row.link.law();
            links.as_mut_slice()[place] = (index, row.segment_at(state) as u8);
            let (block, lane) = (&mut blocks.as_mut_slice()[place / LANES], place % LANES);
            for j in 0..6 {
                block.deflection[j][lane] = row.deflection[j];
                block.rate[j][lane] = row.rate[j];
            }
            block.norm[lane] = norm(&row.deflection);
            let edges = law.edges().iter().fold(row.rest.abs(), |most, edge| f64::max(most, edge.abs()));
            let largest = load_scale / law.nominal();
            block.tolerance[lane] = f64::max(EDGE_TOLERANCE * (edges + largest), slack * largest);
        }
        let linear = SegmentEquations::of_linear_links(system);
        Self {
            system,
            links,
            blocks,
            linear,
            current: Combination { equations: linear, series: PowerSeries::new(&linear), growth_rate: 0.0 },
            cache: [const { None }; CACHED],
            combinations: 0,
        }
    }

    /// Moves the link that passed an edge in `state` to its next segment, and with it all links that are at their edges too, as in a
    /// symmetric machine. Returns the number of links that changed.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn cross(&mut self, state: &State, (crossed, up): (usize, bool)) -> usize {
        let segment = &mut self.links.as_mut_slice()[crossed].1;
        *segment = if up { *segment + 1 } else { *segment - 1 };
        let mut changes = 1;
        for link in (0..self.links.as_slice().len()).filter(|&link| link != crossed) {
            let (block, lane) = (&self.blocks.as_slice()[link / LANES], link % LANES);
            let (at, moving) = (block.deflections(state)[lane], block.rates(state)[lane]);
            let tolerance = block.tolerance[lane];
            let segment = &mut self.links.as_mut_slice()[link].1;
            // Compared as differences: where there is no edge they are infinite, or NaN for an infinite state, and the test fails.
            if block.high[lane] - at <= tolerance && moving > 0.0 {
                *segment += 1;
            } else if at - block.low[lane] <= tolerance && moving < 0.0 {
                *segment -= 1;
            } else {
                continue;
            }
            changes += 1;
        }
        changes
    }

    /// Index of each nonlinear link in the system, and its present segment.
    pub(super) fn present(&self) -> &[(usize, u8)] {
        self.links.as_slice()
    }

    /// How much later than in `state` a link is where it counts as past its upper (`up`) or lower edge, s; none if it is there within half
    /// the tolerance of the edge, or does not move there.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn missed_by(&self, state: &State, (link, up): (usize, bool)) -> Option<f64> {
        let index = self.links.as_slice()[link].0;
        if !self.system.rows()[index].link.law().is_piecewise_linear() {
            // The same equations hold on either side.
            return None;
        }
        let (block, lane) = (&self.blocks.as_slice()[link / LANES], link % LANES);
        let tolerance = block.tolerance[lane];
        let goal = if up { block.high[lane] + tolerance } else { block.low[lane] - tolerance };
        let (left, moving) = (goal - block.deflections(state)[lane], block.rates(state)[lane]);
        (left.abs() > 0.5 * tolerance && (moving > 0.0) == up && moving != 0.0).then(|| left / moving)
    }

    /// Whether a link with a smooth law would reach an edge within `time` at its present rate.
    pub(super) fn nears_smooth_edge(&self, time: f64, state: &State) -> bool {
        let rows = self.system.rows();
        self.blocks.as_slice().iter().zip(self.links.as_slice().chunks(LANES)).any(|(block, links)| {
            let (at, moving) = (block.deflections(state), block.rates(state));
            links.iter().enumerate().any(|(lane, &(index, _))| {
                let travel = time * moving[lane];
                // Without motion, or without an edge on that side, the comparison fails.
                let nears = travel > 0.0 && block.high[lane] - at[lane] <= travel
                    || travel < 0.0 && at[lane] - block.low[lane] <= -travel;
                nears && !rows[index].link.law().is_piecewise_linear()
            })
        })
    }

    /// Sets edges and equations to those of the present segments.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn update(&mut self) {
        for (link, &(index, segment)) in self.links.as_slice().iter().enumerate() {
            let row = &self.system.rows()[index];
            let edges = row.link.law().edges();
            let edge = |i: usize, none: f64| edges.get(i).map_or(none, |edge| edge - row.rest);
            let (block, lane) = (&mut self.blocks.as_mut_slice()[link / LANES], link % LANES);
            block.low[lane] = edge((segment as usize).wrapping_sub(1), f64::NEG_INFINITY);
            block.high[lane] = edge(segment as usize, f64::INFINITY);
        }
        let rows = self.system.rows();
        let straight = |&(index, segment): &(usize, u8)| {
            if rows[index].link.law().is_piecewise_linear() { segment } else { 0 }
        };
        let same = |segments: &BoundedVec<u8>| {
            segments
                .as_slice()
                .iter()
                .zip(self.links.as_slice())
                .all(|(known, link)| *known == straight(link))
        };
        if let Some((_, known)) = self.cache.iter().flatten().find(|(segments, _)| same(segments)) {
            self.current = *known;
            return;
        }
        self.combinations += 1;
        self.current = self.combine(self.combinations);
        let mut segments = BoundedVec::filled(0, self.links.as_slice().len());
        for (to, from) in segments.as_mut_slice().iter_mut().zip(self.links.as_slice()) {
            *to = straight(from);
        }
        self.cache[self.combinations as usize % CACHED] = Some((segments, self.current));
    }

    /// The equations of the present segments, under the key `key`.
    #[cfg_attr(feature = "std", inline(always))]
    fn combine(&self, key: u32) -> Combination {
        let mut segments = self.links.as_slice().iter();
        let segment = |_: &LinkRow| segments.next().map_or(0, |(_, segment)| *segment as usize);
        let equations = self.linear.with_links(self.system, segment);
        let equations = equations.with_key(key);
        Combination { equations, series: PowerSeries::new(&equations), growth_rate: growth_rate(&equations) }
    }

    /// Whether no link passes an edge within a step of length `h` between two states, if the second derivative of the state stays below
    /// `curvature`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn ends_clear(&self, h: f64, state: &State, next: &State, curvature: f64) -> bool {
        let margin = bow(h, curvature);
        let mut clear = margin < f64::INFINITY;
        for block in self.blocks.as_slice() {
            clear = clear && block.ends_clear(state, next, margin);
        }
        clear
    }

    /// Whether no link passes an edge within these bounds.
    #[inline(always)]
    pub(super) fn box_clear(&self, bounds: &LongStepBounds) -> bool {
        let mut clear = true;
        for block in self.blocks.as_slice() {
            clear = clear && block.box_clear(&bounds.samples, bounds.bow);
        }
        clear
    }

    /// How far a state may be from this one in `ω η` while no link is past an edge.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn slack(&self, state: &State) -> f64 {
        let mut slack = f64::INFINITY;
        for block in self.blocks.as_slice() {
            let least = block.slack(state);
            slack = if least < slack { least } else { slack };
        }
        slack
    }

    /// Whether no link passes an edge within a step of length `h`, judged by the cubics through its ends and a bound on the fourth derivative.
    /// `second`: second derivative of the state at the start.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn cubics_clear(&self, h: f64, [state, next]: [&State; 2], second: &State) -> bool {
        // The fourth derivative, too, follows the equations without force.
        let third = self.current.equations.linear(second, &NO_FORCE);
        let fourth = self.growth(h) * energy_norm(&self.current.equations.linear(&third, &NO_FORCE));
        let margin = h * h * (h * h) / 384.0 * fourth;
        let mut clear = margin < f64::INFINITY;
        for block in self.blocks.as_slice() {
            clear = clear && block.cubics_clear(h, state, next, margin);
        }
        clear
    }

    /// Second derivative of the state at the start of a step. As the force is linear in time, it then follows the equations without force.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn second_derivative(&self, ramp: &Ramp, state: &State) -> State {
        let rate = self.current.equations.linear(state, &self.force(ramp, 0.0));
        let mut rise = ramp.rise();
        for entry in &mut rise {
            *entry /= ramp.h;
        }
        self.current.equations.linear(&rate, &rise)
    }

    /// Bound on the growth of a state without force in a time h.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn growth(&self, h: f64) -> f64 {
        growth(self.current.growth_rate, h)
    }

    /// Modal force that does not depend on the state: excitation and constant.
    #[cfg_attr(feature = "std", inline(always))]
    fn force(&self, ramp: &Ramp, theta: f64) -> Force {
        let mut force = ramp.force(theta);
        add_scaled(&mut force, self.current.equations.constant(), 1.0);
        force
    }
}

/// Largest distance of a path from the straight line through its ends, if its second derivative stays below `curvature`.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn bow(h: f64, curvature: f64) -> f64 {
    0.125 * h * h * curvature
}
