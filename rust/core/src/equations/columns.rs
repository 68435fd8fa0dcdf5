//! Matrices by columns.

use crate::numeric::float::{add_columns, add_scaled, scale};
use crate::system::State;

/// Columns of 12 entries.
pub(crate) type Columns<const N: usize> = [[f64; 12]; N];

/// Both halves of a matrix as one.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn whole(halves: &[Columns<6>; 2]) -> &Columns<12> {
    &halves.as_flattened().as_chunks().0[0]
}

/// `parts` and a matrix times `vector`, in three sums side by side: each addition to a single sum would wait for the one before.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn three_sums(parts: [State; 3], matrix: &Columns<12>, vector: &State) -> State {
    let [mut sum, mut second, mut third] = parts;
    for j in (0..12).step_by(3) {
        add_scaled(&mut sum, &matrix[j], vector[j]);
        add_scaled(&mut second, &matrix[j + 1], vector[j + 1]);
        add_scaled(&mut third, &matrix[j + 2], vector[j + 2]);
    }
    for i in 0..12 {
        sum[i] += second[i] + third[i];
    }
    sum
}

/// `left` times the rows of `right` from ROW on.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn product<const ROW: usize, const K: usize, const N: usize>(
    left: &Columns<K>,
    right: &Columns<N>,
) -> Columns<N> {
    let mut out = [[0.0; 12]; N];
    add_product::<ROW, K, N>(&mut out, left, right);
    out
}

/// Adds [`product`] to `sum`.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn add_product<const ROW: usize, const K: usize, const N: usize>(
    sum: &mut Columns<N>,
    left: &Columns<K>,
    right: &Columns<N>,
) {
    // Three columns at a time: the additions of a single one would wait for each other. In copies, with which nothing else overlaps: else the
    // compiler makes no vectors of them.
    for (sum, right) in sum.chunks_mut(3).zip(right.chunks(3)) {
        if let ([first, second, third], [a, b, c]) = (&mut *sum, right) {
            let mut sums = [*first, *second, *third];
            for j in 0..K {
                add_scaled(&mut sums[0], &left[j], a[ROW + j]);
                add_scaled(&mut sums[1], &left[j], b[ROW + j]);
                add_scaled(&mut sums[2], &left[j], c[ROW + j]);
            }
            [*first, *second, *third] = sums;
        } else {
            for (sum, right) in sum.iter_mut().zip(right) {
                add_columns(sum, left, &right[ROW..]);
            }
        }
    }
}

/// Columns `from..from + N` of the identity.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn identity<const N: usize>(from: usize) -> Columns<N> {
    let mut unit = [[0.0; 12]; N];
    for (j, column) in unit.iter_mut().enumerate() {
        column[from + j] = 1.0;
    }
    unit
}

/// `sum + matrix * column`.
#[inline(always)]
pub(super) fn plus_product(sum: &State, matrix: &Columns<12>, column: &State) -> State {
    let mut sum = *sum;
    add_columns(&mut sum, matrix, column);
    sum
}

/// `columns + columns + E columns`: what two steps add.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn double<const N: usize>(columns: &mut Columns<N>, exp_minus_identity: &Columns<12>) {
    let moved = product::<0, 12, N>(exp_minus_identity, columns);
    for (column, moved) in columns.iter_mut().zip(&moved) {
        for i in 0..12 {
            column[i] = 2.0 * column[i] + moved[i];
        }
    }
}

#[cfg_attr(feature = "std", inline(always))]
pub(super) fn scale_by<const N: usize>(columns: &mut Columns<N>, factor: f64) {
    for column in columns {
        scale(column, factor);
    }
}
