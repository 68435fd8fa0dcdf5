//! The monitor: a sample in, loads and totals out.

use crate::input::{Input, Sample};
use crate::prepared::Prepared;
use crate::real::Real;
use crate::rule::COMPONENTS;
use crate::totals::Totals;
use crate::travel::{Interval, Travel};

/// Periods that one call computes at most: after missing samples the monitor catches up by one period per call.
pub const PERIODS_PER_CALL: u32 = 2;

/// Motion of the axis at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Motion<T> {
    /// m/s.
    pub velocity: T,
    /// m/s².
    pub acceleration: T,
}

/// The state of a monitor. S, C, N: as in [`Prepared`], whose constants each call needs.
#[derive(Debug, Clone)]
pub struct Monitor<T, const S: usize, const C: usize, const N: usize> {
    input: Input<N>,
    /// Motion, state and loads of the last period; none before the first.
    motion: Option<Motion<T>>,
    state: [T; S],
    loads: [[T; COMPONENTS]; C],
    /// Number of the period of the loads.
    period: u64,
    /// Periods left until the loads do not depend on the start.
    settling: u32,
    totals: Totals<T, C>,
}

impl<T: Real, const S: usize, const C: usize, const N: usize> Monitor<T, S, C, N> {
    /// A monitor that has seen nothing, on a machine at rest.
    pub const NEW: Self = Self {
        input: Input::NEW,
        motion: None,
        state: [T::ZERO; S],
        loads: [[T::ZERO; COMPONENTS]; C],
        period: 0,
        settling: 0,
        totals: Totals::NONE,
    };

    /// Takes a sample: its time stamp in ticks and the counter of the encoder, both of which may wrap. Computes at most
    /// [`PERIODS_PER_CALL`] periods.
    pub fn push(&mut self, prepared: &Prepared<T, S, C, N>, stamp: u32, count: u32) -> Sample {
        let (settings, taps) = (&prepared.input, prepared.tap_count);
        let taken = self.input.accept::<T>(settings, taps, &mut self.totals.counters, stamp, count);
        if taken == Sample::Restarted {
            (self.motion, self.state, self.settling) = (None, [T::ZERO; S], prepared.settling);
        }
        for _ in 0..PERIODS_PER_CALL {
            let Some(window) = self.input.next(taps) else { break };
            // Two sums side by side: each addition of a single sum would wait for the one before.
            let (mut even, mut odd) = ([T::ZERO; 2], [T::ZERO; 2]);
            let (pairs, rest) = window.differences.as_chunks::<2>();
            let (taps_of_pairs, _) = prepared.taps.as_chunks::<2>();
            for (pair, taps) in pairs.iter().zip(taps_of_pairs) {
                let [first, second] = pair.map(T::from_i32);
                even = [even[0] + first * taps[0][0], even[1] + first * taps[0][1]];
                odd = [odd[0] + second * taps[1][0], odd[1] + second * taps[1][1]];
            }
            for (&difference, tap) in rest.iter().zip(prepared.taps.iter().skip(2 * pairs.len())) {
                let difference = T::from_i32(difference);
                even = [even[0] + difference * tap[0], even[1] + difference * tap[1]];
            }
            let acceleration = even[0] + odd[0];
            let velocity = T::from_i32(window.step) * prepared.speed_of_step + (even[1] + odd[1]);
            let moves = window.moves;
            let behind = u64::from(self.input.pending()) + u64::from(prepared.lag);
            self.period = self.input.clock().wrapping_sub(behind);
            self.advance(prepared, Motion { velocity, acceleration }, moves);
        }
        taken
    }

    /// Goes on by one period to a known motion, in place of a sample.
    pub fn push_motion(&mut self, prepared: &Prepared<T, S, C, N>, motion: Motion<T>) {
        self.period = self.period.wrapping_add(u64::from(self.motion.is_some()));
        self.advance(prepared, motion, true);
    }

    /// One period, to a motion. `moves`: whether the axis travels, or what looks like travel is noise.
    fn advance(&mut self, prepared: &Prepared<T, S, C, N>, motion: Motion<T>, moves: bool) {
        let before = self.motion.replace(motion);
        if let Some(before) = before {
            self.propagate(prepared, before.acceleration, motion.acceleration);
        }
        let interval = before.filter(|_| moves).map(|before| Interval {
            length: prepared.period,
            velocity: [before.velocity, motion.velocity],
            acceleration: [before.acceleration, motion.acceleration],
        });
        let travel = interval.as_ref().map(Travel::new);
        let settled = self.settling == 0;
        self.settling = self.settling.saturating_sub(1);
        let totals = &mut self.totals;
        totals.periods = totals.periods.wrapping_add(1);
        totals.settling = totals.settling.wrapping_add(u64::from(!settled));
        if let Some(travel) = &travel {
            totals.distance.add(travel.path);
        }
        let carriages = prepared.carriages.iter().take(prepared.carriage_count as usize);
        for ((carriage, load), totals) in carriages.zip(&mut self.loads).zip(&mut totals.carriages) {
            let now = carriage.load_at(&self.state);
            let last = core::mem::replace(load, now);
            let groups = carriage.rule.groups(&now);
            let equivalent = carriage.rule.raised(carriage.rule.combined(groups));
            if settled {
                totals.take(carriage, &now, equivalent, self.period);
            }
            totals.count(carriage.bins_per_load, equivalent);
            if let Some(travel) = &travel {
                totals.power.add(travel.power(&carriage.rule, prepared.exponent, [&last, &now]));
            }
        }
    }

    /// The exact step of the state under an acceleration that is linear over the period.
    fn propagate(&mut self, prepared: &Prepared<T, S, C, N>, start: T, end: T) {
        let mut next = self.state;
        for ((value, &from_start), &from_end) in
            next.iter_mut().zip(&prepared.from_start).zip(&prepared.from_end)
        {
            *value += from_start * start + from_end * end;
        }
        for (column, &entry) in prepared.change.iter().zip(&self.state) {
            for (value, &factor) in next.iter_mut().zip(column) {
                *value += factor * entry;
            }
        }
        self.state = next;
    }

    /// Loads of the carriages: Fy, Fz (N), Mx, My, Mz (N m) about the carriage centre. Zeros before the first period.
    pub fn loads(&self) -> &[[T; COMPONENTS]; C] {
        &self.loads
    }

    /// Estimated motion at the instant of the loads; none before the first period.
    pub fn motion(&self) -> Option<Motion<T>> {
        self.motion
    }

    /// Number of the period of the loads, from 0 at the first sample; `lag` periods before the last good sample.
    pub fn period(&self) -> u64 {
        self.period
    }

    /// Whether the loads still depend on the state at the last restart, which is not known.
    pub fn is_settling(&self) -> bool {
        self.motion.is_none() || self.settling > 0
    }

    /// Extremes, sums, histograms and counts.
    pub fn totals(&self) -> &Totals<T, C> {
        &self.totals
    }

    /// Goes on with totals that were saved. Call it before the first sample.
    pub(crate) fn set_totals(&mut self, totals: Totals<T, C>, clock: u64) {
        self.totals = totals;
        self.input.set_clock(clock);
    }

    /// Number of the period of the last good sample.
    pub(crate) fn clock(&self) -> u64 {
        self.input.clock()
    }
}
