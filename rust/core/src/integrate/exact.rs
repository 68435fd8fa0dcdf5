//! The exact method: the matrix exponential of the first-order-hold system, for linear scenes.

use super::Method;
use super::drive::Ramp;
use super::kept::Kept;
use crate::propagator::{Propagator, Series};
use crate::system::{State, System};

/// Exact propagation from knot to knot; right for defective, overdamped and undamped scenes too.
///
/// An interval length that comes again is stepped over by a propagator, of which `KEPT` are remembered (3 kB each); one that comes once, as
/// all do where time stamps jitter, by the power series of the solution itself, which costs a tenth of a propagator.
#[derive(Debug, Clone, Copy, Default)]
pub struct Exact<const KEPT: usize = 1>;

/// Parts of a series beyond which a propagator costs less.
const LONG_SERIES: f64 = 16.0;

/// What one run keeps.
#[derive(Debug, Clone)]
pub struct Memory<const KEPT: usize> {
    propagators: Kept<Propagator, KEPT>,
    series: Series,
}

impl<const KEPT: usize> Memory<KEPT> {
    /// The state after `h` s under a ramp of that length.
    #[inline(always)]
    fn advance(&mut self, system: &System, ramp: &Ramp, state: &State) -> State {
        let (place, known) = self.propagators.place(ramp.h);
        if place.is_none() && !known && self.series.parts(ramp.h) <= LONG_SERIES {
            return self.series.advance(system, ramp, state);
        }
        if place.is_none() {
            // Not in a closure, which would be compiled for the oldest processor.
            *place = Some(Propagator::new(system, ramp.drive.influence(), ramp.h));
        }
        match place {
            Some(propagator) => propagator.apply(state, ramp.start, ramp.end),
            None => unreachable!("just made"),
        }
    }
}

impl<const KEPT: usize> Method for Exact<KEPT> {
    type Memory = Memory<KEPT>;
    const ERROR_ORDER: Option<u32> = None;

    fn memory(&self, system: &System) -> Self::Memory {
        Memory { propagators: Kept::new(), series: Series::new(system) }
    }

    #[inline(always)]
    fn step(&self, system: &System, memory: &mut Self::Memory, ramp: &Ramp, state: &State) -> (State, State) {
        (memory.advance(system, ramp, state), [0.0; 12])
    }

    #[inline(always)]
    fn between(
        &self,
        system: &System,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
        theta: f64,
    ) -> State {
        if theta == 0.0 {
            return *state;
        }
        // Lengths between knots seldom come again, and must not drive out those that do.
        let end = ramp.values(theta);
        let part = Ramp { h: theta * ramp.h, start: ramp.start, end: &end, drive: ramp.drive };
        if memory.series.parts(part.h) <= LONG_SERIES {
            return memory.series.advance(system, &part, state);
        }
        Propagator::new(system, ramp.drive.influence(), part.h).apply(state, part.start, part.end)
    }
}
