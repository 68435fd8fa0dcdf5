//! Integrals over the intervals on which the equivalent load is not linear.
//!
//! In an interval, few lanes have such a load. So the intervals of all lanes of a block are collected, and then integrated side by side, one
//! in each lane.

use pulp::Simd;

use super::power_integral::PowerIntegral;
use super::timeline::BLOCK;
use super::vector::{Mask, Number, Real};
use crate::batch::equivalent::added;
use crate::life::{COMPONENTS, LAST_GAP, NEARLY_CONSTANT, mean_by_series};
use crate::numeric::simd::LANES;

/// An interval of a lane, by the sample of the block at which it ends.
#[derive(Clone, Copy, Default)]
struct NonlinearInterval {
    sample: usize,
    lane: usize,
}

/// Fractions of an interval, and the load at both of them; the load is linear between them.
#[derive(Clone, Copy)]
struct Piece<S: Simd> {
    at: [Real<S>; 2],
    loads: [Real<S>; 2],
}

impl<S: Simd> PowerIntegral<'_, S> {
    /// The sum over the intervals of a block on which the load is not linear, where the number of `bends` is negative. A lane adds its intervals
    /// in their order, so that the sum does not depend on the other lanes.
    #[inline(always)]
    pub(super) fn over_nonlinear_intervals(&self, start: usize, bends: &[S::f64s; BLOCK]) -> Real<S> {
        let zero = Real::splat(self.simd, 0.0);
        let (mut all, mut count) = ([NonlinearInterval::default(); BLOCK * LANES], 0);
        for sample in 0..BLOCK {
            let bend = Real::new(self.simd, bends[sample]);
            if bend.less_than(zero).any() {
                for lane in 0..S::F64_LANES {
                    all[count] = NonlinearInterval { sample, lane };
                    count += usize::from(bend.lane(lane) < 0.0);
                }
            }
        }
        let mut sums = [0.0; LANES];
        for some in all[..count].chunks(S::F64_LANES) {
            self.add(start, some, &mut sums);
        }
        Real::gather(self.simd, |lane| sums[lane])
    }

    /// Adds the integrals over some intervals, at most one for each lane of a vector, to the sums of their lanes. The few with more than two
    /// pieces are integrated one by one.
    #[inline(always)]
    fn add(&self, start: usize, some: &[NonlinearInterval], sums: &mut [f64; LANES]) {
        let simd = self.simd;
        let zero = Real::splat(simd, 0.0);
        let mut speeds = [[0.0; LANES]; 3];
        let rule = &self.equivalent.rule;
        let has_rows = rule.opening > 0.0 && rule.preload_form >= 2;
        let mut one_by_one = [rule.opening > 0.0 && !has_rows; LANES];
        for (place, interval) in some.iter().enumerate() {
            let speed = self.travel.one_way.get(start + interval.sample).copied().flatten();
            one_by_one[place] |= speed.is_none();
            for (order, coefficient) in speed.unwrap_or_default().into_iter().enumerate() {
                speeds[order][place] = coefficient;
            }
        }
        let speed = [self.vector(&speeds[0]), self.vector(&speeds[1]), self.vector(&speeds[2])];
        let (pieces, mut more) = self.pieces(some);
        let mut sum = zero;
        for piece in pieces {
            let plain = self.linear(speed, piece);
            let (integral, differs_much) = if has_rows { self.of_rows(speed, piece, plain) } else { plain };
            sum = sum + integral;
            more = more.or(differs_much);
        }
        let more = more.select(zero.constant(1.0), zero);
        for (place, &NonlinearInterval { sample, lane }) in some.iter().enumerate() {
            sums[lane] += if one_by_one[place] || more.lane(place) > 0.0 {
                let end = |end: usize| self.equivalent.components(|row| self.ends_in(row, sample, lane)[end]);
                self.equivalent.power(&self.equivalent.rule, self.travel, start + sample, [&end(0), &end(1)])
            } else {
                sum.lane(place)
            };
        }
    }

    #[inline(always)]
    fn vector(&self, numbers: &[f64; LANES]) -> Real<S> {
        Real::gather(self.simd, |lane| numbers[lane])
    }

    /// The pieces before and after the change of sign of a component, or of A - B; the whole, and nothing, if there is none. And where there
    /// are more pieces.
    #[inline(always)]
    fn pieces(&self, some: &[NonlinearInterval]) -> ([Piece<S>; 2], Mask<S>) {
        let simd = self.simd;
        let (zero, one) = (Real::splat(simd, 0.0), Real::splat(simd, 1.0));
        let (mut from, mut drop) = (one, one);
        let mut found = zero.less_than(zero);
        let mut more = found;
        let (mut components, mut groups) = ([[[zero; 2]; COMPONENTS]; 2], [[zero; 2]; 3]);
        for (group, terms) in self.equivalent.groups.iter().enumerate().take(2) {
            for (&(row, size, sign), component) in terms.iter().zip(&mut components[group]) {
                let mut ends = [[0.0; LANES]; 2];
                for (place, interval) in some.iter().enumerate() {
                    [ends[0][place], ends[1][place]] = self.ends_in(row, interval.sample, interval.lane);
                }
                let [then, now] = [self.vector(&ends[0]), self.vector(&ends[1])];
                *component = [then, now];
                groups[0][group] = added(groups[0][group], then, size, sign);
                groups[2][group] = added(groups[2][group], now, size, sign);
                let crosses = (then * now).less_than(zero);
                more = more.or(found.and(crosses));
                found = found.or(crosses);
                from = crosses.select(then, from);
                drop = crosses.select(then - now, drop);
            }
        }
        let differences = [groups[0][0] - groups[0][1], groups[2][0] - groups[2][1]];
        let two_groups = self.equivalent.rule.plain == 0;
        if two_groups {
            let crosses = (differences[0] * differences[1]).less_than(zero).and_not(found);
            from = crosses.select(differences[0], from);
            drop = crosses.select(differences[0] - differences[1], drop);
        }
        let cut = from / drop;
        for (group, terms) in self.equivalent.groups.iter().enumerate().take(2) {
            for (&(_, size, sign), [then, now]) in terms.iter().zip(components[group]) {
                groups[1][group] = added(groups[1][group], cut.mul_add(now - then, then), size, sign);
            }
        }
        if two_groups {
            let difference = groups[1][0] - groups[1][1];
            for end in differences {
                more = more.or(found.and((end * difference).less_than(zero)));
            }
        }
        let [first, middle, last] = groups;
        let rule = &self.equivalent.rule;
        let (first, middle, last) = (rule.combined(first), rule.combined(middle), rule.combined(last));
        let before = Piece { at: [zero, cut], loads: [first, middle] };
        ([before, Piece { at: [cut, one], loads: [middle, last] }], more)
    }

    /// The length of a piece, and the coefficients of 1, x and x² of the speed on it, x from -1 to 1.
    #[inline(always)]
    fn speed_on(&self, [start, change, bend]: [Real<S>; 3], at: [Real<S>; 2]) -> (Real<S>, [Real<S>; 3]) {
        let one = Real::splat(self.simd, 1.0);
        let half = one.constant(0.5);
        let (middle, width) = (half * (at[0] + at[1]), at[1] - at[0]);
        let reach = half * width;
        let even = middle.mul_add(bend.mul_add(middle - one, change), start);
        let odd = reach * bend.mul_add(at[0] + at[1] - one, change);
        (width, [even, odd, reach * reach * bend])
    }

    /// The integral over a piece under two preloaded rows, by their series, and the lanes in which it does not hold; above the opening, as
    /// without preload.
    #[inline(always)]
    fn of_rows(
        &self,
        speed: [Real<S>; 3],
        Piece { at, loads }: Piece<S>,
        (plain, differs_much): (Real<S>, Mask<S>),
    ) -> (Real<S>, Mask<S>) {
        let (simd, rule) = (self.simd, &self.equivalent.rule);
        let (one, half) = (Real::splat(simd, 1.0), Real::splat(simd, 0.5));
        let (load, rise) = (half * (loads[0] + loads[1]), half * (loads[1] - loads[0]));
        let rows = rule.rows(load);
        let below = loads[0].min(loads[1]).less_than(rows.opening);
        let gap = one - loads[0].max(loads[1]) / rows.opening;
        let change = (loads[1] - loads[0]).abs() / rows.opening;
        let smooth =
            one.constant(LAST_GAP).less_than(gap).and(change.less_than(one.constant(NEARLY_CONSTANT) * gap));
        let (width, speed) = self.speed_on(speed, at);
        let exponent = self.travel.exponent;
        let mean = mean_by_series(exponent, rows.series(load), rise, speed, |row| {
            if exponent == 3.0 { row * row * row } else { self.linear_power().power(row) }
        });
        (below.select(width * mean, plain), below.and_not(smooth).or(differs_much.and_not(below)))
    }

    /// The integral over a piece, by the speed of [`Travel::one_way`](crate::batch::travel::Travel), and the lanes in which the load changes too much
    /// for the series.
    #[inline(always)]
    fn linear(
        &self,
        [start, change, bend]: [Real<S>; 3],
        Piece { at, loads }: Piece<S>,
    ) -> (Real<S>, Mask<S>) {
        let zero = Real::splat(self.simd, 0.0);
        let half = zero.constant(0.5);
        let (width, [even, odd, square]) = self.speed_on([start, change, bend], at);
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
        (width * self.linear_power().power(load) * sum, differs_much)
    }
}
