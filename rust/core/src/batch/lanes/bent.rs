//! Integrals over the intervals on which the equivalent load is not linear, one scene in each lane.

use pulp::Simd;

use super::power_integral::PowerIntegral;
use super::vector::{Mask, Real};
use crate::numeric::simd::LANES;

/// Fractions of an interval, and the load at both of them; the load is linear between them.
#[derive(Clone, Copy)]
struct Piece<S: Simd> {
    at: [Real<S>; 2],
    loads: [Real<S>; 2],
}

impl<S: Simd> PowerIntegral<'_, S> {
    /// `term`, and in the lanes of `bends` the integral over the interval before a sample, in two pieces on which the load is linear. The
    /// few lanes with more pieces are integrated one by one. `groups`: A and B at both ends.
    #[inline(always)]
    pub(super) fn bent(
        &self,
        start: usize,
        k: usize,
        bends: Mask<S>,
        term: Real<S>,
        groups: [[Real<S>; 2]; 2],
    ) -> Real<S> {
        let one_way = self.travel.one_way.get(start + k).copied().flatten();
        let Some(speed) = one_way.filter(|_| !self.equivalent.is_preloaded()) else {
            return self.exact(start, k, bends, term);
        };
        let (cut, middle, mut more) = self.cut(k, groups);
        let (zero, one) = (term.constant(0.0), term.constant(1.0));
        let [first, last] = [0, 1].map(|end| self.combined(groups[0][end], groups[1][end]));
        let mut sum = zero;
        for piece in [
            Piece { at: [zero, cut], loads: [first, middle] },
            Piece { at: [cut, one], loads: [middle, last] },
        ] {
            let (integral, differs_much) = self.linear(speed, piece);
            sum = sum + integral;
            more = more.or(differs_much);
        }
        let more = more.and(bends);
        let term = bends.select(sum, term);
        if more.any() { self.exact(start, k, more, term) } else { term }
    }

    /// The fraction of the interval at which a component or A - B changes its sign, the load there, and the lanes in which there are more
    /// changes than this one. In the middle if there is none.
    #[inline(always)]
    fn cut(&self, k: usize, groups: [[Real<S>; 2]; 2]) -> (Real<S>, Real<S>, Mask<S>) {
        let simd = self.simd;
        let (zero, one) = (Real::splat(simd, 0.0), Real::splat(simd, 1.0));
        let (mut from, mut drop) = (one, one + one);
        let mut found = zero.less_than(zero);
        let mut more = found;
        let two_groups = self.equivalent.rule.minor != 1.0;
        let differences = [groups[0][0] - groups[1][0], groups[0][1] - groups[1][1]];
        if two_groups {
            let crosses = (differences[0] * differences[1]).less_than(zero);
            from = crosses.select(differences[0], from);
            drop = crosses.select(differences[0] - differences[1], drop);
        }
        for row in self.equivalent.rows.into_iter().flatten() {
            let then = Real::new(simd, self.before(row, k));
            let now = Real::new(simd, self.values[row][k]);
            let crosses = (then * now).less_than(zero);
            more = more.or(found.and(crosses));
            found = found.or(crosses);
            from = crosses.select(then, from);
            drop = crosses.select(then - now, drop);
        }
        let cut = from / drop;
        let mut at_cut = [zero; 2];
        for (sum, terms) in at_cut.iter_mut().zip(&self.equivalent.groups) {
            for &(row, size, sign) in terms {
                let then = Real::new(simd, self.before(row, k));
                let value = cut.mul_add(Real::new(simd, self.values[row][k]) - then, then);
                if sign != 0.0 {
                    *sum = value.mul_add(Real::splat(simd, sign), *sum);
                }
                *sum = value.abs().mul_add(Real::splat(simd, size), *sum);
            }
        }
        if two_groups {
            let difference = at_cut[0] - at_cut[1];
            let crosses = |end: Real<S>| (end * difference).less_than(zero);
            more = more.or(found.and(crosses(differences[0]).or(crosses(differences[1]))));
        }
        (cut, self.combined(at_cut[0], at_cut[1]), more)
    }

    /// P of the groups A and B.
    #[inline(always)]
    fn combined(&self, first: Real<S>, second: Real<S>) -> Real<S> {
        if self.equivalent.rule.minor == 1.0 {
            return first;
        }
        first.constant(self.equivalent.rule.minor).mul_add(first.min(second), first.max(second))
    }

    /// The integral over a piece, by the speed of [`crate::life::Interval::one_way`], and the lanes in which the load changes too much
    /// for the series.
    #[inline(always)]
    fn linear(&self, speed: [f64; 3], Piece { at, loads }: Piece<S>) -> (Real<S>, Mask<S>) {
        let simd = self.simd;
        let zero = Real::splat(simd, 0.0);
        let [start, change, bend] = speed.map(|coefficient| Real::splat(simd, coefficient));
        let half = zero.constant(0.5);
        let (middle, width) = (half * (at[0] + at[1]), at[1] - at[0]);
        let reach = half * width;
        // Coefficients of 1, x and x² of the speed, x from -1 to 1.
        let even = middle.mul_add(bend.mul_add(middle - zero.constant(1.0), change), start);
        let odd = reach * bend.mul_add(at[0] + at[1] - zero.constant(1.0), change);
        let square = reach * reach * bend;
        let (load, rise) = (half * (loads[0] + loads[1]), half * (loads[1] - loads[0]));
        if self.travel.exponent == 3.0 {
            let (of_load, of_rise) = (load * load, rise * rise);
            let first = square.mul_add(zero.constant(1.0 / 3.0), even);
            let second = square.mul_add(zero.constant(0.6), even);
            let by_load = of_load.mul_add(first, of_rise * second);
            let by_rise = odd * of_rise.mul_add(zero.constant(0.2), of_load);
            return (width * load.mul_add(by_load, rise * by_rise), zero.less_than(zero));
        }
        let ratio = zero.less_than(load).select(rise / load, zero);
        let squared = ratio * ratio;
        let mut sums = [zero; 3];
        for coefficients in self.travel.on_piece.iter().rev() {
            for (sum, coefficient) in sums.iter_mut().zip(coefficients) {
                *sum = sum.mul_add(squared, zero.constant(*coefficient));
            }
        }
        let of_odd = ratio * sums[2];
        let sum = even.mul_add(sums[0], square.mul_add(sums[1], odd * of_odd));
        let differs_much = zero.constant(self.travel.largest_ratio()).less_than(ratio.abs());
        let mut bases = [0.0; LANES];
        for lane in 0..S::F64_LANES {
            bases[lane] = load.lane(lane);
        }
        let powers = self.travel.power.of(&bases);
        let power = Real::gather(simd, |lane| powers[lane]);
        (width * power * sum, differs_much)
    }
}
