//! Exact: the matrix exponential of the first-order-hold system, for linear equations.

use super::exact_steps::{Block, ExactSteps};
use super::method::Method;
use super::step_cache::{SeriesCache, StepCache};
use crate::equations::{Equations, LongStep, Propagator, TwoSteps, advance};
use crate::excitation::{Forcing, Ramp};
use crate::numeric::on_heap::{OnHeap, on_heap};
use crate::system::State;

/// Exact propagation from sample to sample, also for defective, overdamped and undamped scenes.
///
/// Intervals of a recurring length use a cached propagator; the cache holds 16 of them (3 kB each), and one without `std`. With `std` each
/// may have two steps at once (3 kB, and 0.8 kB for each component of the excitation) and, for records that do not need all instants, a
/// long step (4 kB, and 3 kB for each component); a run takes 6 kB more for a block of steps. Intervals of other lengths, which is all of them
/// where time stamps jitter, use the power series of the solution, at a fraction of the cost of computing a propagator.
#[derive(Debug, Clone, Copy, Default)]
pub struct Exact;

/// Cached propagators of a run: device clocks tick in a handful of interval lengths.
pub(super) const CACHED_STEPS: usize = if cfg!(feature = "std") { 16 } else { 1 };

/// Earlier requests for a long step before it is prepared, which takes as long as some hundred steps: for linear equations, and between contact
/// changes.
const MIN_REQUESTS: [u32; 2] = [0, 2];

/// Memory of one run.
#[derive(Debug, Clone)]
pub struct Memory {
    propagators: StepCache<Propagator, CACHED_STEPS>,
    two_steps: StepCache<OnHeap<TwoSteps>, CACHED_STEPS>,
    block: Block,
    long_steps: StepCache<OnHeap<LongStep>, CACHED_STEPS>,
    series: SeriesCache,
}

impl Method for Exact {
    type Memory = Memory;
    const ERROR_ORDER: Option<u32> = None;
    const STABLE: bool = true;

    fn memory(&self) -> Self::Memory {
        Memory {
            propagators: StepCache::new(),
            two_steps: StepCache::new(),
            block: Block::EMPTY,
            long_steps: StepCache::new(),
            series: SeriesCache::default(),
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn step<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
    ) -> (State, State) {
        if !ramp.spans_interval {
            return (self.between(equations, memory, ramp, state, 1.0), [0.0; 12]);
        }
        // A length that occurs for the first time may not recur.
        let (place, before) = memory.propagators.entry(ramp.h, equations.key());
        if place.is_none() && before == 0 {
            return (self.between(equations, memory, ramp, state, 1.0), [0.0; 12]);
        }
        if place.is_none() {
            // Not in a closure, which would be compiled for the oldest processor.
            *place = Some(Propagator::new(equations, ramp.forcing.influence(), ramp.h));
        }
        match place {
            Some(propagator) => (propagator.apply(state, ramp.start, ramp.end), [0.0; 12]),
            None => unreachable!("just made"),
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn exact_steps<'m>(&self, memory: &'m mut Self::Memory, h: f64, key: u32) -> Option<ExactSteps<'m>> {
        let one = memory.propagators.ready(h, key)?;
        let (two, _) = memory.two_steps.entry(h, key);
        if cfg!(feature = "std") && two.is_none() {
            *two = on_heap(TwoSteps::new(one));
        }
        Some(ExactSteps { one, two: two.as_deref(), block: &mut memory.block })
    }

    #[inline(always)]
    fn long_step<'m, E: Equations>(
        &self,
        memory: &'m mut Self::Memory,
        equations: &E,
        forcing: &Forcing,
        h: f64,
    ) -> Option<&'m LongStep> {
        let step = memory.propagators.ready(h, equations.key())?;
        let (long_step, before) = memory.long_steps.entry(h, equations.key());
        if long_step.is_none() && before == MIN_REQUESTS[usize::from(E::PIECEWISE)] {
            *long_step = LongStep::new(equations, step, forcing, h);
        }
        long_step.as_deref()
    }

    /// Lengths within an interval seldom recur and must not displace those that do, so they are not cached.
    #[cfg_attr(feature = "std", inline(always))]
    fn between<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
        theta: f64,
    ) -> State {
        if theta == 0.0 {
            return *state;
        }
        let end = ramp.values(theta);
        let part = Ramp { h: theta * ramp.h, end: &end, ..*ramp };
        let series = memory.series.of(equations);
        advance(equations, &series, &part, state)
    }
}
