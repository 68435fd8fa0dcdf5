//! The exact method: matrix exponential of the first-order-hold system, for linear scenes.

use super::Method;
use super::drive::{Drive, Ramp};
use crate::propagator::Propagator;
use crate::system::{State, System};

/// Exact propagation from knot to knot; right for defective, overdamped and undamped scenes too.
///
/// `KEPT` propagators are remembered, one per interval length: one serves a uniform trace, a few a device clock that counts in ticks
/// (2.3 kB each).
#[derive(Debug, Clone, Copy, Default)]
pub struct Exact<const KEPT: usize = 1>;

/// The propagators of one run.
#[derive(Debug, Clone)]
pub struct Propagators<const KEPT: usize> {
    kept: [Option<(f64, Propagator)>; KEPT],
    last: usize,
}

impl<const KEPT: usize> Propagators<KEPT> {
    /// The propagator over `h` s.
    #[inline(always)]
    fn over(&mut self, system: &System, drive: &Drive, h: f64) -> &Propagator {
        if !matches!(self.kept[self.last], Some((length, _)) if length == h) {
            self.find_or_make(system, drive, h);
        }
        match &self.kept[self.last] {
            Some((_, propagator)) => propagator,
            None => unreachable!("just made"),
        }
    }

    // Inlined, so that it is compiled for the same processor as the loop that calls it.
    #[inline(always)]
    fn find_or_make(&mut self, system: &System, drive: &Drive, h: f64) {
        let same = |kept: &Option<(f64, Propagator)>| matches!(kept, Some((length, _)) if *length == h);
        if let Some(found) = self.kept.iter().position(same) {
            self.last = found;
        } else {
            self.last = (self.last + 1) % KEPT;
            self.kept[self.last] = Some((h, Propagator::new(system, drive.influence(), h)));
        }
    }
}

impl<const KEPT: usize> Method for Exact<KEPT> {
    type Memory = Propagators<KEPT>;
    const ERROR_ORDER: Option<u32> = None;

    fn memory(&self, _: &System) -> Self::Memory {
        Propagators { kept: [None; KEPT], last: 0 }
    }

    #[inline(always)]
    fn step(&self, system: &System, memory: &mut Self::Memory, ramp: &Ramp, state: &State) -> (State, State) {
        (memory.over(system, ramp.drive, ramp.h).apply(state, ramp.start, ramp.end), [0.0; 12])
    }

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
        memory.over(system, ramp.drive, theta * ramp.h).apply(state, ramp.start, &ramp.values(theta))
    }
}
