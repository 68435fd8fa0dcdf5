//! Transition of the state between two samples: a point whose N-th derivative of position is white noise.

/// Transition matrix and noise covariance of one step: x_i(t + h) = sum_j phi[j - i] x_j(t) + w_i, cov(w) = density * noise.
#[derive(Clone)]
pub(super) struct Transition<const N: usize> {
    step: f64,
    /// h^i/i!
    pub phi: [f64; N],
    /// Covariance of w for a noise density of 1.
    pub noise: [[f64; N]; N],
}

impl<const N: usize> Transition<N> {
    #[inline(always)]
    pub fn new(step: f64) -> Self {
        let mut transition = Self { step: f64::NAN, phi: [0.0; N], noise: [[0.0; N]; N] };
        transition.set(step);
        transition
    }

    /// Changes the step. Without cost if it is the same as before, as with uniform time stamps.
    #[inline(always)]
    pub fn set(&mut self, step: f64) {
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

    /// Phi x
    #[inline(always)]
    pub fn propagate(&self, x: &mut [f64; N]) {
        for i in 0..N {
            let mut sum = x[i];
            for j in i + 1..N {
                sum += self.phi[j - i] * x[j];
            }
            x[i] = sum;
        }
    }

    /// Phi^T r
    #[inline(always)]
    pub fn propagate_transposed(&self, r: &mut [f64; N]) {
        for i in (0..N).rev() {
            let mut sum = r[i];
            for j in 0..i {
                sum += self.phi[i - j] * r[j];
            }
            r[i] = sum;
        }
    }

    /// Phi P Phi^T + density * noise
    #[inline(always)]
    pub fn propagate_covariance(&self, p: &mut [[f64; N]; N], density: f64) {
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

    /// Phi^T M Phi
    #[inline(always)]
    pub fn propagate_information(&self, m: &mut [[f64; N]; N]) {
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

/// Copies the lower triangle to the upper one.
#[inline(always)]
fn mirror<const N: usize>(m: &mut [[f64; N]; N]) {
    for i in 0..N {
        for l in 0..i {
            m[l][i] = m[i][l];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Transition;

    #[test]
    fn two_steps_are_one_of_their_sum() {
        let (short, long) = (Transition::<4>::new(0.3), Transition::<4>::new(0.6));
        let mut twice = [[0.0; 4]; 4];
        short.propagate_covariance(&mut twice, 2.0);
        short.propagate_covariance(&mut twice, 2.0);
        for i in 0..4 {
            for j in 0..4 {
                assert!((twice[i][j] - 2.0 * long.noise[i][j]).abs() < 1e-14 * long.noise[i][j]);
            }
        }
        let mut x = [1.0, -2.0, 3.0, 0.5];
        let mut y = x;
        short.propagate(&mut x);
        short.propagate(&mut x);
        long.propagate(&mut y);
        assert!(x.iter().zip(y).all(|(a, b)| (a - b).abs() < 1e-14));
    }

    #[test]
    fn propagate_transposed_is_the_transpose_of_propagate() {
        let transition = Transition::<5>::new(0.7);
        let (a, b) = ([1.0, 0.2, -0.4, 2.0, 0.3], [0.5, -1.0, 0.1, 0.9, -2.0]);
        let (mut ahead, mut back) = (a, b);
        transition.propagate(&mut ahead);
        transition.propagate_transposed(&mut back);
        let dot = |x: [f64; 5], y: [f64; 5]| x.iter().zip(y).map(|(p, q)| p * q).sum::<f64>();
        assert!((dot(b, ahead) - dot(back, a)).abs() < 1e-14);
        let mut rank_one = [[0.0; 5]; 5];
        for i in 0..5 {
            for j in 0..5 {
                rank_one[i][j] = b[i] * b[j];
            }
        }
        transition.propagate_information(&mut rank_one);
        for i in 0..5 {
            for j in 0..5 {
                assert!((rank_one[i][j] - back[i] * back[j]).abs() < 1e-13);
            }
        }
    }
}
