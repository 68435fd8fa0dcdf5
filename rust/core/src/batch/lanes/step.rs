//! Steps: the change of damped modes over an interval of time.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::modal::ModalScenes;
use super::vector::{Complex, Real, vectorize};

/// Computes the steps over some lengths of time, s: for each mode `E = exp(λ h) - 1`, then, for each component of the excitation and each
/// mode, the effect of a change of it, `(g/λ) E / (λ h)`. A step is `v <- v + E v + (g/λ) E / (λ h) du`.
pub(super) fn set_steps<S: Simd>(simd: S, lengths: &[f64], modal: &ModalScenes, to: &mut AlignedBuffer) {
    vectorize!(simd, steps(simd, lengths, modal, to));
}

/// See [`set_steps`].
#[inline(always)]
fn steps<S: Simd>(simd: S, lengths: &[f64], modal: &ModalScenes, to: &mut AlignedBuffer) {
    let eigenvalues = modal.eigenvalues.vectors::<S>().as_chunks::<2>().0;
    let n = eigenvalues.len();
    let drives = modal.drive.vectors::<S>().as_chunks::<2>().0;
    let width = n + drives.len();
    let steps = to.clear::<S>(lengths.len() * 2 * width).as_chunks_mut::<2>().0;
    for (step, &length) in steps.chunks_exact_mut(width).zip(lengths) {
        let (changes, by_input) = step.split_at_mut(n);
        let h = Real::splat(simd, length);
        for mode in 0..n {
            let (change, mean) = exponential(simd, Complex::of(simd, eigenvalues[mode]).scale(h));
            changes[mode] = change.lanes();
            for (to, drive) in by_input.chunks_exact_mut(n).zip(drives.chunks_exact(n)) {
                to[mode] = (Complex::of(simd, drive[mode]) * mean).lanes();
            }
        }
    }
}

/// Terms of the series of `(exp(z) - 1) / z` for `|z| <= 1/2`: the first one left out is 0.5^15 / 16! = 1e-18.
const TERMS: usize = 15;

/// `exp(z) - 1`, and that over z.
#[inline(always)]
pub(super) fn exponential<S: Simd>(simd: S, z: Complex<S>) -> (Complex<S>, Complex<S>) {
    let (zero, one) = (Real::splat(simd, 0.0), Real::splat(simd, 1.0));
    let (half, two) = (Real::splat(simd, 0.5), Real::splat(simd, 2.0));
    // The series for z halved until its size is at most 1/2; then as many doublings.
    let (mut part, mut doublings) = (one, zero);
    let size = z.norm_squared();
    loop {
        let long = (half * half).less_than(size * part * part);
        if !long.any() {
            break;
        }
        part = long.select(part * half, part);
        doublings = long.select(doublings + one, doublings);
    }
    let z = z.scale(part);
    let mut mean = Complex::new(one, zero);
    for k in (2..=TERMS).rev() {
        mean = (mean * z).scale(Real::splat(simd, 1.0 / k as f64));
        mean.re = mean.re + one;
    }
    let mut change = mean * z;
    loop {
        let again = zero.less_than(doublings);
        if !again.any() {
            return (change, mean);
        }
        doublings = doublings - one;
        let factor = Complex::new(change.re + two, change.im);
        change = again.select_complex(change * factor, change);
        mean = again.select_complex((mean * factor).scale(half), mean);
    }
}
