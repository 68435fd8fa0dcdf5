//! The monitor: a sample in, loads and totals out.

use crate::flag::Flag;
use crate::input::{Input, Sample};
use crate::movement::Movement;
use crate::prepared::Prepared;
use crate::slow::Slow;
use crate::totals::Totals;
use guideload_life::Real;
use guideload_life::{COMPONENTS, Weighed};
use guideload_life::{Interval, Travel};

/// Periods that one call computes at most: after missing samples the monitor catches up by one period per call.
pub const PERIODS_PER_CALL: u32 = 2;

/// Motion of the axis at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct Motion<T> {
    /// m/s.
    pub velocity: T,
    /// m/s².
    pub acceleration: T,
}

/// The state of a monitor. S, C, N: as in [`Prepared`], whose constants each call needs.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
pub struct Monitor<T, const S: usize, const C: usize, const N: usize> {
    input: Input<T, N>,
    /// Motion, state and loads of the last period; `has_motion` is clear before the first.
    motion: Motion<T>,
    has_motion: Flag,
    state: [T; S],
    loads: [[T; COMPONENTS]; C],
    /// What the rules make of the loads.
    weighed: [Weighed<T>; C],
    slow: Slow<T, S>,
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
        motion: Motion { velocity: T::ZERO, acceleration: T::ZERO },
        has_motion: Flag::CLEAR,
        state: [T::ZERO; S],
        loads: [[T::ZERO; COMPONENTS]; C],
        weighed: [Weighed::ZERO; C],
        slow: Slow::NONE,
        period: 0,
        settling: 0,
        totals: Totals::NONE,
    };

    /// Takes a sample: its time stamp in ticks and the counter of the encoder, both of which may wrap. A pause of 2^31 ticks or more is not
    /// recognised. Computes at most [`PERIODS_PER_CALL`] periods.
    pub fn push(&mut self, prepared: &Prepared<T, S, C, N>, stamp: u32, count: u32) -> Sample {
        let stamp = self.input.widened(stamp);
        self.step(prepared, stamp, count)
    }

    /// As `push`, with a time stamp of 64 bits, by which a pause of any length is known; one of a clock of 32 bits may wrap.
    #[inline(always)]
    pub fn push_wide(&mut self, prepared: &Prepared<T, S, C, N>, stamp: i64, count: u32) -> Sample {
        self.input.wrap(stamp);
        self.step(prepared, stamp, count)
    }

    #[inline(always)]
    fn step(&mut self, prepared: &Prepared<T, S, C, N>, stamp: i64, count: u32) -> Sample {
        let (settings, taps) = (&prepared.input, prepared.tap_count);
        let taken = self.input.accept(settings, taps, &mut self.totals.counters, stamp, count);
        if taken == Sample::Restarted {
            (self.has_motion, self.state, self.settling) = (Flag::CLEAR, [T::ZERO; S], prepared.settling);
        }
        for _ in 0..PERIODS_PER_CALL {
            let Some(window) = self.input.next(taps) else { break };
            let [acceleration, correction] = weighted(window.differences, &prepared.taps);
            let velocity = T::from_i32(window.step) * prepared.speed_of_step + correction;
            let movement = window.movement;
            let behind = u64::from(self.input.pending()) + u64::from(prepared.lag);
            self.period = self.input.clock().wrapping_sub(behind);
            self.advance(prepared, Motion { velocity, acceleration }, movement);
        }
        taken
    }

    /// Goes on by one period to a known motion, in place of a sample.
    pub fn push_motion(&mut self, prepared: &Prepared<T, S, C, N>, motion: Motion<T>) {
        self.period = self.period.wrapping_add(u64::from(self.has_motion.is_set()));
        self.advance(prepared, motion, Movement::Fast);
    }

    /// One period, to a motion.
    #[inline(always)]
    fn advance(&mut self, prepared: &Prepared<T, S, C, N>, motion: Motion<T>, movement: Movement) {
        let before = self.motion();
        (self.motion, self.has_motion) = (motion, Flag::SET);
        if let Some(before) = before {
            self.propagate(prepared, before.acceleration, motion.acceleration);
        }
        let interval = before.map(|before| Interval {
            length: prepared.period,
            velocity: [before.velocity, motion.velocity],
            acceleration: [before.acceleration, motion.acceleration],
        });
        let travel = if movement == Movement::Slow || self.slow.is_going_on() {
            self.slow.take(interval.as_ref().map_or(T::ZERO, Interval::displacement), &self.state);
            if movement == Movement::Fast || self.slow.is_complete(prepared.settling) {
                self.end_slow(prepared);
            }
            None
        } else {
            interval.as_ref().filter(|_| movement == Movement::Fast).map(Travel::new)
        };
        let settled = self.settling == 0;
        self.settling = self.settling.saturating_sub(1);
        let totals = &mut self.totals;
        totals.periods = totals.periods.wrapping_add(1);
        if !settled {
            totals.settling = totals.settling.wrapping_add(1);
        }
        if let Some(travel) = &travel {
            totals.distance.add(travel.path);
        }
        // All loads first, so that a processor can compute several carriages at a time.
        let count = prepared.carriage_count as usize;
        let loads: [[T; COMPONENTS]; C] = core::array::from_fn(|k| {
            if k < count { prepared.carriages[k].load_at(&self.state) } else { [T::ZERO; COMPONENTS] }
        });
        let kept = self.loads.iter_mut().zip(&mut self.weighed).zip(&mut totals.carriages);
        for ((carriage, load), ((last, weighed), totals)) in
            prepared.carriages.iter().zip(&loads).take(count).zip(kept)
        {
            let now = carriage.rule.weigh(load);
            let equivalent = carriage.rule.with_preload(carriage.rule.combined(now.groups));
            if settled {
                totals.take(carriage, load, equivalent, self.period);
            }
            totals.count(carriage.bins_per_load, equivalent);
            if let Some(travel) = &travel {
                let (loads, weighed) = ([&*last, load], [&*weighed, &now]);
                totals.power.add(travel.power(&carriage.rule, &prepared.exponent(), loads, weighed));
            }
            (*last, *weighed) = (*load, now);
        }
    }

    /// Adds slow movement to the totals, under the loads of its mean state.
    #[inline(never)]
    fn end_slow(&mut self, prepared: &Prepared<T, S, C, N>) {
        let (path, state) = self.slow.end();
        self.totals.distance.add(path);
        let carriages = prepared.carriages.iter().take(prepared.carriage_count as usize);
        for (carriage, totals) in carriages.zip(&mut self.totals.carriages) {
            let groups = carriage.rule.weigh(&carriage.load_at(&state)).groups;
            let equivalent = carriage.rule.with_preload(carriage.rule.combined(groups));
            totals.power.add(prepared.exponent().power(equivalent) * path);
        }
    }

    /// The exact step of the state under an acceleration that is linear over the period.
    #[inline(always)]
    fn propagate(&mut self, prepared: &Prepared<T, S, C, N>, start: T, end: T) {
        let state = self.state;
        let mut next: [T; S] = core::array::from_fn(|i| {
            state[i] + (prepared.from_start[i] * start + prepared.from_end[i] * end)
        });
        for j in 0..S {
            let (column, entry) = (&prepared.change[j], state[j]);
            next = core::array::from_fn(|i| next[i] + column[i] * entry);
        }
        self.state = next;
    }

    /// Loads of the carriages: Fy, Fz (N), Mx, My, Mz (N m) about the carriage centre. Zeros before the first period.
    pub fn loads(&self) -> &[[T; COMPONENTS]; C] {
        &self.loads
    }

    /// Estimated motion at the instant of the loads; none before the first period.
    pub fn motion(&self) -> Option<Motion<T>> {
        self.has_motion.is_set().then_some(self.motion)
    }

    /// Number of the period of the loads, from 0 at the first sample; `lag` periods before the last good sample.
    pub fn period(&self) -> u64 {
        self.period
    }

    /// Whether the loads still depend on the state at the last restart, which is not known.
    pub fn is_settling(&self) -> bool {
        !self.has_motion.is_set() || self.settling > 0
    }

    /// Whether state, motion and loads are finite, as they always are with constants that are valid and memory that nobody else writes.
    pub fn is_finite(&self) -> bool {
        let Motion { velocity, acceleration } = self.motion;
        let mut numbers =
            self.loads.as_flattened().iter().chain(&self.state).chain([&velocity, &acceleration]);
        numbers.all(|number| number.is_finite())
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

/// Sums of second differences times the two weights of each. Four sums side by side: each addition of a single sum would wait for the one
/// before.
#[inline(always)]
fn weighted<T: Real, const N: usize>(differences: &[T], [first, second]: &[[T; N]; 2]) -> [T; 2] {
    let (fours, rest) = differences.as_chunks::<4>();
    let weights = first.as_chunks::<4>().0.iter().zip(second.as_chunks::<4>().0);
    let (mut sums, mut others) = ([T::ZERO; 4], [T::ZERO; 4]);
    for (four, (first, second)) in fours.iter().zip(weights) {
        sums = core::array::from_fn(|k| sums[k] + four[k] * first[k]);
        others = core::array::from_fn(|k| others[k] + four[k] * second[k]);
    }
    let weights = first.iter().zip(second).skip(4 * fours.len());
    for (&difference, (&first, &second)) in rest.iter().zip(weights) {
        sums[0] += difference * first;
        others[0] += difference * second;
    }
    [sums, others].map(|[a, b, c, d]| (a + b) + (c + d))
}
