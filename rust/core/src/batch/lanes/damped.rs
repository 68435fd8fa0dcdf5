//! Damped modes of many scenes, one in each lane.
//!
//! With `y = (p, -p̄)`, `p = (iω η + η') / √2`, the equations of motion are `y' = M y + (f, -f) / √2` with the complex symmetric
//! `M = [[iΩ - Ĉ/2, Ĉ/2], [Ĉ/2, -iΩ - Ĉ/2]]`. A complex orthogonal T makes it diagonal, and the modes are decoupled: `z' = λ z + g u`. Only
//! changes of u drive the deviation of a mode from its quasi-static value, `v = z + (g/λ) u`: `v' = λ v + (g/λ) u'`.

use pulp::Simd;

use super::dense::MAX_MODES;
use super::jacobi::DampedModes;
use super::undamped::{RowParts, Undamped};
use super::vector::{Complex, Mask, Number, Real};

/// Smallest `|λ|` times duration of the motion, for every mode. Below it the loads are differences of far larger quasi-static loads and lose
/// digits.
const MIN_TURN: f64 = 0.3;

/// Largest squared norm of T per mode. It is 1 if damping does not couple modes, and infinite if two modes coincide (defective).
const MAX_MODE_SIZE: f64 = 50.0;

/// Largest angle, rad, that a mode may turn before it decays; the relative error of a load is that of λ times this angle.
const MAX_TURN: f64 = 2e3;

/// Damped modes of the scenes.
pub(super) struct Damped<S: Simd> {
    /// T.
    modes: DampedModes<S>,
    /// λ of each mode, 1/s.
    pub eigenvalues: [Complex<S>; MAX_MODES],
    /// Lanes that have converged and in which rounding leaves enough digits.
    pub accurate: Mask<S>,
}

impl<S: Simd> Damped<S> {
    /// `duration` of the motion, s.
    #[inline(always)]
    pub(super) fn new(simd: S, undamped: &Undamped<S>, duration: f64) -> Self {
        let Undamped { n, zero, frequency, damping, .. } = undamped;
        let (n, zero, half) = (*n, *zero, Real::splat(simd, 0.5));
        let none = Complex::new(zero, zero);
        let (mut a, mut b) = ([[none; MAX_MODES]; MAX_MODES], [[none; MAX_MODES]; MAX_MODES]);
        for i in 0..n {
            for j in 0..n {
                let coupling = half * damping[i][j];
                a[i][j] = Complex::new(-coupling, if i == j { frequency[i] } else { zero });
                b[i][j] = Complex::new(coupling, zero);
            }
        }
        let mut modes = DampedModes::new(simd, a, b, n);
        modes.diagonalise();
        let mut accurate = modes.does_not_oscillate.not();
        let mut eigenvalues = [none; MAX_MODES];
        let (mut size, mut trace, mut damped) = (zero, zero, zero);
        for k in 0..n {
            eigenvalues[k] = modes.a[k][k];
            let mut largest = zero;
            for i in 0..n {
                size = size + modes.upper[i][k].norm_squared() + modes.lower[i][k].norm_squared();
                if i != k {
                    largest = largest.max(modes.a[i][k].norm_squared());
                }
                largest = largest.max(modes.b[i][k].norm_squared());
            }
            let square = eigenvalues[k].norm_squared();
            let settled = largest.less_than(square * square.constant(1e-28));
            // The shorter of the duration of the motion and the time in which the mode decays.
            let memory = (-eigenvalues[k].re).max(square.constant(1.0 / duration));
            let turns = (eigenvalues[k].im).less_than(memory * square.constant(MAX_TURN));
            let swings = zero.less_than(eigenvalues[k].im);
            let least = square.constant(MIN_TURN / duration);
            let lasts = (least * least).less_than(square);
            accurate = accurate.and(settled).and(turns).and(swings).and(lasts);
            trace = trace + eigenvalues[k].re;
            damped = damped + half * damping[k][k];
        }
        // Rotations do not change the trace.
        let same_trace =
            (trace + damped).abs().less_than((damped + frequency[n - 1]) * damped.constant(1e-12));
        let accurate = accurate.and(same_trace).and(size.less_than(size.constant(MAX_MODE_SIZE * n as f64)));
        Self { modes, eigenvalues, accurate }
    }

    /// Writes `g/λ` of each mode for each component of the excitation, `g = Tᵀ (f, -f) / √2`.
    #[inline(always)]
    pub(super) fn set_drives(&self, simd: S, undamped: &Undamped<S>, drives: &mut [[S::f64s; 2]]) {
        let (n, root) = (undamped.n, Real::splat(simd, core::f64::consts::FRAC_1_SQRT_2));
        for ((force, _), drive) in undamped.influence.iter().zip(drives.chunks_exact_mut(n)) {
            for k in 0..n {
                let mut sum = Complex::new(undamped.zero, undamped.zero);
                for j in 0..n {
                    sum = sum + (self.modes.upper[j][k] - self.modes.lower[j][k]).scale(force[j] * root);
                }
                drive[k] = (sum * self.eigenvalues[k].recip()).lanes();
            }
        }
    }

    /// z of mode k, `Tᵀ (p, -p̄)`.
    #[inline(always)]
    pub(super) fn amplitude(&self, p: &[Complex<S>; MAX_MODES], k: usize, n: usize) -> Complex<S> {
        let mut z = self.modes.upper[0][k] * p[0] - self.modes.lower[0][k] * p[0].conj();
        for j in 1..n {
            z = z + (self.modes.upper[j][k] * p[j] - self.modes.lower[j][k] * p[j].conj());
        }
        z
    }

    /// c of mode k in `load = 2 Re(Σ c z)`, z = v - (g/λ) u.
    #[inline(always)]
    pub(super) fn coefficient(&self, simd: S, of: &RowParts<S>, k: usize, n: usize) -> Complex<S> {
        let root = Real::splat(simd, core::f64::consts::FRAC_1_SQRT_2);
        let zero = Real::splat(simd, 0.0);
        let mut c = Complex::new(zero, zero);
        for j in 0..n {
            let (e, d) = (of.elastic[j] * root, of.damping[j] * root);
            c = Complex::new(d, -e).mul_add(self.modes.upper[j][k], c);
            c = Complex::new(-d, -e).mul_add(self.modes.lower[j][k], c);
        }
        c
    }
}
