//! Running statistics of signals, one scene in each lane, block by block.

use pulp::{Simd, WithSimd};

use super::aligned_buffer::AlignedBuffer;
use super::power_integral::{PowerIntegral, equivalent_loads};
use super::timeline::{BLOCK, Timeline};
use super::vector::Real;
use crate::batch::requirements::{Requirements, Signal, SignalRequest};
use crate::batch::time_statistics::RunningStatistics;

/// Number of statistics of a signal, in the order of [`RunningStatistics`]; for a resultant, statistics of its square.
pub(super) const STATISTICS: usize = 6;

/// Running statistics of a signal in each lane.
struct LaneStatistics<S: Simd> {
    low: Real<S>,
    high: Real<S>,
    low_at: Real<S>,
    high_at: Real<S>,
    sum: Real<S>,
    first: Real<S>,
}

/// Statistics before the first block.
#[inline(always)]
pub(super) fn nothing<S: Simd>(simd: S) -> [S::f64s; STATISTICS] {
    let (zero, infinite) = (Real::splat(simd, 0.0), Real::splat(simd, f64::INFINITY));
    LaneStatistics { low: infinite, high: -infinite, low_at: zero, high_at: zero, sum: zero, first: zero }
        .lanes()
}

/// Writes the statistics of one scene, one entry per signal; returns whether all requested ones are finite.
pub(super) fn statistics(
    requirements: &Requirements,
    found: &AlignedBuffer,
    lane: usize,
    lanes: usize,
    out: &mut Vec<RunningStatistics>,
) -> bool {
    out.clear();
    let mut finite = true;
    for (index, wanted) in requirements.signals.iter().enumerate() {
        let number = |i: usize| found.lane(index * STATISTICS + i, lane, lanes);
        finite &= number(4).is_finite() && number(5).is_finite();
        finite &= !wanted.extremes || (number(0).is_finite() && number(1).is_finite());
        let root = |x: f64| if let Signal::Resultant(..) = wanted.signal { x.sqrt() } else { x };
        let found = RunningStatistics {
            // Adding zero removes the sign of a zero, which differs between processors.
            smallest: root(number(0)) + 0.0,
            largest: root(number(1)) + 0.0,
            at_smallest: number(2) as usize,
            at_largest: number(3) as usize,
            sum: number(4),
            rest: number(2),
            start: root(number(5)) + 0.0,
        };
        out.push(match wanted.signal {
            Signal::Equivalent(index) => found.raised(&requirements.equivalents[index].rule),
            _ => found,
        });
    }
    finite
}

/// Updates the statistics with a block.
pub(super) struct Reduce<'a> {
    pub requirements: &'a Requirements,
    pub timeline: &'a Timeline,
    pub block: usize,
    /// Index of the first sample of the window in the motion.
    pub first: usize,
    pub starts: &'a AlignedBuffer,
    pub values: &'a AlignedBuffer,
    pub extremes: &'a AlignedBuffer,
    /// Last values of the rows before the block; afterwards, in it.
    pub last: &'a mut AlignedBuffer,
    pub found: &'a mut AlignedBuffer,
}

impl WithSimd for Reduce<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { requirements, timeline, block, first, starts, values, extremes, last, found } = self;
        let starts = starts.vectors::<S>();
        let values = values.vectors::<S>().as_chunks::<BLOCK>().0;
        let extremes = extremes.vectors::<S>().as_chunks::<2>().0;
        let start = block * BLOCK;
        let (at, is_first) = (first + start, first + start == 0);
        let Some(time) = timeline.time[start..].first_chunk::<BLOCK>() else { return };
        let last = last.vectors_mut::<S>();
        if block == 0 {
            last.iter_mut().zip(values).for_each(|(last, values)| *last = values[0]);
        }
        for (wanted, place) in
            requirements.signals.iter().zip(found.vectors_mut::<S>().as_chunks_mut::<STATISTICS>().0)
        {
            let mut found = LaneStatistics::of(simd, *place);
            match wanted.signal {
                Signal::Row(row) => {
                    let [low, high] = extremes[row].map(|lanes| Real::new(simd, lanes));
                    if is_first {
                        found.first = Real::new(simd, starts[row]);
                    }
                    if wanted.extremes {
                        found.take_extremes(simd, wanted, [low, high], values.get(row), at);
                    }
                    if wanted.squares {
                        found.take_squares(simd, &values[row], time, |value, sum| value.mul_add(value, sum));
                    }
                }
                Signal::Resultant(y, z) => {
                    let mut squares = values[y];
                    for k in 0..BLOCK {
                        let (y, z) = (Real::new(simd, values[y][k]), Real::new(simd, values[z][k]));
                        squares[k] = y.mul_add(y, z * z).lanes;
                    }
                    if is_first {
                        let (y, z) = (Real::new(simd, starts[y]), Real::new(simd, starts[z]));
                        found.first = y.mul_add(y, z * z);
                    }
                    if wanted.extremes {
                        found.take_extremes(
                            simd,
                            wanted,
                            least_and_largest(simd, &squares),
                            Some(&squares),
                            at,
                        );
                    }
                    if wanted.squares {
                        found.take_squares(simd, &squares, time, |square, sum| square + sum);
                    }
                }
                Signal::Equivalent(index) => {
                    let loads = equivalent_loads(simd, &requirements.equivalents[index], values);
                    let extremes = least_and_largest(simd, &loads);
                    found.take_extremes(simd, wanted, extremes, Some(&loads), at);
                }
                Signal::Power(index) => {
                    if let Some(travel) = &requirements.travel {
                        let equivalent = &requirements.equivalents[index];
                        let integral = PowerIntegral { simd, equivalent, travel, values, last };
                        found.add(integral.over_block(start));
                    }
                }
            }
            *place = found.lanes();
        }
        last.iter_mut().zip(values).for_each(|(last, values)| *last = values[BLOCK - 1]);
    }
}

