//! The constants of a monitor, computed on a PC and kept in flash.

use crate::input::MOST_TICKS;
use guideload_life::Real;
use guideload_life::{COMPONENTS, Exponent, Rule};

/// Fractions of a count in which positions are computed: samples between two periods are interpolated.
pub const FRACTION: i32 = 16;

/// Constants of a linear machine and its encoder for one period of sampling. S: places for the entries of the state, C: for carriages, N: for
/// second differences of the counts; a C program has fixed numbers of places, and the fields say how many are used.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct Prepared<T, const S: usize, const C: usize, const N: usize> {
    /// Checksum of the machine and the settings: a saved state of other constants is refused.
    pub id: u32,
    /// Number of carriages.
    pub carriage_count: u32,
    /// Encoder and clock.
    pub input: InputSettings,
    /// Number of taps; with the places for missing samples at most N.
    pub tap_count: u32,
    /// Samples between a sample and the loads that come out when it goes in.
    pub lag: u32,
    /// Samples from a restart to loads that no longer depend on the state at the restart.
    pub settling: u32,
    /// Exponent of the life, as the number of an [`Exponent`].
    pub exponent: u32,
    /// Period of sampling, s.
    pub period: T,
    /// m/s per sixteenth of a count in the last step.
    pub speed_of_step: T,
    /// Effect of a second difference, in sixteenths of a count, on acceleration (m/s²), and on velocity (m/s): the oldest first.
    pub taps: [[T; N]; 2],
    /// Change of the state over a period, per entry of the state: columns.
    pub change: [[T; S]; S],
    /// Effect on the state of the acceleration at the start and at the end of a period.
    pub from_start: [T; S],
    /// See `from_start`.
    pub from_end: [T; S],
    /// The carriages.
    pub carriages: [Carriage<T, S>; C],
}

/// What is known of encoder and clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct InputSettings {
    /// Time stamps per period, up to 2^32/18; 1 if the stamp is a number of the sample.
    pub ticks: u32,
    /// Deviation of a stamp from its period above which it is counted, in ticks.
    pub tolerance: u32,
    /// Width of the counter, bits, 1 to 32.
    pub counter_bits: u32,
    /// Largest change of the step from one period to the next, in sixteenths of a count: acceleration of the axis at most.
    pub most_change: i32,
    /// Deviation by noise and rounding that is allowed in addition, in sixteenths of a count.
    pub slack: i32,
    /// Movement to and fro that is noise at standstill, in sixteenths of a count.
    pub still: i32,
    /// Largest number of missing samples that is bridged.
    pub most_missing: u32,
}

/// Constants of one carriage. S: places for the entries of the state.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct Carriage<T, const S: usize> {
    /// Load at rest: Fy, Fz (N), Mx, My, Mz (N m).
    pub rest: [T; COMPONENTS],
    /// Load per entry of the state: columns.
    pub by_state: [[T; COMPONENTS]; S],
    /// Rule of the equivalent load.
    pub rule: Rule<T>,
    /// Limit of the equivalent load, N; infinite: none.
    pub limit: T,
    /// Bins of the histogram per N of equivalent load.
    pub bins_per_load: T,
    /// `∫ P^p |v| dt` that uses up the rating life, N^p m; 0 if unknown.
    pub capacity: T,
}

impl<T, const S: usize, const C: usize, const N: usize> Prepared<T, S, C, N> {
    /// Whether a monitor can work with these constants: counts within their places, an exponent that exists, numbers that are finite (but for
    /// a limit). [`prepare`](crate::prepare) gives no others; those of a C program may be damaged.
    pub fn is_valid(&self) -> bool
    where
        T: Real,
    {
        let Self { input, tap_count, carriage_count, exponent, carriages, .. } = self;
        let differences = u64::from(*tap_count) + u64::from(input.most_missing) + 1;
        let counts = *carriage_count as usize <= C
            && *tap_count > 0
            && differences <= N as u64
            && (1..=MOST_TICKS).contains(&input.ticks)
            && (1..=32).contains(&input.counter_bits)
            && input.most_change >= 0
            && input.slack >= 0
            && input.still >= 0
            && *exponent <= Exponent::Roller as u32;
        let effects = [&self.from_start, &self.from_end].into_iter().chain(&self.change).flatten();
        let mut numbers = effects.chain(self.taps.as_flattened()).chain([&self.period, &self.speed_of_step]);
        counts && numbers.all(|number| number.is_finite()) && carriages.iter().all(Carriage::is_valid)
    }

    /// Exponent of the life.
    pub(crate) fn exponent(&self) -> Exponent {
        if self.exponent == Exponent::Roller as u32 { Exponent::Roller } else { Exponent::Ball }
    }
}

impl<T: Real, const S: usize> Carriage<T, S> {
    /// A place without a carriage.
    pub const NONE: Self = Self {
        rest: [T::ZERO; COMPONENTS],
        by_state: [[T::ZERO; COMPONENTS]; S],
        rule: Rule::NONE,
        limit: T::INFINITY,
        bins_per_load: T::ZERO,
        capacity: T::ZERO,
    };

    /// Whether all numbers are finite, but for the limit, which is a number.
    fn is_valid(&self) -> bool {
        let Self { rest, by_state, rule, limit, bins_per_load, capacity } = self;
        let of_rule = rule.weights.as_flattened().as_flattened().iter();
        let mut numbers = of_rule.chain(rest).chain(by_state.as_flattened()).copied().chain([
            rule.minor,
            rule.preload,
            rule.opening,
            *bins_per_load,
            *capacity,
        ]);
        numbers.all(Real::is_finite) && *limit > T::NEG_INFINITY
    }

    /// Load at a state.
    #[inline(always)]
    pub(crate) fn load_at(&self, state: &[T; S]) -> [T; COMPONENTS] {
        let mut load = self.rest;
        for j in 0..S {
            load = core::array::from_fn(|k| load[k] + self.by_state[j][k] * state[j]);
        }
        load
    }
}
