//! From samples of the encoder to second differences of the position on the grid of periods, with missing and wrong samples bridged.

use crate::flag::Flag;
use crate::movement::{Movement, Movements};
use crate::prepared::{FRACTION, InputSettings};
use guideload_life::Real;

/// Periods by which a stamp may lie before the last one and be called early; farther back, the clock was set back.
const EARLIEST: u32 = 16;

/// Most ticks per period: a sample of the next period, late by up to half of it, must not look early, as stamps have 32 bits.
pub(crate) const MOST_TICKS: u32 = u32::MAX / (EARLIEST + 2);

/// The grid follows the stamps by 1/2^6 of their deviation, so it lies on parts of a tick of this size.
const FOLLOWED: u32 = 6;

/// Range of a clock of 32 bits, ticks.
const RANGE: i64 = 1 << 32;

/// What became of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Sample {
    /// It was used.
    Used = 0,
    /// It came too soon after the one before, and was ignored.
    Early = 1,
    /// It does not fit the motion: the next ones decide.
    Suspect = 2,
    /// It was used, and missing or wrong samples before it were bridged.
    Bridged = 3,
    /// The counter was set to another value; the motion goes on from it.
    CounterSet = 4,
    /// Too many samples were missing or wrong: the monitor starts again from rest.
    Restarted = 5,
}

/// How often something happened to the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct Counters {
    /// Samples that came in.
    pub samples: u64,
    /// Periods without a sample that were bridged.
    pub missing: u64,
    /// Samples that came too soon and were ignored.
    pub early: u64,
    /// Samples away from their period by more than the tolerance.
    pub jittering: u64,
    /// Samples that repeat the counter while the axis must be moving.
    pub stuck: u64,
    /// Other samples that no possible motion explains.
    pub jumps: u64,
    /// Wraps of the counter.
    pub wraps: u64,
    /// Times that the counter was set to another value.
    pub counter_set: u64,
    /// Restarts, the first start among them.
    pub restarts: u64,
    /// Periods of which the loads are unknown, as too many samples were missing or wrong; one for a clock that was set back.
    pub lost: u64,
}

impl Counters {
    /// Nothing so far.
    pub const NONE: Self = Self {
        samples: 0,
        missing: 0,
        early: 0,
        jittering: 0,
        stuck: 0,
        jumps: 0,
        wraps: 0,
        counter_set: 0,
        restarts: 0,
        lost: 0,
    };
}

/// A count, and the position on the grid less this count, in sixteenths of a count.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
struct Reading {
    count: u32,
    offset: i32,
}

/// A sample that does not fit, and the periods since the last good one; 0: there is none.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
struct Suspect {
    reading: Reading,
    periods: u32,
}

/// How the samples reach the grid. N: places for second differences.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
pub(crate) struct Input<T, const N: usize> {
    /// Whether there is a first sample, and a step after it.
    started: Flag,
    moving: Flag,
    /// The instant of the last good sample on the grid: whole ticks, and 1/2^6 ticks beside them, at most half a tick.
    grid: i64,
    part: i32,
    /// The last good sample.
    good: Reading,
    /// The last step on the grid.
    step: i32,
    suspect: Suspect,
    /// Count of the last sample, good or not.
    last_seen: u32,
    /// Second differences of the position on the grid: a ring, kept twice, so that all that is needed is in one piece.
    history: [[T; N]; 2],
    /// Place of the newest in the ring.
    newest: usize,
    /// Number of them that are known, and number of the newest that are not used yet.
    known: u32,
    pending: u32,
    /// Step at the end of the used second differences.
    used_step: i32,
    movements: Movements,
    /// Number of taps.
    taps: u32,
    /// Number of the period of the last good sample.
    clock: u64,
}

/// The part of the history that the next estimate needs.
pub(crate) struct Window<'a, T> {
    pub differences: &'a [T],
    /// Step at its end, in sixteenths of a count.
    pub step: i32,
    /// How the axis moves.
    pub movement: Movement,
}

impl Reading {
    /// Of a sample at its period.
    const fn at(count: u32) -> Self {
        Self { count, offset: 0 }
    }
}

impl Suspect {
    const NONE: Self = Self { reading: Reading::at(0), periods: 0 };
}

impl<T: Real, const N: usize> Input<T, N> {
    pub(crate) const NEW: Self = Self {
        started: Flag::CLEAR,
        moving: Flag::CLEAR,
        grid: 0,
        part: 0,
        good: Reading::at(0),
        step: 0,
        suspect: Suspect::NONE,
        last_seen: 0,
        history: [[T::ZERO; N]; 2],
        newest: 0,
        known: 0,
        pending: 0,
        used_step: 0,
        movements: Movements::NONE,
        taps: 0,
        clock: 0,
    };

    /// A stamp of 32 bits as one of 64 bits: the nearest to the grid.
    pub(crate) fn widened(&self, stamp: u32) -> i64 {
        let after = stamp.wrapping_sub(self.grid as u32).cast_signed();
        self.grid.wrapping_add(after.into())
    }

