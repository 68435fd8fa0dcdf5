//! A point that follows a drive as an oscillator does.
//!
//! The state is the position (perhaps its derivatives), the acceleration a, y, and the acceleration c of the drive with its derivatives,
//! the last of which is the integral of white noise:
//!
//! ```text
//! a' = y - 2 D w (a - c),    y' = -w^2 (a - c)
//! ```
//!
//! so that a'' + 2 D w a' + w^2 a = 2 D w c' + w^2 c: of two points on a spring and a damper, a is the acceleration of the one
//! and c that of the other.
//!
//! All entries of Phi are sums of G(m), the m-th integral over time of the oscillator's response to an impulse, G'' + 2 D w G' + w^2 G = 0,
//! G = 0 and G' = 1 at the start; m = -1 is the derivative. Integrated, this equation gives each G from the next two:
//!
//! ```text
//! G(m-2) = t^(m-1)/(m-1)! - 2 D w G(m-1) - w^2 G(m)
//! ```
//!
//! Downwards this loses no digits, so that only the last two are summed as power series.

use crate::numeric::simd::{LANES, Lanes, dispatch};
use crate::smoother::data::Oscillator;
use crate::smoother::transition::{Transition, mirror, product};

/// Times within a step, side by side: the nodes of Gauss and Legendre's quadrature, and the end.
const TIMES: Lanes = [
    0.025_446_043_828_620_736,
    0.129_234_407_200_302_8,
    0.297_077_424_311_301_4,
    0.5,
    0.702_922_575_688_698_6,
    0.870_765_592_799_697_2,
    0.974_553_956_171_379_3,
    1.0,
];
/// Lane of the end.
const END: usize = LANES - 1;
/// Square roots of the weights of the nodes.
const ROOT_WEIGHTS: Lanes = [
    0.254_445_442_255_181_4,
    0.373_968_843_280_611_2,
    0.436_938_239_631_826_54,
    0.457_142_857_142_857_13,
    0.436_938_239_631_826_54,
    0.373_968_843_280_611_2,
    0.254_445_442_255_181_4,
    0.0,
];
/// Largest angle of a step, in radians, up to which series and quadrature are exact; longer steps are made of halves.
const LARGEST_ANGLE: f64 = 2.0;
/// Pairs of terms of the series at the largest angle, and of a step of no length.
const PAIRS: usize = 14;
const FEWEST_PAIRS: f64 = 6.0;
/// Most halvings of a step. Of more radians than these make, a double does not know the phase.
const MAX_HALVINGS: usize = 64;

type Matrix<const N: usize> = [[f64; N]; N];

/// Transition matrix and noise covariance of one step.
#[derive(Clone)]
pub(super) struct Ringing<const N: usize> {
    oscillator: Oscillator,
    /// Fastest rate of the oscillator: w, or if overdamped the larger of its two rates of decay.
    rate: f64,
    /// Coefficients of w t in the series of G(N-2) and G(N-3), relative to the first term, in pairs.
    series: [[[f64; 2]; PAIRS]; 2],
    step: f64,
    phi: Matrix<N>,
    /// Transpose of Phi: its columns as vectors.
    transposed: Matrix<N>,
    noise: Matrix<N>,
}

impl<const N: usize> Ringing<N> {
    /// Computes the matrices of the step, in halves if it is long.
    #[inline(always)]
    fn compute(&mut self) {
        let mut step = self.step;
        let mut halvings = 0;
        while step * self.rate > LARGEST_ANGLE && halvings < MAX_HALVINGS {
            step *= 0.5;
            halvings += 1;
        }
        self.compute_short(step);
        for _ in 0..halvings {
            let mut noise = self.noise;
            self.propagate_covariance(&mut noise, 1.0);
            self.noise = noise;
            self.phi = product(&self.phi, &self.phi);
            self.transpose();
        }
    }

    #[inline(always)]
    fn transpose(&mut self) {
        for i in 0..N {
            for j in 0..N {
                self.transposed[j][i] = self.phi[i][j];
            }
        }
    }

    /// Computes a step without halvings.
    #[inline(always)]
    fn compute_short(&mut self, step: f64) {
        let Oscillator { frequency: w, damping, acceleration: a } = self.oscillator;
        let (friction, stiffness) = (2.0 * damping * w, w * w);
        // t^k/k!
        let mut power = [[1.0; LANES]; N];
        for k in 1..N {
            let size = step / k as f64;
            for l in 0..LANES {
                power[k][l] = power[k - 1][l] * (TIMES[l] * size);
            }
        }
        // g[d] = G(d - 1), and what a drive c = 1 adds to the integrals of a: driven[d] = w^2 G(d - 1) + 2 D w G(d - 2).
        let mut g = [[0.0; LANES]; N];
        [g[N - 1], g[N - 2]] = self.series(step);
        for l in 0..LANES {
            g[N - 1][l] *= power[N - 1][l];
            g[N - 2][l] *= power[N - 2][l];
        }
        for d in (0..N - 2).rev() {
            for l in 0..LANES {
                g[d][l] = power[d][l] - friction * g[d + 1][l] - stiffness * g[d + 2][l];
            }
        }
        let mut driven = [[0.0; LANES]; N];
        for d in 2..N {
            for l in 0..LANES {
                driven[d][l] = stiffness * g[d][l] + friction * g[d - 1][l];
            }
        }
        self.assemble(a, power.map(|x| x[END]), g.map(|x| x[END]), driven.map(|x| x[END]));
        self.transpose();

        // The noise: the response of each number of the state to an impulse on the last one.
        let mut response = [[0.0; N]; LANES];
        let root = step.sqrt();
        for i in 0..N {
            let from = if i <= a { &driven[N - 1 - i] } else { &power[N - 1 - i] };
            for l in 0..LANES {
                response[l][i] = from[l] * (root * ROOT_WEIGHTS[l]);
            }
        }
        for l in 0..LANES {
            response[l][a + 1] = stiffness * g[N - 2 - a][l] * (root * ROOT_WEIGHTS[l]);
        }
        let mut noise = [[0.0; N]; N];
        for response in &response[..END] {
            for i in 0..N {
                for j in 0..N {
                    noise[i][j] += response[i] * response[j];
                }
            }
        }
        self.noise = noise;
    }

