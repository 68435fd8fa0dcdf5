//! Equivalent loads, and the integral of their power over the travel, one scene in each lane.

use pulp::Simd;

use super::timeline::BLOCK;
use super::vector::{Mask, Real};
use crate::batch::equivalent::EquivalentRows;
use crate::batch::travel::{NEARLY_CONSTANT, Travel};
use crate::numeric::simd::LANES;

/// The loads of a block, and what they are integrated with.
pub(super) struct PowerIntegral<'a, S: Simd> {
    pub simd: S,
    pub equivalent: &'a EquivalentRows,
    pub travel: &'a Travel,
    /// Values of each row in the block, and the last value of each before it.
    pub values: &'a [[S::f64s; BLOCK]],
    pub last: &'a [S::f64s],
}

/// A and B of a rule at several samples; B is zero for a rule that adds both.
#[inline(always)]
fn groups<S: Simd, const N: usize>(
    simd: S,
    equivalent: &EquivalentRows,
    rows: &[[S::f64s; N]],
) -> [[S::f64s; N]; 2] {
    let mut groups = [[simd.splat_f64s(0.0); N]; 2];
    for (sums, terms) in groups.iter_mut().zip(&equivalent.groups) {
        for &(row, size, sign) in terms {
            let values = &rows[row];
            let (size, slope) = (Real::splat(simd, size), Real::splat(simd, sign));
            for k in 0..N {
                let (value, mut sum) = (Real::new(simd, values[k]), Real::new(simd, sums[k]));
                if sign != 0.0 {
                    sum = value.mul_add(slope, sum);
                }
                sums[k] = value.abs().mul_add(size, sum).lanes;
            }
        }
    }
    groups
}

/// P of the groups, without the effect of a preload.
#[inline(always)]
fn combined<S: Simd, const N: usize>(
    simd: S,
    equivalent: &EquivalentRows,
    [first, second]: &[[S::f64s; N]; 2],
) -> [S::f64s; N] {
    let mut loads = *first;
    if equivalent.rule.minor != 1.0 {
        let minor = Real::splat(simd, equivalent.rule.minor);
        for k in 0..N {
            let (first, second) = (Real::new(simd, first[k]), Real::new(simd, second[k]));
            loads[k] = minor.mul_add(first.min(second), first.max(second)).lanes;
        }
    }
    loads
}

/// Equivalent loads at the samples of a block, without the effect of a preload.
#[inline(always)]
pub(super) fn equivalent_loads<S: Simd>(
    simd: S,
    equivalent: &EquivalentRows,
    values: &[[S::f64s; BLOCK]],
) -> [S::f64s; BLOCK] {
    combined(simd, equivalent, &groups(simd, equivalent, values))
}

/// Lowers the numbers of the intervals in whose lanes the values change their sign below zero.
#[inline(always)]
fn changes_of_sign<S: Simd>(simd: S, bends: &mut [S::f64s; BLOCK], values: &[S::f64s; BLOCK], last: S::f64s) {
    let mut then = Real::new(simd, last);
    for k in 0..BLOCK {
        let now = Real::new(simd, values[k]);
        bends[k] = Real::new(simd, bends[k]).min(then * now).lanes;
        then = now;
    }
}

