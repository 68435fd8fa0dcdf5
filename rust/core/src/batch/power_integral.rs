//! Equivalent loads of one run, and the integral of their power over the travel, block by block.

use super::equivalent::EquivalentRows;
use super::load_rows::{BLOCK, Values};
use super::travel::{NEARLY_CONSTANT, Travel};
use crate::life::{COMPONENTS, Rule};
use crate::numeric::float::fma;
use crate::numeric::simd::LANES;

/// Components of a load, and the groups of its rule, at the last instant before a block.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ends {
    components: [f64; COMPONENTS],
    groups: [f64; 2],
}

/// Groups of the rule at the instants of a block.
#[cfg_attr(feature = "std", inline(always))]
fn groups(equivalent: &EquivalentRows, rows: &[Values]) -> [Values; 2] {
    let mut groups = [[0.0; BLOCK]; 2];
    for (sums, terms) in groups.iter_mut().zip(&equivalent.groups) {
        for &(row, size, sign) in terms {
            let values = &rows[row];
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

/// The values one instant before.
#[cfg_attr(feature = "std", inline(always))]
fn earlier(values: &Values, before: f64) -> Values {
    let mut out = [before; BLOCK];
    out[1..].copy_from_slice(&values[..BLOCK - 1]);
    out
}

/// Integral of the power of the equivalent load over the intervals that end in a block, the first instant of which has the index `before`.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn power_integral(
    equivalent: &EquivalentRows,
    rule: &Rule<f64>,
    travel: &Travel,
    rows: &[Values],
    before: usize,
    ends: &mut Ends,
) -> f64 {
    let components = |i: usize| equivalent.components(|row| rows[row][i]);
    let groups = groups(equivalent, rows);
    if before == 0 {
        *ends = Ends { components: components(0), groups: groups.map(|group| group[0]) };
    }
    let Ends { components: last, groups: of_last } = *ends;
    *ends = Ends { components: components(BLOCK - 1), groups: groups.map(|group| group[BLOCK - 1]) };
    if !travel.moves(before, BLOCK) {
        return 0.0;
    }
    let minor = equivalent.rule.minor;
    // Intervals on which the load is not linear.
    let mut bends = [false; BLOCK];
    for (row, last) in equivalent.rows.iter().zip(last) {
        if let Some(row) = *row {
            let earlier = earlier(&rows[row], last);
            for i in 0..BLOCK {
                bends[i] |= earlier[i] * rows[row][i] < 0.0;
            }
        }
    }
    let mut sums = [0.0; BLOCK];
    let mut changes = [0.0; BLOCK];
    let earlier = [earlier(&groups[0], of_last[0]), earlier(&groups[1], of_last[1])];
    for i in 0..BLOCK {
        let (now, then) = ([groups[0][i], groups[1][i]], [earlier[0][i], earlier[1][i]]);
        bends[i] |= minor != 1.0 && (now[0] - now[1]) * (then[0] - then[1]) < 0.0;
        let (now, then) = (combined(now, minor), combined(then, minor));
        (sums[i], changes[i]) = (now + then, now - then);
        bends[i] |= now < rule.opening || then < rule.opening;
        bends[i] |= !travel.whole && changes[i].abs() > NEARLY_CONSTANT * sums[i];
    }
    let mut powers = series(travel, before, &sums, &changes);
    for i in 0..BLOCK {
        if bends[i] {
            let first = if i == 0 { last } else { components(i - 1) };
            powers[i] = equivalent.power(rule, travel, before + i, [&first, &components(i)]);
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
