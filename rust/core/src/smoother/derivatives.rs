//! A point whose N-th derivative of position is white noise.

use super::data::Oscillator;
use super::transition::{Transition, mirror};

/// Transition matrix and noise covariance of one step: x_i(t + h) = sum_j phi[j - i] x_j(t) + w_i, cov(w) = density * noise.
#[derive(Clone)]
pub(super) struct Derivatives<const N: usize> {
    step: f64,
    /// h^i/i!
    phi: [f64; N],
    /// Covariance of w for a noise density of 1.
    noise: [[f64; N]; N],
}

impl<const N: usize> Transition<N> for Derivatives<N> {
    const BELOW_DIAGONAL: usize = 0;

    #[inline(always)]
    fn new(_: Option<Oscillator>) -> Self {
        Self { step: f64::NAN, phi: [0.0; N], noise: [[0.0; N]; N] }
    }

    #[inline(always)]
    fn set(&mut self, step: f64) {
        if step == self.step {
            return;
        }
        self.step = step;
        self.phi[0] = 1.0;
        for i in 1..N {
            self.phi[i] = self.phi[i - 1] * step / i as f64;
        }
        for i in 0..N {
            for j in 0..N {
                // Integral over s of s^(N-1-i) s^(N-1-j)/((N-1-i)! (N-1-j)!).
                let power = (2 * N - 1 - i - j) as f64;
                self.noise[i][j] = self.phi[N - 1 - i] * self.phi[N - 1 - j] * step / power;
            }
        }
    }

    #[inline(always)]
    fn noise(&self) -> &[[f64; N]; N] {
        &self.noise
    }

    #[inline(always)]
    fn entry(&self, i: usize, j: usize) -> f64 {
        if j < i { 0.0 } else { self.phi[j - i] }
    }

    #[inline(always)]
    fn propagate(&self, x: &mut [f64; N]) {
        for i in 0..N {
            let mut sum = x[i];
            for j in i + 1..N {
                sum += self.phi[j - i] * x[j];
            }
            x[i] = sum;
        }
    }

    #[inline(always)]
    fn propagate_transposed(&self, r: &mut [f64; N]) {
        for i in (0..N).rev() {
            let mut sum = r[i];
            for j in 0..i {
                sum += self.phi[i - j] * r[j];
            }
            r[i] = sum;
        }
    }

    #[inline(always)]
    fn propagate_covariance(&self, p: &mut [[f64; N]; N], density: f64) {
        for i in 0..N {
            for j in i + 1..N {
                let factor = self.phi[j - i];
                for l in 0..N {
                    p[i][l] += factor * p[j][l];
                }
            }
        }
        for i in 0..N {
            for l in 0..=i {
                let mut sum = p[i][l] + density * self.noise[i][l];
                for j in l + 1..N {
                    sum += self.phi[j - l] * p[i][j];
                }
                p[i][l] = sum;
            }
        }
        mirror(p);
    }

    #[inline(always)]
    fn propagate_information(&self, m: &mut [[f64; N]; N]) {
        for i in (0..N).rev() {
            for j in 0..i {
                let factor = self.phi[i - j];
                for l in 0..N {
                    m[i][l] += factor * m[j][l];
                }
            }
        }
        for i in 0..N {
            for l in (0..=i).rev() {
                let mut sum = m[i][l];
                for j in 0..l {
                    sum += self.phi[l - j] * m[i][j];
                }
                m[i][l] = sum;
            }
        }
        mirror(m);
    }
}