    /// Moves the grid back by the range of 32 bits, if a clock of 32 bits has wrapped before this stamp.
    pub(crate) fn wrap(&mut self, stamp: i64) {
        let back = self.grid.wrapping_sub(stamp);
        if back > RANGE / 2 && back <= RANGE && i32::try_from(stamp).is_ok() {
            self.grid = self.grid.wrapping_sub(RANGE);
        }
    }

    /// Takes a sample.
    pub(crate) fn accept(
        &mut self,
        settings: &InputSettings,
        taps: u32,
        counters: &mut Counters,
        stamp: i64,
        count: u32,
    ) -> Sample {
        count_one(&mut counters.samples);
        self.taps = taps;
        // A narrow counter may come with its sign in the bits above.
        let count =
            count & u32::MAX.checked_shr(u32::BITS.saturating_sub(settings.counter_bits)).unwrap_or(0);
        if !self.started.is_set() {
            // The first sample after restored totals is of the next period.
            self.clock = self.clock.wrapping_add(u64::from(counters.restarts > 0));
            self.restart(counters, stamp, count);
            return Sample::Restarted;
        }
        let ticks = i64::from(settings.ticks.max(1));
        let elapsed = stamp.wrapping_sub(self.grid);
        if elapsed < -i64::from(EARLIEST) * ticks {
            return self.lose(counters, stamp, count, 1); // the clock was set back: how long ago is unknown
        }
        // Most samples come one period after the other; a division takes longer.
        let with_half = elapsed.saturating_add(ticks / 2);
        let periods = if elapsed == ticks { 1 } else { with_half.checked_div(ticks).unwrap_or(0) };
        if periods <= 0 {
            count_one(&mut counters.early);
            return Sample::Early;
        }
        let seen = core::mem::replace(&mut self.last_seen, count);
        let room = (N as u32).saturating_sub(taps.saturating_add(self.pending));
        let most = settings.most_missing.saturating_add(1).min(room);
        let Some(periods) = u32::try_from(periods).ok().filter(|&periods| periods <= most) else {
            return self.lose(counters, stamp, count, periods.cast_unsigned());
        };
        let late = elapsed.wrapping_sub(i64::from(periods) * ticks) as i32;
        if late.unsigned_abs() > settings.tolerance {
            count_one(&mut counters.jittering);
        }
        // The position on the grid, from a sample that is late by a part of a period.
        let correction = if (late, self.part) == (0, 0) {
            0
        } else {
            let parts = T::from_i32(1 << FOLLOWED);
            let late = T::from_i32(late) * parts - T::from_i32(self.part);
            (T::from_i32(self.step) * (late / (T::from_i32(ticks as i32) * parts))).to_i32()
        };
        let reading = Reading { count, offset: correction.wrapping_neg() };
        let expected = i64::from(self.step) * i64::from(periods);
        let deviation = deviation(settings, self.good, reading, expected);
        if self.fits(settings, deviation, periods) {
            let moved = expected.wrapping_add(deviation);
            counters.wraps = counters.wraps.wrapping_add(wraps(settings, self.good, reading, moved));
            self.go_on(settings, counters, moved, periods);
            self.follow(reading, stamp, late);
            return if periods > 1 { Sample::Bridged } else { Sample::Used };
        }
        if count == seen {
            count_one(&mut counters.stuck);
        } else {
            count_one(&mut counters.jumps);
        }
        if self.agrees_with_suspect(settings, reading, periods) {
            count_one(&mut counters.counter_set);
            self.go_on(settings, counters, expected, periods);
            self.follow(reading, stamp, late);
            return Sample::CounterSet;
        }
        if periods > settings.most_missing {
            return self.lose(counters, stamp, count, periods.into());
        }
        self.suspect = Suspect { reading, periods };
        Sample::Suspect
    }

    /// Whether the last sample did not fit the motion either, but this one goes on from it: the counter was set.
    fn agrees_with_suspect(&self, settings: &InputSettings, reading: Reading, periods: u32) -> bool {
        let before = self.suspect;
        let between = periods.saturating_sub(before.periods);
        let expected = i64::from(self.step) * i64::from(between);
        before.periods > 0
            && between > 0
            && self.fits(settings, deviation(settings, before.reading, reading, expected), between)
    }

    /// Whether a deviation from the last step, over some periods, is possible for the axis.
    fn fits(&self, settings: &InputSettings, deviation: i64, periods: u32) -> bool {
        let periods = i64::from(periods);
        let most = i64::from(settings.most_change) * (periods * (periods + 1) / 2);
        let most = most.wrapping_add(i64::from(settings.slack));
        !self.moving.is_set() || deviation.unsigned_abs() <= most.unsigned_abs()
    }

