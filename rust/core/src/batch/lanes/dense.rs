//! Small symmetric matrices, one in each lane.

use pulp::Simd;

use super::vector::{Number, Real};

/// Most modes of a scene.
pub(super) const MAX_MODES: usize = 6;

/// A square matrix, of which the first rows and columns count.
pub(super) type Square<T> = [[T; MAX_MODES]; MAX_MODES];

/// Replaces a symmetric matrix by its Cholesky factor L, `L Lᵀ`. Returns the smallest ratio of a pivot to its diagonal entry, at most 1.
#[inline(always)]
pub(super) fn cholesky<S: Simd>(matrix: &mut Square<Real<S>>, n: usize) -> Real<S> {
    let zero = matrix[0][0].constant(0.0);
    let mut smallest = zero.constant(1.0);
    for j in 0..n {
        let mut pivot = matrix[j][j];
        for k in 0..j {
            pivot = (-matrix[j][k]).mul_add(matrix[j][k], pivot);
        }
        // NaN is not above zero, so it fails the later comparison.
        let part = pivot / matrix[j][j];
        smallest = zero.less_than(part).select(smallest.min(part), zero);
        let root = pivot.sqrt();
        matrix[j][j] = root;
        for i in j + 1..n {
            let mut sum = matrix[i][j];
            for k in 0..j {
                sum = (-matrix[i][k]).mul_add(matrix[j][k], sum);
            }
            matrix[i][j] = sum / root;
            matrix[j][i] = zero;
        }
    }
    smallest
}

/// Replaces a symmetric A by `L⁻¹ A L⁻ᵀ`.
#[inline(always)]
pub(super) fn congruent<S: Simd>(lower: &Square<Real<S>>, matrix: &mut Square<Real<S>>, n: usize) {
    for _ in 0..2 {
        // Solve for the columns, then transpose. Two passes treat both sides.
        for column in 0..n {
            for i in 0..n {
                let mut sum = matrix[i][column];
                for k in 0..i {
                    sum = (-lower[i][k]).mul_add(matrix[k][column], sum);
                }
                matrix[i][column] = sum / lower[i][i];
            }
        }
        for i in 0..n {
            for j in 0..i {
                (matrix[i][j], matrix[j][i]) = (matrix[j][i], matrix[i][j]);
            }
        }
    }
    // Symmetric to the last bit.
    for i in 0..n {
        for j in 0..i {
            matrix[j][i] = matrix[i][j];
        }
    }
}

/// `Φᵀ A Φ` of a symmetric A.
#[inline(always)]
pub(super) fn projected<S: Simd>(
    shapes: &Square<Real<S>>,
    matrix: &Square<Real<S>>,
    n: usize,
) -> Square<Real<S>> {
    let zero = matrix[0][0].constant(0.0);
    let (mut half, mut out) = ([[zero; MAX_MODES]; MAX_MODES], [[zero; MAX_MODES]; MAX_MODES]);
    for i in 0..n {
        for mode in 0..n {
            for k in 0..n {
                half[i][mode] = matrix[i][k].mul_add(shapes[k][mode], half[i][mode]);
            }
        }
    }
    for i in 0..n {
        for j in 0..=i {
            let mut sum = zero;
            for k in 0..n {
                sum = shapes[k][i].mul_add(half[k][j], sum);
            }
            (out[i][j], out[j][i]) = (sum, sum);
        }
    }
    out
}
