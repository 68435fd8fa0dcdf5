//! The integral of the power of an equivalent load of one run over the travel, block by block.

use pulp::{Simd, WithSimd};

use super::equivalent::EquivalentRows;
use super::lanes::{LinearPower, Real};
use super::load_rows::{BLOCK, Values};
use super::travel::Travel;
use crate::life::Rule;
use crate::numeric::simd::{LANES, on_widest};

/// Integral of the power of the equivalent load over the intervals that end in a block, the first instant of which has the index `before`.
/// `lines`: the values of each row at the starts and ends of these intervals.
pub(super) fn power_integral(
    equivalent: &EquivalentRows,
    rule: &Rule<f64>,
    travel: &Travel,
    lines: &[[Values; 2]],
    before: usize,
) -> f64 {
    if !travel.moves(before, BLOCK) {
        return 0.0;
    }
    let (mut powers, mut bends) = ([0.0; BLOCK], [0.0; BLOCK]);
    let (to, bends_to) = (&mut powers, &mut bends);
    on_widest(LinearIntervals { equivalent, rule, travel, lines, before, powers: to, bends: bends_to });
    for i in 0..BLOCK {
        if bends[i] < 0.0 {
            let [then, now] = [0, 1].map(|end| equivalent.components(|row| lines[row][end][i]));
            powers[i] = equivalent.power(rule, travel, before + i, [&then, &now]);
        }
    }
    let mut partial = [0.0; LANES];
    for powers in powers.as_chunks::<LANES>().0 {
        for i in 0..LANES {
            partial[i] += powers[i];
        }
    }
    partial.iter().sum()
}

/// The integrals over intervals on which the load is linear, several side by side.
struct LinearIntervals<'a> {
    equivalent: &'a EquivalentRows,
    rule: &'a Rule<f64>,
    travel: &'a Travel,
    lines: &'a [[Values; 2]],
    before: usize,
    powers: &'a mut Values,
    /// Negative where the load is not linear.
    bends: &'a mut Values,
}

impl WithSimd for LinearIntervals<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { equivalent, rule, travel, lines, before, powers, bends } = self;
        let linear = LinearPower { simd, equivalent, rule, travel };
        let powers = S::as_mut_simd_f64s(powers).0.iter_mut();
        let bends = S::as_mut_simd_f64s(bends).0.iter_mut();
        for (index, (power, bend)) in powers.zip(bends).enumerate() {
            let (ends, crossing) = linear.ends(
                #[inline(always)]
                |row| {
                    let [then, now] = &lines[row];
                    [
                        Real::new(simd, S::as_simd_f64s(then).0[index]),
                        Real::new(simd, S::as_simd_f64s(now).0[index]),
                    ]
                },
            );
            let (integral, crossing) = linear.integral(
                #[inline(always)]
                |term| {
                    let weights = &travel.weights[term][before..before + BLOCK];
                    Real::new(simd, S::as_simd_f64s(weights).0[index])
                },
                ends,
                crossing,
            );
            (*power, *bend) = (integral.lanes, crossing.lanes);
        }
    }
}
