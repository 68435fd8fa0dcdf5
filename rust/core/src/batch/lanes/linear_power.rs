//! The integral of the power of an equivalent load over intervals on which it is linear, one in each lane: of scenes side by side, or of instants
//! of one scene.

use guideload_life::Rule;
use pulp::Simd;

use super::vector::{Number, Real};
use crate::batch::equivalent::{EquivalentRows, added};
use crate::batch::travel::{LARGEST_CHANGE_OF_SERIES, Travel};
use crate::numeric::simd::LANES;

/// An equivalent load, its rule in the scenes at hand, and the travel over which its power is integrated.
#[derive(Clone, Copy)]
pub(in crate::batch) struct LinearPower<'a, S: Simd> {
    pub simd: S,
    pub equivalent: &'a EquivalentRows,
    pub rule: &'a Rule<f64>,
    pub travel: &'a Travel,
}

impl<S: Simd> LinearPower<'_, S> {
    /// The load at both ends of an interval, from the values of each row there, and a number that is negative if a component, or A - B, changes
    /// its sign in it, or if a preload may act.
    #[inline(always)]
    pub(in crate::batch) fn ends(&self, of_row: impl Fn(usize) -> [Real<S>; 2]) -> ([Real<S>; 2], Real<S>) {
        let (zero, rule) = (Real::splat(self.simd, 0.0), self.rule);
        let mut crossing = zero;
        let mut groups = [[zero; 2]; 2];
        for (group, terms) in self.equivalent.groups.iter().enumerate().take(2) {
            for &(row, size, sign) in terms {
                let [then, now] = of_row(row);
                groups[0][group] = added(groups[0][group], then, size, sign);
                groups[1][group] = added(groups[1][group], now, size, sign);
                crossing = crossing.min(then * now);
            }
        }
        if rule.plain == 0 {
            crossing = crossing.min((groups[0][0] - groups[0][1]) * (groups[1][0] - groups[1][1]));
        }
        let ends = [rule.combined(groups[0]), rule.combined(groups[1])];
        if rule.opening > 0.0 {
            crossing = crossing.min(ends[0].min(ends[1]) - zero.constant(rule.opening));
        }
        (ends, crossing)
    }

    /// The integral over an interval for a load that is linear from one end to the other, by the weights of the interval in [`Travel::weights`].
    /// It does not hold in lanes in which the returned number is negative: that of `crossing` is, or the load changes too much for the series of
    /// a power that is not whole.
    #[inline(always)]
    pub(in crate::batch) fn integral(
        &self,
        weight: impl Fn(usize) -> Real<S>,
        [then, now]: [Real<S>; 2],
        crossing: Real<S>,
    ) -> (Real<S>, Real<S>) {
        let travel = self.travel;
        let (total, change) = (then + now, now - then);
        if travel.exponent == 3.0 {
            let low = weight(0).mul_add(total, weight(1) * change);
            let high = weight(2).mul_add(total, weight(3) * change);
            return ((total * total).mul_add(low, (change * change) * high), crossing);
        }
        let terms = travel.weights.len();
        if travel.whole {
            let (mut sum, mut power) = (weight(0), change);
            for term in 1..terms {
                sum = sum.mul_add(total, weight(term) * power);
                power = power * change;
            }
            return (sum, crossing);
        }
        let zero = Real::splat(self.simd, 0.0);
        let ratio = zero.less_than(total).select(change / total, zero);
        let mut sum = weight(terms - 1);
        for term in (0..terms - 1).rev() {
            sum = sum.mul_add(ratio, weight(term));
        }
        let most = zero.constant(LARGEST_CHANGE_OF_SERIES) * total;
        (sum * self.power(total), crossing.min(most - change.abs()))
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
}
