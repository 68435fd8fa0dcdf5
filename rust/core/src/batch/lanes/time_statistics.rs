//! Running statistics of signals, one scene in each lane, block by block.

use guideload_life::two_sum;
use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::memory::{HIGH, HIGH_AT, LOW, LOW_AT, Memory, STATISTICS};
use super::modal::ModalScenes;
use super::power_integral::PowerIntegral;
use super::timeline::{BLOCK, Timeline};
use super::vector::Real;
use super::waiting::{BlockStates, Components, Kinks, SignalBlock};
use crate::batch::equivalent::EquivalentRows;
use crate::batch::requirements::{Requirements, Signal, SignalRequest};
use crate::batch::time_statistics::RunningStatistics;
use crate::excitation::Excitation;

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

/// Writes the statistics of one scene, one entry per signal; returns whether all requested ones are finite. `excitation`: of the whole motion.
pub(super) fn statistics(
    requirements: &Requirements,
    excitation: &Excitation,
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
            smallest: root(number(LOW)) + 0.0,
            largest: root(number(HIGH)) + 0.0,
            time_of_smallest: if wanted.times { time_at(excitation, number(LOW_AT)) } else { 0.0 },
            time_of_largest: if wanted.times { time_at(excitation, number(HIGH_AT)) } else { 0.0 },
            sum: number(4),
            rest: number(LOW_AT),
            start: root(number(5)) + 0.0,
        };
        out.push(match wanted.signal {
            Signal::Equivalent(index) => found.with_preload(&requirements.equivalents[index].rule),
            _ => found,
        });
    }
    finite
}

/// Time of a sample and a share of the interval after it, s.
fn time_at(excitation: &Excitation, place: f64) -> f64 {
    let sample = place as usize;
    let share = place - sample as f64;
    let rest = if share > 0.0 { share * excitation.interval(sample) } else { 0.0 };
    excitation.time(sample) + rest
}

/// Updates the statistics with a block. `first`: index of the first sample of the window in the motion.
#[inline(always)]
pub(super) fn reduce<S: Simd>(
    simd: S,
    requirements: &Requirements,
    modal: &ModalScenes,
    timeline: &Timeline,
    block: usize,
    first: usize,
    memory: &mut Memory,
) {
    let Memory { states, before, values, extremes, last, counts, drawn, found, waiting, means, .. } = memory;
    if counts.iter().all(|counts| !counts) {
        return;
    }
    let starts = modal.starts.vectors::<S>();
    let values = values.vectors::<S>().as_chunks::<BLOCK>().0;
    let means = means.vectors::<S>().as_chunks::<BLOCK>().0;
    let extremes = extremes.vectors::<S>().as_chunks::<2>().0;
    let start = block * BLOCK;
    let (at, is_first) = (first + start, first + start == 0);
    let Some(time) = timeline.time[start..].first_chunk::<BLOCK>() else { return };
    let states = states.vectors::<S>().as_chunks::<BLOCK>().0;
    let here = BlockStates { timeline, block, states, before: before.vectors::<S>() };
    let kinks = Kinks::new(simd, modal, timeline, block, drawn);
    waiting.next_block();
    let last = last.vectors_mut::<S>();
    if block == 0 {
        last.iter_mut().zip(values).for_each(|(last, values)| *last = values[0]);
    }
    for (signal, (wanted, place)) in
        requirements.signals.iter().zip(found.vectors_mut::<S>().as_chunks_mut::<STATISTICS>().0).enumerate()
    {
        if !counts[signal] {
            continue;
        }
        let mut found = LaneStatistics::of(simd, *place);
        let (squares, loads);
        // The values with their smallest and largest one, and the last one before.
        let (values_of, range, last_of, components) = match wanted.signal {
            Signal::Row(row) => {
                if is_first {
                    found.first = Real::new(simd, starts[row]);
                }
                let [low, high] = extremes[row];
                let range = [Real::new(simd, low), Real::new(simd, high)];
                if wanted.squares {
                    found.take_squares(simd, &values[row], time, |value, sum| value.mul_add(value, sum));
                }
                (&values[row], range, Real::new(simd, last[row]), None)
            }
            Signal::Resultant(y, z) => {
                squares = squares_of(simd, &values[y], &values[z]);
                if is_first {
                    found.first = square(simd, starts[y], starts[z]);
                }
                if wanted.squares {
                    found.take_squares(simd, &squares, time, |square, sum| square + sum);
                }
                if !wanted.extremes {
                    *place = found.lanes();
                    continue;
                }
                (&squares, least_and_largest(simd, &squares), square(simd, last[y], last[z]), None)
            }
            Signal::Equivalent(index) => {
                let equivalent = &requirements.equivalents[index];
                loads = equivalent_loads(simd, equivalent, values);
                let last_of = equivalent.without_preload(
                    Real::splat(simd, 0.0),
                    #[inline(always)]
                    |row| Real::new(simd, last[row]),
                );
                let rows = Some(Components { equivalent, values, last: &*last });
                (&loads, least_and_largest(simd, &loads), last_of, rows)
            }
            Signal::Power(index) => {
                if let Some(travel) = &requirements.travel {
                    let equivalent = &requirements.equivalents[index];
                    let integral = PowerIntegral { simd, equivalent, travel, values, last, means };
                    found.add(integral.over_block(start));
                    *place = found.lanes();
                }
                continue;
            }
        };
        found.take_extremes(simd, wanted, range, values_of, at);
        *place = found.lanes();
        if wanted.extremes && !requirements.at_samples {
            let (values, known) = (values_of, [found.low, found.high]);
            let hidden = match wanted.signal {
                Signal::Row(row) => kinks.of(row),
                Signal::Resultant(y, z) => kinks.of_squares([y, z], range[1].max(last_of)),
                Signal::Equivalent(index) | Signal::Power(index) => {
                    kinks.of_equivalent(&requirements.equivalents[index])
                }
            };
            let is_row = matches!(wanted.signal, Signal::Row(_));
            SignalBlock { signal, values, last: last_of, range, known, hidden, is_row, components }
                .wait(simd, &here, waiting);
        }
    }
    last.iter_mut().zip(values).for_each(|(last, values)| *last = values[BLOCK - 1]);
}

