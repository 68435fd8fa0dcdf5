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
    /// Values of each row in the block, their extremes, and the last value of each before it.
    pub values: &'a [[S::f64s; BLOCK]],
    pub extremes: &'a [[S::f64s; 2]],
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

impl<S: Simd> PowerIntegral<'_, S> {
    /// The integral over the intervals that end in the block, whose first sample has the index `start`.
    #[inline(always)]
    pub(super) fn over_block(&self, start: usize) -> Real<S> {
        let (simd, travel) = (self.simd, self.travel);
        let zero = Real::splat(simd, 0.0);
        if travel.weights[0][start..start + BLOCK].iter().all(|&weight| weight == 0.0) {
            return zero;
        }
        let groups_now = groups(simd, self.equivalent, self.values);
        let groups_then = groups(simd, self.equivalent, self.last.as_chunks::<1>().0);
        let loads = combined(simd, self.equivalent, &groups_now);
        let [mut before] = combined(simd, self.equivalent, &groups_then);
        let (mut totals, mut changes) = ([zero.lanes; BLOCK], [zero.lanes; BLOCK]);
        for k in 0..BLOCK {
            let [then, now] = [before, loads[k]].map(|load| Real::new(simd, load));
            (totals[k], changes[k]) = ((then + now).lanes, (now - then).lanes);
            before = loads[k];
        }
        let terms = self.series(start, &totals, &changes);
        let bends_anywhere = self.equivalent.is_preloaded()
            || self.equivalent.rule.minor != 1.0
            || !travel.whole
            || self.may_change_sign();
        let mut sum = zero;
        for k in 0..BLOCK {
            let mut term = Real::new(simd, terms[k]);
            if bends_anywhere {
                let [a, b] = [0, 1].map(|group| {
                    let then = if k == 0 { groups_then[group][0] } else { groups_now[group][k - 1] };
                    [then, groups_now[group][k]].map(|load| Real::new(simd, load))
                });
                let [total, change] = [totals[k], changes[k]].map(|load| Real::new(simd, load));
                let bends = self.bends(k, [a[0] - b[0], a[1] - b[1]], total, change);
                if bends.any() {
                    term = self.exact(start, k, bends, term);
                }
            }
            sum = sum + term;
        }
        sum
    }

    /// Lanes in which the load is not linear in the interval before a sample, or, for an exponent that is not whole, not nearly constant.
    /// `differences`: A - B at both ends.
    #[inline(always)]
    fn bends(&self, k: usize, differences: [Real<S>; 2], total: Real<S>, change: Real<S>) -> Mask<S> {
        let zero = Real::splat(self.simd, 0.0);
        let mut bends = zero.less_than(zero.constant(f64::from(u8::from(self.equivalent.is_preloaded()))));
        if self.equivalent.rule.minor != 1.0 {
            bends = bends.or((differences[0] * differences[1]).less_than(zero));
        }
        if !self.travel.whole {
            bends = bends.or((total * zero.constant(NEARLY_CONSTANT)).less_than(change.abs()));
        }
        for row in self.equivalent.rows.into_iter().flatten() {
            let [then, now] = [self.before(row, k), self.values[row][k]].map(|x| Real::new(self.simd, x));
            bends = bends.or((then * now).less_than(zero));
        }
        bends
    }

    /// Whether a component may change its sign in the block, in any lane.
    #[inline(always)]
    fn may_change_sign(&self) -> bool {
        let zero = Real::splat(self.simd, 0.0);
        let mut may = zero.less_than(zero);
        for row in self.equivalent.rows.into_iter().flatten() {
            let [low, high] = self.extremes[row].map(|lanes| Real::new(self.simd, lanes));
            let last = Real::new(self.simd, self.last[row]);
            may = may.or(low.min(last).less_than(zero).and(zero.less_than(high.max(last))));
        }
        may.any()
    }

    /// The value of a row one sample before one of the block.
    #[inline(always)]
    fn before(&self, row: usize, k: usize) -> S::f64s {
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
    fn exact(&self, start: usize, k: usize, bends: Mask<S>, term: Real<S>) -> Real<S> {
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