impl<S: Simd> LaneStatistics<S> {
    #[inline(always)]
    fn of(simd: S, lanes: [S::f64s; STATISTICS]) -> Self {
        let [low, high, low_at, high_at, sum, first] = lanes.map(|lanes| Real::new(simd, lanes));
        Self { low, high, low_at, high_at, sum, first }
    }

    #[inline(always)]
    fn lanes(&self) -> [S::f64s; STATISTICS] {
        [self.low, self.high, self.low_at, self.high_at, self.sum, self.first].map(|number| number.lanes)
    }

    /// Updates with the extremes of a block that begins with the sample `start` and, if wanted, with their times.
    #[inline(always)]
    fn take_extremes(
        &mut self,
        simd: S,
        wanted: &SignalRequest,
        [low, high]: [Real<S>; 2],
        values: Option<&[S::f64s; BLOCK]>,
        start: usize,
    ) {
        if wanted.times
            && let Some(values) = values
        {
            // New extremes are rare, so the first sample with that value is searched for only then.
            let (lower, higher) = (low.less_than(self.low), self.high.less_than(high));
            if lower.any() {
                let mut at = low;
                for k in (0..BLOCK).rev() {
                    let later = low.less_than(Real::new(simd, values[k]));
                    at = later.select(at, Real::splat(simd, (start + k) as f64));
                }
                self.low_at = lower.select(at, self.low_at);
            }
            if higher.any() {
                let mut at = high;
                for k in (0..BLOCK).rev() {
                    let later = Real::new(simd, values[k]).less_than(high);
                    at = later.select(at, Real::splat(simd, (start + k) as f64));
                }
                self.high_at = higher.select(at, self.high_at);
            }
        }
        (self.low, self.high) = (self.low.min(low), self.high.max(high));
    }

    /// Adds the weighted squares of a block.
    #[inline(always)]
    fn take_squares(
        &mut self,
        simd: S,
        values: &[S::f64s; BLOCK],
        weights: &[f64; BLOCK],
        square: impl Fn(Real<S>, Real<S>) -> Real<S>,
    ) {
        let zero = Real::splat(simd, 0.0);
        let mut sums = [zero; 4];
        if weights.iter().all(|weight| *weight == weights[0]) {
            for k in 0..BLOCK {
                sums[k % 4] = square(Real::new(simd, values[k]), sums[k % 4]);
            }
            let sum = sums[0] + sums[1] + (sums[2] + sums[3]);
            self.sum = sum.mul_add(Real::splat(simd, weights[0]), self.sum);
            return;
        }
        for k in 0..BLOCK {
            let weighed = square(Real::new(simd, values[k]), zero);
            self.sum = weighed.mul_add(Real::splat(simd, weights[k]), self.sum);
        }
    }

    /// Adds to the integral of a power, and the rounding error to `low_at`: see [`RunningStatistics::add`].
    #[inline(always)]
    fn add(&mut self, term: Real<S>) {
        let sum = self.sum + term;
        let added = sum - self.sum;
        self.low_at = self.low_at + ((self.sum - (sum - added)) + (term - added));
        self.sum = sum;
    }
}

/// Smallest and largest value of a block.
#[inline(always)]
fn least_and_largest<S: Simd>(simd: S, values: &[S::f64s; BLOCK]) -> [Real<S>; 2] {
    let first = Real::new(simd, values[0]);
    let (mut low, mut high) = ([first; 4], [first; 4]);
    for k in 0..BLOCK {
        let value = Real::new(simd, values[k]);
        (low[k % 4], high[k % 4]) = (low[k % 4].min(value), high[k % 4].max(value));
    }
    [low[0].min(low[1]).min(low[2].min(low[3])), high[0].max(high[1]).max(high[2].max(high[3]))]
}