/// The squares of the resultants of two rows.
#[inline(always)]
fn squares_of<S: Simd>(simd: S, y: &[S::f64s; BLOCK], z: &[S::f64s; BLOCK]) -> [S::f64s; BLOCK] {
    let mut squares = *y;
    for k in 0..BLOCK {
        squares[k] = square(simd, y[k], z[k]).lanes;
    }
    squares
}

/// Equivalent loads at the samples of a block, without the effect of a preload.
#[inline(always)]
fn equivalent_loads<S: Simd>(
    simd: S,
    equivalent: &EquivalentRows,
    values: &[[S::f64s; BLOCK]],
) -> [S::f64s; BLOCK] {
    let mut loads = [simd.splat_f64s(0.0); BLOCK];
    for k in 0..BLOCK {
        let load = equivalent.without_preload(
            Real::splat(simd, 0.0),
            #[inline(always)]
            |row| Real::new(simd, values[row][k]),
        );
        loads[k] = load.lanes;
    }
    loads
}

#[inline(always)]
fn square<S: Simd>(simd: S, y: S::f64s, z: S::f64s) -> Real<S> {
    let (y, z) = (Real::new(simd, y), Real::new(simd, z));
    y.mul_add(y, z * z)
}

impl<S: Simd> LaneStatistics<S> {
    #[inline(always)]
    fn of(simd: S, lanes: [S::f64s; STATISTICS]) -> Self {
        let [low, high, low_at, high_at, sum, first] = lanes;
        Self {
            low: Real::new(simd, low),
            high: Real::new(simd, high),
            low_at: Real::new(simd, low_at),
            high_at: Real::new(simd, high_at),
            sum: Real::new(simd, sum),
            first: Real::new(simd, first),
        }
    }

    #[inline(always)]
    fn lanes(&self) -> [S::f64s; STATISTICS] {
        let Self { low, high, low_at, high_at, sum, first } = self;
        [low.lanes, high.lanes, low_at.lanes, high_at.lanes, sum.lanes, first.lanes]
    }

    /// Updates with the extremes of a block that begins with the sample `start` and, if wanted, with their times.
    #[inline(always)]
    fn take_extremes(
        &mut self,
        simd: S,
        wanted: &SignalRequest,
        [low, high]: [Real<S>; 2],
        values: &[S::f64s; BLOCK],
        start: usize,
    ) {
        if wanted.times {
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
        let [sum, error] = two_sum(self.sum, term);
        (self.sum, self.low_at) = (sum, self.low_at + error);
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
