//! Eigenvectors by Jacobi rotations, one matrix in each lane.
//!
//! A lane that has converged is not rotated any more, so its result does not depend on the other lanes.

use pulp::Simd;

use super::dense::{MAX_MODES, Square};
use super::vector::{Complex, Mask, Number, Real};

/// Largest number of sweeps over all pairs. Convergence is quadratic; ordinary scenes need five or six. The scene of a lane that has not
/// converged runs by itself.
const MAX_SWEEPS: usize = 12;

/// Off-diagonal entry over the geometric mean of the two diagonal entries below which it counts as zero.
const MAX_OFF_DIAGONAL: f64 = f64::EPSILON;

/// Diagonalises a symmetric positive definite matrix: leaves the eigenvalues on its diagonal and returns the eigenvectors in columns.
#[inline(always)]
pub(super) fn symmetric<S: Simd>(simd: S, matrix: &mut Square<Real<S>>, n: usize) -> Square<Real<S>> {
    let n = usize::min(n, MAX_MODES);
    let (zero, one) = (Real::splat(simd, 0.0), Real::splat(simd, 1.0));
    let limit = Real::splat(simd, MAX_OFF_DIAGONAL * MAX_OFF_DIAGONAL);
    let mut vectors = [[zero; MAX_MODES]; MAX_MODES];
    for (i, row) in vectors.iter_mut().enumerate() {
        row[i] = one;
    }
    for _ in 0..MAX_SWEEPS {
        let mut settled = true;
        for p in 0..n {
            for q in p + 1..n {
                let (a, b, d) = (matrix[p][p], matrix[p][q], matrix[q][q]);
                let turns = (limit * (a * d).abs()).less_than(b * b);
                if !turns.any() {
                    continue;
                }
                settled = false;
                let difference = d - a;
                let twice = b + b;
                let root = difference.mul_add(difference, twice * twice).sqrt();
                let sum = difference.less_than(zero).select(difference - root, difference + root);
                let tan = turns.select(twice / sum, zero);
                let cos = one / tan.mul_add(tan, one).sqrt();
                let sin = tan * cos;
                matrix[p][p] = (-tan).mul_add(b, a);
                matrix[q][q] = tan.mul_add(b, d);
                let off = turns.select(zero, b);
                (matrix[p][q], matrix[q][p]) = (off, off);
                for k in 0..n {
                    if k != p && k != q {
                        let (x, y) = (matrix[k][p], matrix[k][q]);
                        let (x, y) = (cos * x - sin * y, sin.mul_add(x, cos * y));
                        (matrix[k][p], matrix[p][k], matrix[k][q], matrix[q][k]) = (x, x, y, y);
                    }
                    let (x, y) = (vectors[k][p], vectors[k][q]);
                    (vectors[k][p], vectors[k][q]) = (cos * x - sin * y, sin.mul_add(x, cos * y));
                }
            }
        }
        if settled {
            break;
        }
    }
    vectors
}

/// Damped modes: the upper halves of `M = [[A, B], [B̄, Ā]]`, A complex symmetric and B Hermitian, and of its modes T. Complex rotations
/// `RᵀMR` diagonalise M without changing this form.
///
/// The form is that of `iΩ - Ĉ/2` beside `Ĉ/2`: a mode and its conjugate. (Jacobi's method for complex symmetric matrices, Seaton 1969;
/// rotations are orthogonal without conjugation, so `Tᵀ T = I`.)
pub(super) struct DampedModes<S: Simd> {
    n: usize,
    /// Rows of A and B: `[A B]`.
    pub(super) a: Square<Complex<S>>,
    pub(super) b: Square<Complex<S>>,
    /// `T = [[U, V̄], [V, Ū]]`: upper and lower half of the columns of the modes.
    pub(super) upper: Square<Complex<S>>,
    pub(super) lower: Square<Complex<S>>,
    /// Lanes with a mode that does not oscillate: two real modes, which do not have this form of a mode and its conjugate.
    pub(super) does_not_oscillate: Mask<S>,
}

