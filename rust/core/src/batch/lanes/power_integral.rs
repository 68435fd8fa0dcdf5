//! Equivalent loads, and the integral of their power over the travel, one scene in each lane.
//!
//! The sum over a block stays in registers. Intervals on which the load is not linear contribute nothing to it; `nonlinear_intervals` adds them.

use guideload_life::Number;
use pulp::{Simd, bytemuck};

use super::timeline::BLOCK;
use super::vector::Real;
use crate::batch::equivalent::EquivalentRows;
use crate::batch::travel::{LARGEST_CHANGE_OF_SERIES, MOST_TERMS, Travel};
use crate::numeric::simd::LANES;

/// The loads of a block, and what they are integrated with.
pub(super) struct PowerIntegral<'a, S: Simd> {
    pub simd: S,
    pub equivalent: &'a EquivalentRows,
    pub travel: &'a Travel,
    /// Values of each row in the block, and the last value of each before it.
    pub values: &'a [[S::f64s; BLOCK]],
    pub last: &'a [S::f64s],
    /// Means of each row over the intervals that end in the block.
    pub means: &'a [[S::f64s; BLOCK]],
}

/// P of the groups A and B, without the effect of a preload.
#[inline(always)]
pub(super) fn combined<S: Simd>(equivalent: &EquivalentRows, [first, second]: [Real<S>; 2]) -> Real<S> {
    if equivalent.rule.minor == 1.0 {
        return first;
    }
    first.constant(equivalent.rule.minor).mul_add(first.min(second), first.max(second))
}

/// Adds `size |value| + sign value` to a group.
#[inline(always)]
pub(super) fn added<S: Simd>(sum: Real<S>, value: Real<S>, size: f64, sign: f64) -> Real<S> {
    let sum = if sign == 0.0 { sum } else { value.mul_add(sum.constant(sign), sum) };
    value.abs().mul_add(sum.constant(size), sum)
}

/// Equivalent loads at the samples of a block, without the effect of a preload.
#[inline(always)]
pub(super) fn equivalent_loads<S: Simd>(
    simd: S,
    equivalent: &EquivalentRows,
    values: &[[S::f64s; BLOCK]],
) -> [S::f64s; BLOCK] {
    let mut loads = [simd.splat_f64s(0.0); BLOCK];
    for k in 0..BLOCK {
        loads[k] = equivalent_load(simd, equivalent, |row| values[row][k]).lanes;
    }
    loads
}

/// The equivalent load of the values of the rows, without the effect of a preload.
#[inline(always)]
pub(super) fn equivalent_load<S: Simd>(
    simd: S,
    equivalent: &EquivalentRows,
    row: impl Fn(usize) -> S::f64s,
) -> Real<S> {
    let mut groups = [Real::splat(simd, 0.0); 2];
    for (sum, terms) in groups.iter_mut().zip(&equivalent.groups) {
        for &(index, size, sign) in terms {
            *sum = added(*sum, Real::new(simd, row(index)), size, sign);
        }
    }
    combined(equivalent, groups)
}

/// `c |x| + d |y|`.
#[inline(always)]
fn weighed<S: Simd>([x, y]: [Real<S>; 2], [c, d]: [Real<S>; 2]) -> Real<S> {
    y.abs().mul_add(d, x.abs() * c)
}

/// The ends of a line with this mean that rises as from one value to another.
#[inline(always)]
fn line<T: Number>(then: T, now: T, mean: T) -> [T; 2] {
    let half = (now - then) * mean.constant(0.5);
    [mean - half, mean + half]
}

