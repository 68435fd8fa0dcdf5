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
    /// Values of each row in the block, their extremes, and the last values before it.
    pub values: &'a [[S::f64s; BLOCK]],
    pub extremes: &'a [[S::f64s; 2]],
    pub last: &'a [S::f64s],
}

/// A and B of a rule; B is zero for a rule that adds both.
#[inline(always)]
fn groups<S: Simd>(simd: S, equivalent: &EquivalentRows, row: impl Fn(usize) -> S::f64s) -> [Real<S>; 2] {
    let mut groups = [Real::splat(simd, 0.0); 2];
    for (sum, terms) in groups.iter_mut().zip(&equivalent.groups) {
        for &(index, size, sign) in terms {
            let value = Real::new(simd, row(index));
            let rest = if sign == 0.0 { *sum } else { value.mul_add(Real::splat(simd, sign), *sum) };
            *sum = value.abs().mul_add(Real::splat(simd, size), rest);
        }
    }
    groups
}

#[inline(always)]
fn combined<S: Simd>(equivalent: &EquivalentRows, [first, second]: [Real<S>; 2]) -> Real<S> {
    if equivalent.rule.minor == 1.0 {
        return first; // the rule adds both
    }
    first.constant(equivalent.rule.minor).mul_add(first.min(second), first.max(second))
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
        loads[k] = combined(equivalent, groups(simd, equivalent, |row| values[row][k])).lanes;
    }
    loads
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
        let minor = self.equivalent.rule.minor;
        let never = zero.less_than(zero);
        let may_change = self.may_change_sign();
        let mut sum = zero;
        let mut then = groups(simd, self.equivalent, |row| self.last[row]);
        for k in 0..BLOCK {
            let now = groups(simd, self.equivalent, |row| self.values[row][k]);
            let [before, after] = [combined(self.equivalent, then), combined(self.equivalent, now)];
            let (total, change) = (before + after, after - before);
            let mut bends = if self.equivalent.is_preloaded() { never.not() } else { never };
            if may_change {
                bends = bends.or(self.changes_sign(k));
            }
            if minor != 1.0 {
                bends = bends.or(((now[0] - now[1]) * (then[0] - then[1])).less_than(zero));
            }
            if !travel.whole {
                bends = bends.or((total * zero.constant(NEARLY_CONSTANT)).less_than(change.abs()));
            }
            let mut term = self.series(start + k, total, change);
            if bends.any() {
                term = self.exact(start, k, bends, term);
            }
            sum = sum + term;
            then = now;
        }
        sum
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

    /// Lanes in which a component changes its sign in the interval before a sample of the block.
    #[inline(always)]
    fn changes_sign(&self, k: usize) -> Mask<S> {
        let zero = Real::splat(self.simd, 0.0);
        let mut changes = zero.less_than(zero);
        for row in self.equivalent.rows.into_iter().flatten() {
            let [then, now] = [self.before(row, k), self.values[row][k]].map(|x| Real::new(self.simd, x));
            changes = changes.or((then * now).less_than(zero));
        }
        changes
    }

    /// The value of a row one sample before one of the block.
    #[inline(always)]
    fn before(&self, row: usize, k: usize) -> S::f64s {
        if k == 0 { self.last[row] } else { self.values[row][k - 1] }
    }

    /// Integral of the power of a linear load over the interval before a sample, by the sum and the change of the loads at its ends.
    #[inline(always)]
    fn series(&self, sample: usize, total: Real<S>, change: Real<S>) -> Real<S> {
        let (simd, travel) = (self.simd, self.travel);
        let weight = |term: usize| Real::splat(simd, travel.weights[term][sample]);
        let terms = travel.weights.len();
        if travel.whole {
            let (mut out, mut power) = (weight(0), change);
            for term in 1..terms {
                out = out.mul_add(total, weight(term) * power);
                power = power * change;
            }
            return out;
        }
        let zero = Real::splat(simd, 0.0);
        let ratio = zero.less_than(total).select(change / total, zero);
        let mut out = weight(terms - 1);
        for term in (0..terms - 1).rev() {
            out = out.mul_add(ratio, weight(term));
        }
        let mut totals = [0.0; LANES];
        for lane in 0..S::F64_LANES {
            totals[lane] = total.lane(lane);
        }
        let powers = travel.power.of(&totals);
        out * Real::gather(simd, |lane| powers[lane])
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