impl<S: Simd> DampedModes<S> {
    /// A and B before any rotation.
    #[inline(always)]
    pub(super) fn new(simd: S, a: Square<Complex<S>>, b: Square<Complex<S>>, n: usize) -> Self {
        let (zero, one) = (Real::splat(simd, 0.0), Real::splat(simd, 1.0));
        let none = Complex::new(zero, zero);
        let mut upper = [[none; MAX_MODES]; MAX_MODES];
        for (i, row) in upper.iter_mut().enumerate() {
            row[i] = Complex::new(one, zero);
        }
        Self {
            n: usize::min(n, MAX_MODES),
            a,
            b,
            upper,
            lower: [[none; MAX_MODES]; MAX_MODES],
            does_not_oscillate: one.less_than(zero),
        }
    }

    /// Diagonalises M; the eigenvalues are then on the diagonal of A.
    #[inline(always)]
    pub(super) fn diagonalise(&mut self) {
        let n = self.n;
        for _ in 0..MAX_SWEEPS {
            let mut settled = true;
            for j in 0..n {
                settled &= !self.rotate_with_own_conjugate(j);
                for k in j + 1..n {
                    settled &= !self.rotate_pair(j, k);
                    settled &= !self.rotate_with_conjugate_of_other(j, k);
                }
            }
            if settled {
                return;
            }
        }
    }

    /// Rotates the modes j and k, and their conjugates by the conjugate rotation. Returns whether any lane was rotated.
    #[inline(always)]
    fn rotate_pair(&mut self, j: usize, k: usize) -> bool {
        let n = self.n;
        let Some((cos, sin, turns)) = rotation(self.a[j][j], self.a[j][k], self.a[k][k]) else {
            return false;
        };
        for i in 0..n {
            turn([cos, sin], &mut self.a[i], [j, k]);
            turn([cos.conj(), sin.conj()], &mut self.b[i], [j, k]);
            turn([cos, sin], &mut self.upper[i], [j, k]);
            turn([cos, sin], &mut self.lower[i], [j, k]);
        }
        for half in [&mut self.a, &mut self.b] {
            for i in 0..n {
                (half[j][i], half[k][i]) = turned([cos, sin], half[j][i], half[k][i]);
            }
        }
        // Set to exactly zero, or later sweeps would rotate rounding errors again and again.
        self.a[j][k] = cleared(turns, self.a[j][k]);
        self.a[k][j] = self.a[j][k];
        true
    }

    /// Rotates the mode j and the conjugate of k, and by the conjugate rotation the conjugate of j and k.
    #[inline(always)]
    fn rotate_with_conjugate_of_other(&mut self, j: usize, k: usize) -> bool {
        let n = self.n;
        let Some((cos, sin, turns)) = rotation(self.a[j][j], self.b[j][k], self.a[k][k].conj()) else {
            return false;
        };
        for i in 0..n {
            // Columns j of A and k of B, and, conjugate, j of B and k of A.
            (self.a[i][j], self.b[i][k]) = turned([cos, sin], self.a[i][j], self.b[i][k]);
            (self.b[i][j], self.a[i][k]) = turned([cos.conj(), sin.conj()], self.b[i][j], self.a[i][k]);
            // The conjugate of k has the column (V̄, Ū).
            let (upper, lower) = (&mut self.upper[i], &mut self.lower[i]);
            let u = turned([cos, sin], upper[j], lower[k].conj());
            let v = turned([cos, sin], lower[j], upper[k].conj());
            (upper[j], lower[j]) = (u.0, v.0);
            (lower[k], upper[k]) = (u.1.conj(), v.1.conj());
        }
        for i in 0..n {
            // The row of the conjugate of k is [B̄ Ā] of row k.
            let a = turned([cos, sin], self.a[j][i], self.b[k][i].conj());
            let b = turned([cos, sin], self.b[j][i], self.a[k][i].conj());
            (self.a[j][i], self.b[k][i]) = (a.0, a.1.conj());
            (self.b[j][i], self.a[k][i]) = (b.0, b.1.conj());
        }
        self.b[j][k] = cleared(turns, self.b[j][k]);
        self.b[k][j] = self.b[j][k].conj();
        true
    }

