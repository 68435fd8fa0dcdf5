//! What a monitor keeps for years: extremes, sums, histogram and counts.

use crate::input::Counters;
use crate::prepared::Carriage;
use crate::real::Real;
use crate::rule::COMPONENTS;
use crate::sum::Sum;

/// Number of bins of the histogram; the last one also has all larger loads.
pub const BINS: usize = 16;

/// Quantities of a carriage with extremes: Fy, Fz (N), Mx, My, Mz (N m), the square of the resultant of Fy and Fz (N²), and P (N).
pub const QUANTITIES: usize = COMPONENTS + 2;

/// Smallest and largest value of a quantity, with the numbers of their periods.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Extremes<T> {
    /// Smallest and largest value; infinite if there were none.
    pub value: [T; 2],
    /// Numbers of the periods of the smallest and the largest value.
    pub period: [u64; 2],
}

/// Totals of one carriage.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct CarriageTotals<T> {
    /// Extremes of the [`QUANTITIES`].
    pub extremes: [Extremes<T>; QUANTITIES],
    /// `∫ P^p |v| dt`, N^p m.
    pub power: Sum<T>,
    /// Periods by bin of P.
    pub histogram: [u64; BINS],
    /// Periods with P above its limit, and how often P rose above it.
    pub above_limit: u64,
    /// See `above_limit`.
    pub limit_exceeded: u64,
    /// Whether P is above its limit.
    pub is_above: bool,
}

/// Totals of a monitor. C: places for carriages.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Totals<T, const C: usize> {
    /// Periods whose loads are known.
    pub periods: u64,
    /// Of these, periods soon after a restart, whose loads may be wrong by the vibration before it; they have no extremes.
    pub settling: u64,
    /// `∫ |v| dt` of the periods with loads, m.
    pub distance: Sum<T>,
    /// What happened to the samples.
    pub counters: Counters,
    /// Of each carriage.
    pub carriages: [CarriageTotals<T>; C],
}

impl<T: Real> Extremes<T> {
    const NONE: Self = Self { value: [T::INFINITY, T::NEG_INFINITY], period: [0; 2] };

    fn take(&mut self, value: T, period: u64) {
        if value < self.value[0] {
            (self.value[0], self.period[0]) = (value, period);
        }
        if value > self.value[1] {
            (self.value[1], self.period[1]) = (value, period);
        }
    }
}

impl<T: Real> CarriageTotals<T> {
    const NONE: Self = Self {
        extremes: [Extremes::NONE; QUANTITIES],
        power: Sum::ZERO,
        histogram: [0; BINS],
        above_limit: 0,
        limit_exceeded: 0,
        is_above: false,
    };

    /// Takes a load and its P.
    pub(crate) fn take<const S: usize>(
        &mut self,
        carriage: &Carriage<T, S>,
        load: &[T; COMPONENTS],
        equivalent: T,
        period: u64,
    ) {
        let [y, z, roll, yaw, pitch] = *load;
        let quantities = [y, z, roll, yaw, pitch, y * y + z * z, equivalent];
        for (extremes, value) in self.extremes.iter_mut().zip(quantities) {
            extremes.take(value, period);
        }
        let is_above = equivalent > carriage.limit;
        self.above_limit = self.above_limit.wrapping_add(u64::from(is_above));
        self.limit_exceeded = self.limit_exceeded.wrapping_add(u64::from(is_above && !self.is_above));
        self.is_above = is_above;
    }

    /// Counts a P in its bin.
    pub(crate) fn count(&mut self, bins_per_load: T, equivalent: T) {
        let bin = (equivalent * bins_per_load).to_i32().clamp(0, BINS as i32 - 1) as usize;
        if let Some(periods) = self.histogram.get_mut(bin) {
            *periods = periods.wrapping_add(1);
        }
    }
}

impl<T: Real, const C: usize> Totals<T, C> {
    /// Nothing so far.
    pub const NONE: Self = Self {
        periods: 0,
        settling: 0,
        distance: Sum::ZERO,
        counters: Counters::NONE,
        carriages: [CarriageTotals::NONE; C],
    };

    /// Share of the rating life that a carriage has used, 0 to 1 and more; none if its rating is unknown.
    pub fn life_used<const S: usize, const N: usize>(
        &self,
        prepared: &crate::Prepared<T, S, C, N>,
        carriage: usize,
    ) -> Option<f64> {
        let capacity = prepared.carriages.get(carriage)?.capacity;
        let power = self.carriages.get(carriage)?.power.value();
        (capacity > T::ZERO).then(|| power / capacity.to_f64())
    }

    /// Mean load over the distance of a carriage, `(∫ P^p |v| dt / ∫ |v| dt)^(1/p)`, to the power p, N^p; none without travel.
    pub fn mean_power(&self, carriage: usize) -> Option<f64> {
        let (power, distance) = (self.carriages.get(carriage)?.power.value(), self.distance.value());
        (distance > 0.0).then(|| power / distance)
    }
}
