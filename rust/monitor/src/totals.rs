//! What a monitor keeps for years: extremes, sums, histogram and counts.

use crate::flag::Flag;
use crate::input::Counters;
use crate::prepared::Carriage;
use crate::sum::Sum;
use guideload_life::COMPONENTS;
use guideload_life::Real;

/// Number of bins of the histogram; the last one also has all larger loads.
pub const BINS: usize = 16;

/// Quantities of a carriage with extremes: Fy, Fz (N), Mx, My, Mz (N m), the square of the resultant of Fy and Fz (N²), and P (N).
pub const QUANTITIES: usize = COMPONENTS + 2;

/// Totals of one carriage.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct CarriageTotals<T> {
    /// Smallest value of each of the [`QUANTITIES`]; infinite if there was none.
    pub smallest: [T; QUANTITIES],
    /// Largest value of each.
    pub largest: [T; QUANTITIES],
    /// Numbers of the periods of the smallest values.
    pub period_of_smallest: [u64; QUANTITIES],
    /// Numbers of the periods of the largest values.
    pub period_of_largest: [u64; QUANTITIES],
    /// `∫ P^p |v| dt`, N^p m.
    pub power: Sum<T>,
    /// Periods by bin of P.
    pub histogram: [u64; BINS],
    /// Periods with P above its limit, and how often P rose above it.
    pub above_limit: u64,
    /// See `above_limit`.
    pub limit_exceeded: u64,
    /// Whether P is above its limit.
    pub is_above: Flag,
}

/// Totals of a monitor. C: places for carriages.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct Totals<T, const C: usize> {
    /// Periods whose loads are known.
    pub periods: u64,
    /// Of these, periods soon after a restart, whose loads may be wrong by the vibration before it; they have no extremes.
    pub settling: u64,
    /// `∫ |v| dt` of the periods with loads, m; of slow movement, by single counts, its displacement, once its mean load is known.
    pub distance: Sum<T>,
    /// What happened to the samples.
    pub counters: Counters,
    /// Of each carriage.
    pub carriages: [CarriageTotals<T>; C],
}

impl<T: Real> CarriageTotals<T> {
    const NONE: Self = Self {
        smallest: [T::INFINITY; QUANTITIES],
        largest: [T::NEG_INFINITY; QUANTITIES],
        period_of_smallest: [0; QUANTITIES],
        period_of_largest: [0; QUANTITIES],
        power: Sum::ZERO,
        histogram: [0; BINS],
        above_limit: 0,
        limit_exceeded: 0,
        is_above: Flag::CLEAR,
    };

    /// Whether there are extremes: a load was known and settled.
    pub fn has_extremes(&self) -> bool {
        self.smallest.iter().zip(&self.largest).all(|(smallest, largest)| smallest <= largest)
    }

    /// Whether the integral is finite, and the extremes are, or there are none.
    pub fn is_finite(&self) -> bool {
        let none = self.smallest == Self::NONE.smallest && self.largest == Self::NONE.largest;
        let mut extremes = self.smallest.iter().chain(&self.largest);
        self.power.value().is_finite()
            && (none || self.has_extremes() && extremes.all(|extreme| extreme.is_finite()))
    }

    /// Takes a load and its P.
    #[inline(always)]
    pub(crate) fn take<const S: usize>(
        &mut self,
        carriage: &Carriage<T, S>,
        load: &[T; COMPONENTS],
        equivalent: T,
        period: u64,
    ) {
        let [y, z, roll, yaw, pitch] = *load;
        let quantities = [y, z, roll, yaw, pitch, y * y + z * z, equivalent];
        let mut wider = false;
        for k in 0..QUANTITIES {
            wider |= (quantities[k] < self.smallest[k]) | (quantities[k] > self.largest[k]);
        }
        if wider {
            self.widen(&quantities, period);
        }
        let is_above = equivalent > carriage.limit;
        if is_above {
            self.above_limit = self.above_limit.wrapping_add(1);
            self.limit_exceeded = self.limit_exceeded.wrapping_add(u64::from(!self.is_above.is_set()));
        }
        self.is_above = Flag::new(is_above);
    }

    /// Takes new extremes.
    #[inline(never)]
    fn widen(&mut self, quantities: &[T; QUANTITIES], period: u64) {
        for k in 0..QUANTITIES {
            if quantities[k] < self.smallest[k] {
                (self.smallest[k], self.period_of_smallest[k]) = (quantities[k], period);
            }
            if quantities[k] > self.largest[k] {
                (self.largest[k], self.period_of_largest[k]) = (quantities[k], period);
            }
        }
    }

    /// Counts a P in its bin.
    #[inline(always)]
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

    /// Whether the travel and the totals of all carriages are finite.
    pub fn is_finite(&self) -> bool {
        self.distance.value().is_finite() && self.carriages.iter().all(CarriageTotals::is_finite)
    }

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
