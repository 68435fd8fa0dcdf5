//! Draws of the motion given all samples: forward filter, backward sampling (Carter and Kohn 1994).

use super::motion::Motion;
use super::{Intensity, Passes, Samples, Start};

impl<const N: usize> Passes<N> {
    pub(super) fn draw(
        samples: Samples,
        start: Start,
        intensity: Intensity,
        normal: &[f64],
        derivative: usize,
        out: &mut [f64],
    ) {
        let mut passes = Self { kept: Vec::new() };
        passes.filter(samples, start, intensity);
        let mut motion = Motion::<N>::new(1.0);
        let mut later = [0.0; N];
        for k in (0..passes.count()).rev() {
            let at = passes.at(k);
            let mut state = State { mean: at.mean, root: root(&at.covariance) };
            let mut first = [0.0; N];
            first[0] = 1.0;
            state.measure(&first, samples.value[k], samples.variance[k]);
            if k + 1 < passes.count() {
                // The state drawn for the next sample measures this one, with the noise of the interval, made white.
                motion.set(samples.step[k]);
                let spread = intensity.of[intensity.cell[k] as usize];
                let lower = root(&motion.noise);
                let mut rows = [[0.0; N]; N];
                for i in 0..N {
                    for j in i..N {
                        rows[i][j] = motion.phi[j - i];
                    }
                }
                let mut seen = later;
                for i in 0..N {
                    for l in 0..i {
                        let factor = lower[i][l];
                        seen[i] -= factor * seen[l];
                        for j in 0..N {
                            rows[i][j] -= factor * rows[l][j];
                        }
                    }
                    seen[i] /= lower[i][i];
                    for j in 0..N {
                        rows[i][j] /= lower[i][i];
                    }
                    state.measure(&rows[i], seen[i], spread);
                }
            }
            for i in 0..N {
                later[i] = state.mean[i];
                for j in 0..N {
                    later[i] += state.root[i][j] * normal[k * N + j];
                }
            }
            out[k] = later[derivative];
        }
    }
}

/// A normal distribution; its covariance is root root^T, which no rounding makes indefinite.
struct State<const N: usize> {
    mean: [f64; N],
    root: [[f64; N]; N],
}

impl<const N: usize> State<N> {
    /// Given that row . x plus noise is `value` (Potter 1963).
    fn measure(&mut self, row: &[f64; N], value: f64, noise: f64) {
        let mut f = [0.0; N];
        let mut misfit = value;
        for i in 0..N {
            misfit -= row[i] * self.mean[i];
            for j in 0..N {
                f[j] += self.root[i][j] * row[i];
            }
        }
        let total = f.iter().map(|x| x * x).sum::<f64>() + noise;
        let shrink = 1.0 / (total + (noise * total).sqrt());
        for i in 0..N {
            let gain: f64 = (0..N).map(|j| self.root[i][j] * f[j]).sum();
            self.mean[i] += gain * misfit / total;
            for j in 0..N {
                self.root[i][j] -= gain * shrink * f[j];
            }
        }
    }
}

/// Cholesky factor; a direction without variance, or with less than rounding, gets none.
fn root<const N: usize>(p: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut l = [[0.0; N]; N];
    for j in 0..N {
        let mut pivot = p[j][j];
        for a in 0..j {
            pivot -= l[j][a] * l[j][a];
        }
        if pivot <= 1e-15 * p[j][j] {
            continue;
        }
        l[j][j] = pivot.sqrt();
        for i in j + 1..N {
            let mut sum = p[i][j];
            for a in 0..j {
                sum -= l[i][a] * l[j][a];
            }
            l[i][j] = sum / l[j][j];
        }
    }
    l
}
