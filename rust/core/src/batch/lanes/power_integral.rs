//! The integral of the power of an equivalent load over the travel, one scene in each lane.
//!
//! The sum over a block stays in registers. Intervals on which the load is not linear contribute nothing to it; `nonlinear_intervals` adds them.

use pulp::Simd;

use super::linear_power::LinearPower;
use super::timeline::BLOCK;
use super::vector::{Number, Real};
use crate::batch::equivalent::EquivalentRows;
use crate::batch::travel::{MOST_TERMS, Travel};

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

/// `c |x| + d |y|`.
#[inline(always)]
fn weighed<S: Simd>([x, y]: [Real<S>; 2], [c, d]: [Real<S>; 2]) -> Real<S> {
    y.abs().mul_add(d, x.abs() * c)
}

/// The ends of a line with this mean that rises as from one value to another.
#[inline(always)]
fn line<S: Simd>(then: Real<S>, now: Real<S>, mean: Real<S>) -> [Real<S>; 2] {
    let half = (now - then) * mean.constant(0.5);
    [mean - half, mean + half]
}

impl<S: Simd> PowerIntegral<'_, S> {
    /// Integrals over intervals on which the load is linear.
    #[inline(always)]
    pub(super) fn linear_power(&self) -> LinearPower<'_, S> {
        let Self { simd, equivalent, travel, .. } = *self;
        LinearPower { simd, equivalent, rule: &equivalent.rule, travel }
    }

    /// The integral over the intervals that end in the block, whose first sample has the index `start`.
    #[inline(always)]
    pub(super) fn over_block(&self, start: usize) -> Real<S> {
        let zero = Real::splat(self.simd, 0.0);
        if !self.travel.moves(start, BLOCK) {
            return zero;
        }
        let (linear, equivalent) = (self.linear_power(), self.equivalent);
        let mut bends = [zero.lanes; BLOCK];
        let is_plain = equivalent.rule.plain != 0 && equivalent.rule.opening == 0.0;
        let (sum, worst) = match equivalent.groups.first().map(|terms| &terms[..]) {
            // Of two magnitudes, as usual, without a loop over them.
            Some(&[(y, y_size, 0.0), (z, z_size, 0.0)]) if is_plain => {
                let sizes = [Real::splat(self.simd, y_size), Real::splat(self.simd, z_size)];
                self.sum(
                    start,
                    &mut bends,
                    #[inline(always)]
                    |k| {
                        let ([y, y_now], [z, z_now]) = (self.ends(y, k), self.ends(z, k));
                        let ends = [weighed([y, z], sizes), weighed([y_now, z_now], sizes)];
                        (ends, (y * y_now).min(z * z_now))
                    },
                )
            }
            _ => self.sum(
                start,
                &mut bends,
                #[inline(always)]
                |k| {
                    linear.ends(
                        #[inline(always)]
                        |row| self.ends(row, k),
                    )
                },
            ),
        };
        if worst.less_than(zero).any() { sum + self.over_nonlinear_intervals(start, &bends) } else { sum }
    }

    /// The sum over the intervals of the block on which the load is linear, and numbers that are negative in lanes with other intervals.
    /// `bends`: such numbers for each interval; `ends`: the load at both ends of the interval before a sample, and a number that is negative
    /// where it is not linear between them.
    #[inline(always)]
    fn sum(
        &self,
        start: usize,
        bends: &mut [S::f64s; BLOCK],
        ends: impl Fn(usize) -> ([Real<S>; 2], Real<S>),
    ) -> (Real<S>, Real<S>) {
        let (linear, zero) = (self.linear_power(), Real::splat(self.simd, 0.0));
        let weights = self.weights(start);
        let (mut sums, mut worst) = ([zero; 2], zero);
        for k in 0..BLOCK {
            let (ends, crossing) = ends(k);
            let (term, bend) = linear.integral(
                #[inline(always)]
                |term| Real::splat(self.simd, weights[term][k]),
                ends,
                crossing,
            );
            sums[k % 2] = bend.less_than(zero).select(zero, term) + sums[k % 2];
            worst = worst.min(bend);
            bends[k] = bend.lanes;
        }
        (sums[0] + sums[1], worst)
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

    /// The values of a row at both ends of the interval before a sample of the block, of a line with the mean that the row has there.
    #[inline(always)]
    fn ends(&self, row: usize, k: usize) -> [Real<S>; 2] {
        let then = if k == 0 { self.last[row] } else { self.values[row][k - 1] };
        let number = |lanes: S::f64s| Real::new(self.simd, lanes);
        line(number(then), number(self.values[row][k]), number(self.means[row][k]))
    }

    /// [`Self::ends`] in one lane.
    #[inline(always)]
    pub(super) fn ends_in(&self, row: usize, k: usize, lane: usize) -> [f64; 2] {
        let [then, now] = self.ends(row, k);
        [then.lane(lane), now.lane(lane)]
    }
}
