//! Square-root updates: orthogonal transformations of the information on a state, over an interval and by a sample.
//!
//! R is a square root of an information matrix: R x is known up to standard normal noise (square-root information filter, Bierman 1977);
//! see `posterior`.

use super::transition::Transition;

/// A matrix by columns.
pub(super) type Columns<const N: usize> = [[f64; N]; N];

/// U, V, and R', which is not triangular yet.
pub(super) struct TimeUpdated<const N: usize> {
    pub u: Columns<N>,
    pub v: Columns<N>,
    pub rest: Columns<N>,
}

/// Time update: eliminates the noise w of an interval, one entry after the other.
#[inline(always)]
pub(super) fn time_update<const N: usize, T: Transition<N>>(
    root: &Columns<N>,
    noise: Columns<N>,
    transition: &T,
) -> TimeUpdated<N> {
    let mut of_noise = [[0.0; N]; N];
    let mut rest = [[0.0; N]; N];
    for j in 0..N {
        for l in 0..N.min(j + 1 + T::BELOW_DIAGONAL) {
            for i in 0..N {
                of_noise[j][i] += root[l][i] * noise[j][l];
                rest[j][i] += root[l][i] * transition.entry(l, j);
            }
        }
    }
    let (mut u, mut v) = ([[0.0; N]; N], [[0.0; N]; N]);
    for j in 0..N {
        let seen = of_noise[j];
        let size = (1.0 + dot(&seen, &seen)).sqrt();
        let (whole, part) = (1.0 / size, 1.0 / (size * (1.0 + size)));
        u[j][j] = size;
        for c in j + 1..N {
            let sum = dot(&seen, &of_noise[c]);
            u[c][j] = sum * whole;
            for i in 0..N {
                of_noise[c][i] -= seen[i] * (sum * part);
            }
        }
        for c in 0..N {
            let sum = dot(&seen, &rest[c]);
            v[c][j] = sum * whole;
            for i in 0..N {
                rest[c][i] -= seen[i] * (sum * part);
            }
        }
    }
    TimeUpdated { u, v, rest }
}

/// Measurement update: the triangular root of `columns` and a sample of the first number of the state with weight `row` (Householder).
#[inline(always)]
pub(super) fn measurement_update<const N: usize>(columns: &Columns<N>, row: f64) -> Columns<N> {
    let mut m = *columns;
    let mut last = [0.0; N];
    last[0] = row;
    for j in 0..N {
        let mut square = last[j] * last[j];
        for i in j..N {
            square += m[j][i] * m[j][i];
        }
        let norm = square.sqrt();
        if norm == 0.0 {
            continue;
        }
        let norm = if m[j][j] < 0.0 { -norm } else { norm };
        let mut mirror = m[j];
        mirror[..j].fill(0.0);
        mirror[j] += norm;
        let (end, part) = (last[j], 1.0 / (norm * mirror[j]));
        for c in j + 1..N {
            let sum = (dot(&mirror, &m[c]) + end * last[c]) * part;
            for i in 0..N {
                m[c][i] -= mirror[i] * sum;
            }
            last[c] -= end * sum;
        }
        m[j][j] = -norm;
        m[j][j + 1..].fill(0.0);
    }
    m
}

#[inline(always)]
pub(super) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for i in 0..N {
        sum += a[i] * b[i];
    }
    sum
}

/// The upper triangular S with S S^T = P, by columns. A direction with no variance, or less than rounding, gets none.
pub(super) fn upper_cholesky<const N: usize>(p: &[[f64; N]; N]) -> Columns<N> {
    let mut s = [[0.0; N]; N];
    for j in (0..N).rev() {
        let mut pivot = p[j][j];
        for a in j + 1..N {
            pivot -= s[a][j] * s[a][j];
        }
        if pivot <= 1e-15 * p[j][j] {
            continue;
        }
        s[j][j] = pivot.sqrt();
        for i in 0..j {
            let mut sum = p[i][j];
            for a in j + 1..N {
                sum -= s[a][i] * s[a][j];
            }
            s[j][i] = sum / s[j][j];
        }
    }
    s
}
