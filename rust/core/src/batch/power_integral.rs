//! Equivalent loads of one run, and the integral of their power over the travel, block by block.

use super::equivalent::EquivalentRows;
use super::load_rows::{BLOCK, Values};
use super::travel::{LARGEST_CHANGE_OF_SERIES, Travel};
use crate::life::Rule;
use crate::numeric::float::fma;
use crate::numeric::simd::LANES;

/// Groups of the rule at the starts (0) or ends (1) of the intervals of a block.
#[cfg_attr(feature = "std", inline(always))]
fn groups(equivalent: &EquivalentRows, lines: &[[Values; 2]], end: usize) -> [Values; 2] {
    let mut groups = [[0.0; BLOCK]; 2];
    for (sums, terms) in groups.iter_mut().zip(&equivalent.groups) {
        for &(row, size, sign) in terms {
            let values = &lines[row][end];
            for i in 0..BLOCK {
                sums[i] = fma(values[i].abs(), size, fma(values[i], sign, sums[i]));
            }
        }
    }
    groups
}

#[cfg_attr(feature = "std", inline(always))]
fn combined([first, second]: [f64; 2], minor: f64) -> f64 {
    let (larger, smaller) = if first >= second { (first, second) } else { (second, first) };
    fma(minor, smaller, larger)
}

/// Integral of the power of the equivalent load over the intervals that end in a block, the first instant of which has the index `before`.
/// `lines`: the values of each row at the starts and ends of these intervals.
#[cfg_attr(feature = "std", inline(always))]
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
    let minor = equivalent.rule.minor;
    // Intervals on which the load is not linear.
    let mut bends = [false; BLOCK];
    for &row in equivalent.rows.iter().flatten() {
        let [then, now] = &lines[row];
        for i in 0..BLOCK {
            bends[i] |= then[i] * now[i] < 0.0;
        }
    }
    let mut sums = [0.0; BLOCK];
    let mut changes = [0.0; BLOCK];
    let (earlier, groups) = (groups(equivalent, lines, 0), groups(equivalent, lines, 1));
    for i in 0..BLOCK {
        let (now, then) = ([groups[0][i], groups[1][i]], [earlier[0][i], earlier[1][i]]);
        bends[i] |= minor != 1.0 && (now[0] - now[1]) * (then[0] - then[1]) < 0.0;
        let (now, then) = (combined(now, minor), combined(then, minor));
        (sums[i], changes[i]) = (now + then, now - then);
        bends[i] |= now < rule.opening || then < rule.opening;
        bends[i] |= !travel.whole && changes[i].abs() > LARGEST_CHANGE_OF_SERIES * sums[i];
    }
    let mut powers = series(travel, before, &sums, &changes);
    for i in 0..BLOCK {
        if bends[i] {
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

/// Integrals of the powers of linear loads, by the sums and changes of the loads at the ends of the intervals.
#[cfg_attr(feature = "std", inline(always))]
fn series(travel: &Travel, before: usize, sums: &Values, changes: &Values) -> Values {
    let weights = |term: usize| &travel.weights[term][before..before + BLOCK];
    let terms = travel.weights.len();
    let mut out = [0.0; BLOCK];
    if travel.whole {
        let mut powers = [1.0; BLOCK];
        for term in 0..terms {
            let weights = weights(term);
            for i in 0..BLOCK {
                out[i] = fma(out[i], sums[i], weights[i] * powers[i]);
                powers[i] *= changes[i];
            }
        }
        return out;
    }
    for term in (0..terms).rev() {
        let weights = weights(term);
        for i in 0..BLOCK {
            let ratio = if sums[i] > 0.0 { changes[i] / sums[i] } else { 0.0 };
            out[i] = fma(out[i], ratio, weights[i]);
        }
    }
    let mut powers = *sums;
    travel.power.raise(&mut powers);
    for i in 0..BLOCK {
        out[i] *= powers[i];
    }
    out
}