impl<S: Simd> PowerIntegral<'_, S> {
    /// The integral over the intervals that end in the block, whose first sample has the index `start`.
    #[inline(always)]
    pub(super) fn over_block(&self, start: usize) -> Real<S> {
        let (simd, travel) = (self.simd, self.travel);
        let zero = Real::splat(simd, 0.0);
        if travel.weights[0][start..start + BLOCK].iter().all(|&weight| weight == 0.0) {
            return zero;
        }
        let now = groups(simd, self.equivalent, self.values);
        let last = groups(simd, self.equivalent, self.last.as_chunks::<1>().0);
        let loads = combined(simd, self.equivalent, &now);
        let [mut before] = combined(simd, self.equivalent, &last);
        let (mut totals, mut changes) = ([zero.lanes; BLOCK], [zero.lanes; BLOCK]);
        for k in 0..BLOCK {
            let (then, now) = (Real::new(simd, before), Real::new(simd, loads[k]));
            (totals[k], changes[k]) = ((then + now).lanes, (now - then).lanes);
            before = loads[k];
        }
        let terms = self.series(start, &totals, &changes);
        let bends = self.bends(&now, &last, &totals, &changes);
        let mut sum = zero;
        for k in 0..BLOCK {
            let mut term = Real::new(simd, terms[k]);
            let bends = Real::new(simd, bends[k]).less_than(zero);
            if bends.any() {
                let of_group = |group: usize| {
                    let then = if k == 0 { last[group][0] } else { now[group][k - 1] };
                    [Real::new(simd, then), Real::new(simd, now[group][k])]
                };
                term = self.bent(start, k, bends, term, [of_group(0), of_group(1)]);
            }
            sum = sum + term;
        }
        sum
    }

    /// Numbers that are negative in the lanes in which the load is not linear in the interval before a sample, or, for an exponent that is
    /// not whole, not nearly constant. Groups of the block and of the sample before it, sums and changes of the loads.
    #[inline(always)]
    fn bends(
        &self,
        now: &[[S::f64s; BLOCK]; 2],
        last: &[[S::f64s; 1]; 2],
        totals: &[S::f64s; BLOCK],
        changes: &[S::f64s; BLOCK],
    ) -> [S::f64s; BLOCK] {
        let simd = self.simd;
        let start = if self.equivalent.is_preloaded() { -1.0 } else { 0.0 };
        let mut bends = [simd.splat_f64s(start); BLOCK];
        for row in self.equivalent.rows.into_iter().flatten() {
            changes_of_sign(simd, &mut bends, &self.values[row], self.last[row]);
        }
        if self.equivalent.rule.minor != 1.0 {
            let difference = |a: S::f64s, b: S::f64s| (Real::new(simd, a) - Real::new(simd, b)).lanes;
            let mut differences = now[0];
            for k in 0..BLOCK {
                differences[k] = difference(now[0][k], now[1][k]);
            }
            changes_of_sign(simd, &mut bends, &differences, difference(last[0][0], last[1][0]));
        }
        if !self.travel.whole {
            let nearly = Real::splat(simd, NEARLY_CONSTANT);
            for k in 0..BLOCK {
                let rest = nearly * Real::new(simd, totals[k]) - Real::new(simd, changes[k]).abs();
                bends[k] = Real::new(simd, bends[k]).min(rest).lanes;
            }
        }
        bends
    }

    /// The value of a row one sample before one of the block.
    #[inline(always)]
    pub(super) fn before(&self, row: usize, k: usize) -> S::f64s {
        if k == 0 { self.last[row] } else { self.values[row][k - 1] }
    }

    /// Integrals of the powers of linear loads, by the sums and changes of the loads at the ends of the intervals.
    #[inline(always)]
    fn series(
        &self,
        start: usize,
        totals: &[S::f64s; BLOCK],
        changes: &[S::f64s; BLOCK],
    ) -> [S::f64s; BLOCK] {
        let (simd, travel) = (self.simd, self.travel);
        let zero = Real::splat(simd, 0.0);
        let mut out = [zero.lanes; BLOCK];
        let weights = |term: usize| &travel.weights[term][start..start + BLOCK];
        let (terms, last) = (travel.weights.len(), travel.weights.len() - 1);
        if let [w0, w1, w2, w3] = &travel.weights[..]
            && travel.whole
        {
            let weights = [w0, w1, w2, w3].map(|weights| &weights[start..start + BLOCK]);
            for k in 0..BLOCK {
                let [w0, w1, w2, w3] = weights.map(|weights| Real::splat(simd, weights[k]));
                let [total, change] = [totals[k], changes[k]].map(|load| Real::new(simd, load));
                let low = w0.mul_add(total, w1 * change);
                let high = w2.mul_add(total, w3 * change);
                out[k] = (total * total).mul_add(low, (change * change) * high).lanes;
            }
            return out;
        }
        for k in 0..BLOCK {
            let weight = |term: usize| Real::splat(simd, weights(term)[k]);
            let [total, change] = [totals[k], changes[k]].map(|load| Real::new(simd, load));
            if travel.whole {
                let (mut sum, mut power) = (weight(0), change);
                for term in 1..terms {
                    sum = sum.mul_add(total, weight(term) * power);
                    power = power * change;
                }
                out[k] = sum.lanes;
                continue;
            }
            let ratio = zero.less_than(total).select(change / total, zero);
            let mut sum = weight(last);
            for term in (0..last).rev() {
                sum = sum.mul_add(ratio, weight(term));
            }
            let mut bases = [0.0; LANES];
            for lane in 0..S::F64_LANES {
                bases[lane] = total.lane(lane);
            }
            let powers = travel.power.of(&bases);
            out[k] = (sum * Real::gather(simd, |lane| powers[lane])).lanes;
        }
        out
    }

    /// `term`, and in the lanes in which the load is not linear, the exact integral instead.
    #[inline(always)]
    pub(super) fn exact(&self, start: usize, k: usize, bends: Mask<S>, term: Real<S>) -> Real<S> {
        let simd = self.simd;
        let bends = bends.select(Real::splat(simd, 1.0), Real::splat(simd, 0.0));
        Real::gather(simd, |lane| {
            if bends.lane(lane) == 0.0 {
                return term.lane(lane);
            }
            let at = |values: S::f64s| Real::new(simd, values).lane(lane);
            let first = self.equivalent.components(|row| at(self.before(row, k)));
            let last = self.equivalent.components(|row| at(self.values[row][k]));
            self.equivalent.power(self.travel, start + k, [&first, &last])
        })
    }
}