    /// G(N-2) and G(N-3) relative to the first terms of their series.
    #[inline(always)]
    fn series(&self, step: f64) -> [Lanes; 2] {
        // The first term left out is below 1e-16 of the sum.
        let pairs =
            (FEWEST_PAIRS + (PAIRS as f64 - FEWEST_PAIRS) / LARGEST_ANGLE * (self.rate * step)) as usize;
        let angle = TIMES.map(|x| x * (step * self.oscillator.frequency));
        let square = angle.map(|x| x * x);
        // Even and odd terms apart: twice as many sums side by side.
        let mut sums = [[[0.0; LANES]; 2]; 2];
        for k in (0..pairs.min(PAIRS)).rev() {
            for which in 0..2 {
                for parity in 0..2 {
                    for l in 0..LANES {
                        sums[which][parity][l] =
                            sums[which][parity][l] * square[l] + self.series[which][k][parity];
                    }
                }
            }
        }
        sums.map(|[even, odd]| core::array::from_fn(|l| even[l] + angle[l] * odd[l]))
    }

    /// Phi of t^k/k!, G and `driven` at the end of the step.
    #[inline(always)]
    fn assemble(&mut self, a: usize, power: [f64; N], g: [f64; N], driven: [f64; N]) {
        let Oscillator { frequency: w, damping, .. } = self.oscillator;
        self.phi = [[0.0; N]; N];
        for i in 0..N {
            for j in i..N {
                // Between integrals, and within the drive, Phi is that of a polynomial.
                self.phi[i][j] = if i > a || j < a {
                    power[j - i]
                } else if j < a + 2 {
                    g[j - i]
                } else {
                    driven[j - i]
                };
            }
        }
        self.phi[a + 1][a] = -w * w * g[1];
        self.phi[a + 1][a + 1] = g[0] + 2.0 * damping * w * g[1];
        for j in a + 2..N {
            self.phi[a + 1][j] = w * w * g[j - a - 1];
        }
    }
}

/// M x, with the columns of M.
#[inline(always)]
fn applied<const N: usize>(columns: &Matrix<N>, x: &[f64; N]) -> [f64; N] {
    let mut y = [0.0; N];
    for j in 0..N {
        for i in 0..N {
            y[i] += columns[j][i] * x[j];
        }
    }
    y
}

impl<const N: usize> Transition<N> for Ringing<N> {
    const BELOW_DIAGONAL: usize = 1;

    #[inline(always)]
    fn new(oscillator: Option<Oscillator>) -> Self {
        // `with_transition` passes one.
        let oscillator = oscillator.unwrap_or(Oscillator { frequency: 0.0, damping: 0.0, acceleration: 0 });
        let Oscillator { frequency: w, damping, .. } = oscillator;
        let rate = w * (damping.max(1.0) + (damping * damping - 1.0).max(0.0).sqrt());
        // 1/(s^2 + 2 D s + 1) by powers of 1/s, integrated.
        let (mut before, mut now) = (0.0, 1.0);
        let mut series = [[[0.0; 2]; PAIRS]; 2];
        let mut size = [1.0; 2];
        for k in 0..2 * PAIRS {
            for which in 0..2 {
                series[which][k / 2][k % 2] = now * size[which];
                size[which] /= (N - which + k) as f64;
            }
            (before, now) = (now, -2.0 * damping * now - before);
        }
        let zero = [[0.0; N]; N];
        Self { oscillator, rate, series, step: f64::NAN, phi: zero, transposed: zero, noise: zero }
    }

    #[inline(always)]
    fn set(&mut self, step: f64) {
        if step == self.step {
            return;
        }
        self.step = step;
        dispatch!(self.compute());
    }

    #[inline(always)]
    fn noise(&self) -> &Matrix<N> {
        &self.noise
    }

    #[inline(always)]
    fn entry(&self, i: usize, j: usize) -> f64 {
        self.phi[i][j]
    }

    #[inline(always)]
    fn propagate(&self, x: &mut [f64; N]) {
        *x = applied(&self.transposed, x);
    }

    #[inline(always)]
    fn propagate_transposed(&self, r: &mut [f64; N]) {
        *r = applied(&self.phi, r);
    }

    // Products of whole rows, zeros included, fill the vectors; only below the second diagonal they are left out.

    #[inline(always)]
    fn propagate_covariance(&self, p: &mut Matrix<N>, density: f64) {
        let carried = product(p, &self.transposed);
        for i in 0..N {
            for l in 0..N {
                p[i][l] = density * self.noise[i][l];
            }
            for j in i.saturating_sub(1)..N {
                for l in 0..N {
                    p[i][l] += self.phi[i][j] * carried[j][l];
                }
            }
        }
        mirror(p);
    }

    #[inline(always)]
    fn propagate_information(&self, m: &mut Matrix<N>) {
        let carried = product(m, &self.phi);
        *m = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..N.min(i + 2) {
                for l in 0..N {
                    m[i][l] += self.phi[j][i] * carried[j][l];
                }
            }
        }
        mirror(m);
    }
}

#[cfg(test)]
mod tests;
