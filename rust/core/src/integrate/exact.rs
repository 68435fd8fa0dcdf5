//! The exact method: the matrix exponential of the first-order-hold system, for linear scenes.

use super::method::Method;
use super::step_cache::StepCache;
use crate::equations::{Equations, PowerSeries, Propagator, advance};
use crate::excitation::Ramp;
use crate::system::State;

/// Exact propagation from knot to knot; right for defective, overdamped and undamped scenes too.
///
/// An interval length that comes again is stepped over by a propagator, of which `CACHE` are remembered (3 kB each); one that comes once, as
/// all do where time stamps jitter, by the power series of the solution itself, which costs a tenth of a propagator.
#[derive(Debug, Clone, Copy, Default)]
pub struct Exact<const CACHE: usize = 1>;

/// Times that an interval length must have come before a propagator is worth its making: on linear equations once, as it comes then
/// thousands of times; between contact changes it may not.
const SEEN: [u32; 2] = [1, 6];

/// What one run keeps.
#[derive(Debug, Clone)]
pub struct Memory<const CACHE: usize> {
    propagators: StepCache<Propagator, CACHE>,
    /// PowerSeries of the equations with this key.
    series: Option<(u32, PowerSeries)>,
}

impl<const CACHE: usize> Memory<CACHE> {
    #[cfg_attr(feature = "std", inline(always))]
    fn series<E: Equations>(&mut self, equations: &E) -> PowerSeries {
        match self.series {
            Some((key, series)) if key == equations.key() => series,
            _ => {
                let series = PowerSeries::new(equations);
                self.series = Some((equations.key(), series));
                series
            }
        }
    }
}

impl<const CACHE: usize> Method for Exact<CACHE> {
    type Memory = Memory<CACHE>;
    const ERROR_ORDER: Option<u32> = None;

    fn memory(&self) -> Self::Memory {
        Memory { propagators: StepCache::new(), series: None }
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
        let seen = SEEN[usize::from(E::PIECEWISE)];
        let (place, before) = memory.propagators.entry(ramp.h, equations.key());
        if place.is_none() && before < seen {
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

    /// Lengths between knots seldom come again, and must not forcing out those that do: nothing is kept of them.
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
        let series = memory.series(equations);
        advance(equations, &series, &part, state)
    }
}
