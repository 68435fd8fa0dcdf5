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

use super::data::Oscillator;
use super::transition::{Transition, mirror};
use crate::numeric::simd::{Kernel, LANES, Lanes, dispatch};

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

/// Matrices of a new step: a kernel of its own, as inlined into every pass it would take long to compile.
struct Compute<'a, const N: usize>(&'a mut Ringing<N>);

impl<const N: usize> Kernel for Compute<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(transition) = self;
        let mut step = transition.step;
        let mut halvings = 0;
        while step * transition.rate > LARGEST_ANGLE && halvings < MAX_HALVINGS {
            step *= 0.5;
            halvings += 1;
        }
        transition.compute_short(step);
        for _ in 0..halvings {
            let mut noise = transition.noise;
            transition.propagate_covariance(&mut noise, 1.0);
            transition.noise = noise;
            transition.phi = product(&transition.phi, &transition.phi);
            transition.transpose();
        }
    }
}

impl<const N: usize> Ringing<N> {
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

#[inline(always)]
fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut c = [[0.0; N]; N];
    for i in 0..N {
        for l in 0..N {
            for j in 0..N {
                c[i][j] += a[i][l] * b[l][j];
            }
        }
    }
    c
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
        dispatch(Compute(self));
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
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    const DAMPINGS: [f64; 6] = [0.0, 0.05, 0.7, 1.0, 1.5, 5.0];
    const ANGLES: [f64; 8] = [1e-3, 0.06, 0.5, 1.2, 1.9, 2.1, 12.0, 40.0];

    /// Order of the derivative that entry i of the state is.
    fn derivative(i: usize, a: usize) -> i32 {
        if i < a + 2 { i as i32 } else { i as i32 - 2 }
    }

    /// Phi by Taylor's series of a small step, squared; w = 1.
    fn exponential<const N: usize>(damping: f64, a: usize, angle: f64) -> DMatrix<f64> {
        let mut generator = DMatrix::zeros(N, N);
        for i in (0..N - 1).filter(|&i| i != a + 1) {
            generator[(i, i + 1)] = 1.0;
        }
        for (j, sign) in [(a, -1.0), (a + 2, 1.0)] {
            generator[(a, j)] += sign * 2.0 * damping;
            generator[(a + 1, j)] = sign;
        }
        let squarings = 2 + (angle * (1.0 + damping)).log2().max(0.0) as i32;
        let (mut term, mut sum) = (DMatrix::identity(N, N), DMatrix::identity(N, N));
        for k in 1..20 {
            term = &term * &generator * (angle * 0.5f64.powi(squarings) / f64::from(k));
            sum += &term;
        }
        for _ in 0..squarings {
            sum = &sum * &sum;
        }
        sum
    }

    fn set<const N: usize>(frequency: f64, damping: f64, acceleration: usize, step: f64) -> Ringing<N> {
        let mut ringing = Ringing::new(Some(Oscillator { frequency, damping, acceleration }));
        ringing.set(step);
        ringing
    }

    fn is_the_exponential<const N: usize>() {
        for (damping, angle) in DAMPINGS.into_iter().flat_map(|damping| ANGLES.map(|angle| (damping, angle)))
        {
            for a in 0..N - 2 {
                let wanted = exponential::<N>(damping, a, angle);
                for w in [1e-3f64, 1.0, 300.0] {
                    let ringing = set::<N>(w, damping, a, angle / w);
                    for i in 0..N {
                        for j in 0..N {
                            let unit = w.powi(derivative(j, a) - derivative(i, a));
                            let (found, wanted) = (ringing.entry(i, j) * unit, wanted[(i, j)]);
                            // Beyond one radian an entry may be the small difference of larger ones.
                            let size = wanted.abs() + if angle * (1.0 + damping) > 1.0 { 1.0 } else { 0.0 };
                            assert!(
                                (found - wanted).abs() <= 1e-12 * size,
                                "D {damping}, w {w}, angle {angle}, {i} of {j} (a {a} of {N}): {found} for {wanted}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn the_transition_is_the_exponential_of_the_generator() {
        is_the_exponential::<4>();
        is_the_exponential::<5>();
        is_the_exponential::<6>();
    }

    fn is_the_integral<const N: usize>() {
        // Gauss's three nodes in each of many parts.
        let nodes = [(-0.6f64.sqrt(), 5.0 / 18.0), (0.0, 4.0 / 9.0), (0.6f64.sqrt(), 5.0 / 18.0)];
        for (damping, angle) in DAMPINGS.into_iter().flat_map(|damping| ANGLES.map(|angle| (damping, angle)))
        {
            for a in 0..N - 2 {
                let parts = 300.0 + (30.0 * angle * (1.0 + 2.0 * damping)).round();
                let part = angle / parts;
                let mut wanted = [[0.0; N]; N];
                let mut moment = set::<N>(1.0, damping, a, angle);
                let noise = *moment.noise();
                for k in 0..parts as usize {
                    for (node, weight) in nodes {
                        moment.set(part * (k as f64 + 0.5 * (1.0 + node)));
                        for i in 0..N {
                            for j in 0..N {
                                wanted[i][j] +=
                                    part * weight * moment.entry(i, N - 1) * moment.entry(j, N - 1);
                            }
                        }
                    }
                }
                for i in 0..N {
                    for j in 0..N {
                        assert_eq!(noise[i][j], noise[j][i]);
                        let size = (wanted[i][i] * wanted[j][j]).sqrt();
                        let relative = (noise[i][j] - wanted[i][j]).abs() / size;
                        assert!(
                            relative < 1e-9,
                            "D {damping}, angle {angle}, {i}, {j} (a {a} of {N}): {relative}"
                        );
                    }
                }
                let unit = DMatrix::from_fn(N, N, |i, j| noise[i][j] / (noise[i][i] * noise[j][j]).sqrt());
                assert!(unit.symmetric_eigenvalues().min() > -1e-15 * N as f64);
            }
        }
    }

    #[test]
    fn the_noise_is_the_integral_of_the_squared_response() {
        is_the_integral::<4>();
        is_the_integral::<5>();
        is_the_integral::<6>();
    }

    #[test]
    fn a_fast_oscillator_follows_the_drive() {
        let (w, step) = (1e4, 1.0);
        let ringing = set::<6>(w, 1.0, 2, step);
        for (entry, wanted) in
            [(ringing.entry(2, 4), 1.0), (ringing.entry(2, 5), step), (ringing.entry(1, 4), step)]
        {
            assert!((entry - wanted).abs() < 1e-3);
        }
        assert!(ringing.entry(2, 2).abs() < 1e-3 && (w * ringing.entry(2, 3)).abs() < 1e-3);
        assert!((ringing.noise()[2][2] / ringing.noise()[4][4] - 1.0).abs() < 1e-3);
    }

    #[test]
    fn the_longest_steps_end() {
        for step in [1e18, 1e300, f64::INFINITY] {
            set::<6>(1.0, 0.1, 2, step);
        }
        assert!(set::<6>(1.0, 0.1, 2, 1e18).noise().iter().flatten().all(|x| x.is_finite()));
    }
}