    /// Goes on to a good sample, in equal steps over all periods since the last one.
    fn go_on(&mut self, settings: &InputSettings, counters: &mut Counters, moved: i64, periods: u32) {
        let mut done = 0;
        for period in 1..periods {
            let until = moved.wrapping_mul(period.into()).checked_div(periods.into()).unwrap_or(0);
            self.advance(settings, until.wrapping_sub(done) as i32);
            done = until;
        }
        self.advance(settings, moved.wrapping_sub(done) as i32);
        counters.missing = counters.missing.wrapping_add(u64::from(periods.wrapping_sub(1)));
        self.clock = self.clock.wrapping_add(u64::from(periods));
        self.suspect = Suspect::NONE;
    }

    /// Moves the grid to a good sample. It follows the clock of the encoder slowly.
    fn follow(&mut self, reading: Reading, stamp: i64, late: i32) {
        self.good = reading;
        let part = self.part.wrapping_add(late);
        let ticks = part.wrapping_add(1 << (FOLLOWED - 1)) >> FOLLOWED;
        self.part = part.wrapping_sub(ticks << FOLLOWED);
        self.grid = stamp.wrapping_add(i64::from(ticks) - i64::from(late));
    }

    /// One period with a step.
    fn advance(&mut self, settings: &InputSettings, step: i32) {
        self.movements.step(step, settings.still, self.taps.saturating_add(2));
        if !self.moving.is_set() {
            (self.moving, self.step, self.used_step) = (Flag::SET, step, step);
            return;
        }
        self.newest = self.newest.checked_add(1).filter(|&next| next < N).unwrap_or(0);
        let difference = T::from_i32(step.wrapping_sub(self.step));
        for ring in &mut self.history {
            if let Some(place) = ring.get_mut(self.newest) {
                *place = difference;
            }
        }
        self.step = step;
        self.known = self.known.saturating_add(1);
        self.pending = self.pending.saturating_add(1);
    }

    /// The next window with as many second differences as there are taps, if there is one; it is used then.
    pub(crate) fn next(&mut self, taps: u32) -> Option<Window<'_, T>> {
        while self.pending > 0 {
            self.pending -= 1;
            let end = self.newest.checked_add(N + 1)?.checked_sub(self.pending as usize)?;
            let newest = self.history.as_flattened().get(end.checked_sub(1)?)?;
            // Large differences are rounded in f32: once all are used, the step is exact again.
            self.used_step =
                if self.pending == 0 { self.step } else { self.used_step.wrapping_add(newest.to_i32()) };
            if self.known.saturating_sub(self.pending) >= taps {
                let movement = self.movements.next();
                let differences = self.history.as_flattened().get(end.checked_sub(taps as usize)?..end)?;
                return Some(Window { differences, step: self.used_step, movement });
            }
        }
        None
    }

    /// Number of second differences that are not used yet.
    pub(crate) fn pending(&self) -> u32 {
        self.pending
    }

    /// Number of the period of the last good sample, from 0.
    pub(crate) fn clock(&self) -> u64 {
        self.clock
    }

    /// Sets the number of the next period, at the start.
    pub(crate) fn set_clock(&mut self, clock: u64) {
        self.clock = clock;
    }

    /// Restarts after periods of which the loads are unknown.
    fn lose(&mut self, counters: &mut Counters, stamp: i64, count: u32, periods: u64) -> Sample {
        counters.lost = counters.lost.wrapping_add(periods);
        self.clock = self.clock.wrapping_add(periods);
        self.restart(counters, stamp, count);
        Sample::Restarted
    }

    fn restart(&mut self, counters: &mut Counters, stamp: i64, count: u32) {
        count_one(&mut counters.restarts);
        let good = Reading::at(count);
        *self =
            Self { started: Flag::SET, grid: stamp, good, last_seen: count, clock: self.clock, ..Self::NEW };
    }
}

/// Counts one more; a counter of 64 bits that is full begins again.
fn count_one(counter: &mut u64) {
    *counter = counter.wrapping_add(1);
}

/// Movement between two readings of a counter of limited width, less the expected one, in sixteenths of a count: at most half of the range
/// of the counter.
fn deviation(settings: &InputSettings, from: Reading, to: Reading, expected: i64) -> i64 {
    let counts = i64::from(to.count.wrapping_sub(from.count)) * i64::from(FRACTION);
    let deviation = (counts + i64::from(to.offset) - i64::from(from.offset)).wrapping_sub(expected);
    let unused = (u64::BITS - FRACTION.ilog2()).saturating_sub(settings.counter_bits);
    deviation.wrapping_shl(unused).wrapping_shr(unused)
}

/// How often the counter wrapped between two readings with a movement between, in sixteenths of a count.
fn wraps(settings: &InputSettings, from: Reading, to: Reading, moved: i64) -> u64 {
    let counts = (moved.wrapping_add(from.offset.into()).wrapping_sub(to.offset.into())) >> FRACTION.ilog2();
    let beyond = counts.wrapping_add(from.count.into()).wrapping_sub(to.count.into());
    beyond.wrapping_shr(settings.counter_bits).unsigned_abs()
}