    /// Rotates the mode j and its own conjugate, by an imaginary angle.
    #[inline(always)]
    fn rotate_with_own_conjugate(&mut self, j: usize) -> bool {
        let n = self.n;
        let Some((cos, sin, turns)) = rotation(self.a[j][j], self.b[j][j], self.a[j][j].conj()) else {
            return false;
        };
        let (swing, coupling) = (self.a[j][j].im, self.b[j][j].re);
        self.does_not_oscillate =
            self.does_not_oscillate.or(turns.and_not((coupling * coupling).less_than(swing * swing)));
        for i in 0..n {
            (self.a[i][j], self.b[i][j]) = turned([cos, sin], self.a[i][j], self.b[i][j]);
            let (u, v) = (self.upper[i][j], self.lower[i][j]);
            self.upper[i][j] = turned([cos, sin], u, v.conj()).0;
            self.lower[i][j] = turned([cos, sin], v, u.conj()).0;
        }
        for i in 0..n {
            let (a, b) = (self.a[j][i], self.b[j][i]);
            self.a[j][i] = turned([cos, sin], a, b.conj()).0;
            self.b[j][i] = turned([cos, sin], b, a.conj()).0;
        }
        self.b[j][j] = cleared(turns, self.b[j][j]);
        true
    }
}

/// Cosine and sine of the rotation that diagonalises `[[a, b], [b, d]]`, and the lanes in which it does; none if all lanes are diagonal.
#[inline(always)]
fn rotation<S: Simd>(
    a: Complex<S>,
    b: Complex<S>,
    d: Complex<S>,
) -> Option<(Complex<S>, Complex<S>, Mask<S>)> {
    let (zero, one) = (a.re.constant(0.0), a.re.constant(1.0));
    let size = (a.norm_squared() * d.norm_squared()).sqrt();
    let turns = (a.re.constant(MAX_OFF_DIAGONAL * MAX_OFF_DIAGONAL) * size).less_than(b.norm_squared());
    if !turns.any() {
        return None;
    }
    let difference = d - a;
    let twice = b + b;
    let root = difference.mul_add(difference, twice * twice).sqrt();
    let (sum, other) = (difference + root, difference - root);
    let smaller = sum.norm_squared().less_than(other.norm_squared());
    let sum = Complex::new(smaller.select(other.re, sum.re), smaller.select(other.im, sum.im));
    let tan = twice * sum.recip();
    let tan = Complex::new(turns.select(tan.re, zero), turns.select(tan.im, zero));
    let cos = tan.mul_add(tan, Complex::new(one, zero)).sqrt().recip();
    let cos = Complex::new(turns.select(cos.re, one), turns.select(cos.im, zero));
    Some((cos, tan * cos, turns))
}

/// Rotates columns j and k of a row.
#[inline(always)]
fn turn<S: Simd>(rotation: [Complex<S>; 2], row: &mut [Complex<S>; MAX_MODES], [j, k]: [usize; 2]) {
    (row[j], row[k]) = turned(rotation, row[j], row[k]);
}

#[inline(always)]
fn turned<S: Simd>([cos, sin]: [Complex<S>; 2], x: Complex<S>, y: Complex<S>) -> (Complex<S>, Complex<S>) {
    (cos.mul_add(x, -(sin * y)), sin.mul_add(x, cos * y))
}

/// Zero in the lanes that were rotated.
#[inline(always)]
fn cleared<S: Simd>(turns: Mask<S>, entry: Complex<S>) -> Complex<S> {
    let zero = entry.re.constant(0.0);
    Complex::new(turns.select(zero, entry.re), turns.select(zero, entry.im))
}