impl<S: Simd> PowerIntegral<'_, S> {
    /// The integral over the intervals that end in the block, whose first sample has the index `start`.
    #[inline(always)]
    pub(super) fn over_block(&self, start: usize) -> Real<S> {
        let zero = Real::splat(self.simd, 0.0);
        if !self.travel.moves(start, BLOCK) {
            return zero;
        }
        let mut bends = [zero.lanes; BLOCK];
        let (sum, worst) = match (
            &self.equivalent.groups[..],
            self.equivalent.rule.minor == 1.0 && self.equivalent.rule.opening == 0.0,
        ) {
            ([terms], true) => match terms[..] {
                [(y, y_size, 0.0), (z, z_size, 0.0)] => {
                    self.sum_of_two(start, [(y, y_size), (z, z_size)], &mut bends)
                }
                _ => self.sum(start, &mut bends),
            },
            _ => self.sum(start, &mut bends),
        };
        if worst.less_than(zero).any() { sum + self.over_nonlinear_intervals(start, &bends) } else { sum }
    }

    /// [`Self::sum`] for the rule `c |x| + d |y|`, by the rows x and y and the factors c and d.
    #[inline(always)]
    fn sum_of_two(
        &self,
        start: usize,
        terms: [(usize, f64); 2],
        bends: &mut [S::f64s; BLOCK],
    ) -> (Real<S>, Real<S>) {
        let simd = self.simd;
        let zero = Real::splat(simd, 0.0);
        let [(y, y_size), (z, z_size)] = terms;
        let (first, second, first_means, second_means) =
            (&self.values[y], &self.values[z], &self.means[y], &self.means[z]);
        let mut before = [Real::new(simd, self.last[y]), Real::new(simd, self.last[z])];
        let sizes = [Real::splat(simd, y_size), Real::splat(simd, z_size)];
        let weights = self.weights(start);
        let (mut sums, mut worst) = ([zero; 2], zero);
        for k in 0..BLOCK {
            let now = [Real::new(simd, first[k]), Real::new(simd, second[k])];
            let [x, x_now] = line(before[0], now[0], Real::new(simd, first_means[k]));
            let [y, y_now] = line(before[1], now[1], Real::new(simd, second_means[k]));
            let crossing = (x * x_now).min(y * y_now);
            let (term, bend) =
                self.term(&weights, k, [weighed([x, y], sizes), weighed([x_now, y_now], sizes)], crossing);
            sums[k % 2] = bend.less_than(zero).select(zero, term) + sums[k % 2];
            worst = worst.min(bend);
            bends[k] = bend.lanes;
            before = now;
        }
        (sums[0] + sums[1], worst)
    }

    /// The sum over the intervals of the block on which the load is linear, and numbers that are negative in lanes with other intervals.
    /// `bends`: such numbers for each interval.
    #[inline(always)]
    fn sum(&self, start: usize, bends: &mut [S::f64s; BLOCK]) -> (Real<S>, Real<S>) {
        let zero = Real::splat(self.simd, 0.0);
        let weights = self.weights(start);
        let (mut sums, mut worst) = ([zero; 2], zero);
        for k in 0..BLOCK {
            let (ends, crossing) = self.interval(k);
            let (term, bend) = self.term(&weights, k, ends, crossing);
            sums[k % 2] = bend.less_than(zero).select(zero, term) + sums[k % 2];
            worst = worst.min(bend);
            bends[k] = bend.lanes;
        }
        (sums[0] + sums[1], worst)
    }

    /// The load at both ends of the interval before a sample of the block, and a number that is negative if a component, or A - B, changes
    /// its sign in it, or if a preload may act.
    #[inline(always)]
    fn interval(&self, k: usize) -> ([Real<S>; 2], Real<S>) {
        let zero = Real::splat(self.simd, 0.0);
        let mut crossing = zero;
        let mut groups = [[zero; 2]; 2];
        for (group, terms) in self.equivalent.groups.iter().enumerate().take(2) {
            for &(row, size, sign) in terms {
                let [then, now] = self.ends(row, k);
                groups[0][group] = added(groups[0][group], then, size, sign);
                groups[1][group] = added(groups[1][group], now, size, sign);
                crossing = crossing.min(then * now);
            }
        }
        if self.equivalent.rule.minor != 1.0 {
            crossing = crossing.min((groups[0][0] - groups[0][1]) * (groups[1][0] - groups[1][1]));
        }
        let ends = [combined(self.equivalent, groups[0]), combined(self.equivalent, groups[1])];
        if self.equivalent.rule.opening > 0.0 {
            crossing = crossing.min(ends[0].min(ends[1]) - zero.constant(self.equivalent.rule.opening));
        }
        (ends, crossing)
    }

    /// Weights of the block.
    #[inline(always)]
    fn weights(&self, start: usize) -> [&[f64; BLOCK]; MOST_TERMS] {
        let mut weights = [&[0.0; BLOCK]; MOST_TERMS];
        for (to, all) in weights.iter_mut().zip(&self.travel.weights) {
            if let Some(of_block) = all[start..].first_chunk() {
                *to = of_block;
            }
        }
        weights
    }

    /// The integral over the interval before a sample of the block for a load that is linear from one end to the other. It does not hold in
    /// lanes in which the returned number is negative: that of `crossing` is, or the load changes too much for the series.
    #[inline(always)]
    fn term(
        &self,
        weights: &[&[f64; BLOCK]; MOST_TERMS],
        k: usize,
        [then, now]: [Real<S>; 2],
        crossing: Real<S>,
    ) -> (Real<S>, Real<S>) {
        let (simd, travel) = (self.simd, self.travel);
        let (total, change) = (then + now, now - then);
        let weight = |term: usize| weights[term][k];
        if travel.exponent == 3.0 {
            let [w0, w1, w2, w3] = [weight(0), weight(1), weight(2), weight(3)];
            let low = Real::splat(simd, w0).mul_add(total, Real::splat(simd, w1) * change);
            let high = Real::splat(simd, w2).mul_add(total, Real::splat(simd, w3) * change);
            return ((total * total).mul_add(low, (change * change) * high), crossing);
        }
        let terms = travel.weights.len();
        if travel.whole {
            let (mut sum, mut power) = (Real::splat(simd, weight(0)), change);
            for term in 1..terms {
                sum = sum.mul_add(total, Real::splat(simd, weight(term)) * power);
                power = power * change;
            }
            return (sum, crossing);
        }
        let zero = Real::splat(simd, 0.0);
        let ratio = zero.less_than(total).select(change / total, zero);
        let mut sum = Real::splat(simd, weight(terms - 1));
        for term in (0..terms - 1).rev() {
            sum = sum.mul_add(ratio, Real::splat(simd, weight(term)));
        }
        (sum * self.power(total), self.or_changes_much(crossing, [then, now]))
    }

    /// A number that is negative where `crossing` is, or where a load changes too much for the series of a power that is not whole.
    #[inline(always)]
    fn or_changes_much(&self, crossing: Real<S>, [then, now]: [Real<S>; 2]) -> Real<S> {
        let nearly = crossing.constant(LARGEST_CHANGE_OF_SERIES);
        if self.travel.whole { crossing } else { crossing.min(nearly * (then + now) - (now - then).abs()) }
    }

    /// `load^p`.
    #[inline(always)]
    pub(super) fn power(&self, load: Real<S>) -> Real<S> {
        let mut bases = [0.0; LANES];
        for lane in 0..S::F64_LANES {
            bases[lane] = load.lane(lane);
        }
        let powers = self.travel.power.of(&bases);
        Real::gather(self.simd, |lane| powers[lane])
    }

    /// The values of a row one sample before one of the block.
    #[inline(always)]
    fn before(&self, row: usize, k: usize) -> &S::f64s {
        if k == 0 { &self.last[row] } else { &self.values[row][k - 1] }
    }

    /// The values of a row at both ends of the interval before a sample of the block, of a line with the mean that the row has there.
    #[inline(always)]
    fn ends(&self, row: usize, k: usize) -> [Real<S>; 2] {
        let number = |lanes: &S::f64s| Real::new(self.simd, *lanes);
        line(number(self.before(row, k)), number(&self.values[row][k]), number(&self.means[row][k]))
    }

    /// [`Self::ends`] in one lane.
    #[inline(always)]
    pub(super) fn ends_in(&self, row: usize, k: usize, lane: usize) -> [f64; 2] {
        let number = |lanes: &S::f64s| -> f64 {
            let numbers: &[f64] = bytemuck::cast_slice(core::slice::from_ref(lanes));
            numbers[lane]
        };
        line(number(self.before(row, k)), number(&self.values[row][k]), number(&self.means[row][k]))
    }
}
