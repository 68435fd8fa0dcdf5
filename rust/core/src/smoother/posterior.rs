//! The posterior of the motion given all samples, as a Markov chain forward in time.
//!
//! Given all samples, the deviations of the states from their estimates obey d(k+1) = A d(k) + L w with w standard normal, because given
//! x(k), the samples up to k contain no further information on x(k+1). A backward pass stores the information of the samples k to n on x(k)
//! as a square root R: R x is known up to standard normal noise (square-root information filter, Bierman 1977). Over an interval, x(k+1) =
//! Phi x(k) + G w, and orthogonal transformations of
//!
//! ```text
//! [  I    0   ]        [ U  V ]
//! [ R G  R Phi ]  into  [ 0  R' ]
//! ```
//!
//! give both the root R' before the interval and w given x(k) and the later samples: U w + V x(k) is standard normal. No covariance is
//! inverted, so noise densities may differ by many decades between intervals.

use super::data::ProcessNoise;
use super::square_root::{Columns, TimeUpdated, measurement_update, time_update, upper_cholesky};
use super::transition::{Transition, product, with_transition};
use crate::error::Stopped;
use crate::numeric::simd::dispatch;
use crate::numeric::watch::{Watch, filled};

/// Largest order, the number of entries of a state.
pub const MAX_ORDER: usize = 6;

/// A matrix by rows; entries past the order are zero.
pub type Square = [[f64; MAX_ORDER]; MAX_ORDER];

/// Step of the chain to the first sample, or from one sample to the next: d' = `transition` d + `noise_root` w, w standard normal.
#[derive(Debug, Clone, Copy)]
pub struct MarkovStep {
    /// A.
    pub transition: Square,
    /// L, upper triangular.
    pub noise_root: Square,
}

impl MarkovStep {
    /// Covariance of d', given that of d.
    pub(crate) fn covariance(&self, before: &Square) -> Square {
        dispatch!(self.covariance_after(before))
    }

    /// A P A^T + L L^T.
    #[inline(always)]
    fn covariance_after(&self, covariance: &Square) -> Square {
        let Self { transition: carry, noise_root: noise } = self;
        let (carried, mut after) = (product(carry, covariance), [[0.0; MAX_ORDER]; MAX_ORDER]);
        for i in 0..MAX_ORDER {
            for j in 0..MAX_ORDER {
                for l in 0..MAX_ORDER {
                    after[i][j] += carried[i][l] * carry[j][l] + noise[i][l] * noise[j][l];
                }
            }
        }
        after
    }
}

/// The model without the values of the samples, on which deviations from the estimate do not depend.
#[derive(Clone, Copy)]
pub struct PosteriorInput<'a> {
    /// Time from each sample to the next, > 0, n - 1 numbers.
    pub step: &'a [f64],
    /// Variance of each sample's measurement noise, > 0, n numbers; infinite for a sample without information.
    pub variance: &'a [f64],
    /// Covariance of the state before the first sample, N x N by rows.
    pub covariance: &'a [f64],
    /// Process noise.
    pub noise: ProcessNoise<'a>,
    /// Whether to stop.
    pub watch: Watch<'a>,
}

/// The chain of n states of 2 to 6 entries. It stores the information of the later samples on each state: N (N + 1) / 2 numbers per sample.
#[derive(Clone)]
pub struct Posterior<'a> {
    order: usize,
    given: PosteriorInput<'a>,
    information: Vec<f64>,
}

impl<'a> Posterior<'a> {
    /// The chain of states with `order` entries; None if `order` is not 2 to 6 (with an oscillator 4 to 6).
    ///
    /// # Errors
    /// [`Stopped`].
    pub fn new(order: usize, given: PosteriorInput<'a>) -> Result<Option<Self>, Stopped> {
        let information = with_transition!(order, given.noise.oscillator, N, T => information::<N, T>(given));
        let Some(information) = information.transpose()? else { return Ok(None) };
        Ok(Some(Self { order, given, information }))
    }

    /// Order, the number of entries of a state.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Whether a computation with the chain should stop.
    pub(crate) fn watch(&self) -> Watch<'a> {
        self.given.watch
    }

    /// Number of samples.
    pub fn count(&self) -> usize {
        self.given.variance.len()
    }

    /// The steps in order; the first leads to the first sample and has a zero `transition`.
    pub fn steps(&self) -> Box<dyn Iterator<Item = MarkovStep> + '_> {
        let steps = with_transition!(self.order, self.given.noise.oscillator, N, T => {
            Box::new(ChainSteps::<N, T>::new(self)) as Box<dyn Iterator<Item = MarkovStep>>
        });
        steps.unwrap_or_else(|| Box::new(core::iter::empty()))
    }

    /// The variances of the first three entries of each state.
    pub(super) fn variances(&self) -> impl Iterator<Item = [f64; 3]> {
        self.steps().scan([[0.0; MAX_ORDER]; MAX_ORDER], |covariance, step| {
            *covariance = step.covariance(covariance);
            Some(core::array::from_fn(|i| covariance[i][i]))
        })
    }
}

/// Square roots of the information, upper triangles by rows, sample 0 first.
fn information<const N: usize, T: Transition<N>>(given: PosteriorInput) -> Result<Vec<f64>, Stopped> {
    let count = given.variance.len();
    let size = N * (N + 1) / 2;
    let mut all = filled(0.0, count.saturating_mul(size))?;
    let mut interval = IntervalNoise::<N, T>::new(given);
    let mut root = [[0.0; N]; N];
    for (k, packed) in all.chunks_exact_mut(size).enumerate().rev() {
        if given.watch.stops_at(k) {
            return Err(Stopped::Interrupted);
        }
        if k + 1 < count {
            let noise = interval.noise(given, k);
            root = dispatch!(time_update(&root, noise, &interval.transition)).rest;
        }
        root = dispatch!(measurement_update(&root, 1.0 / given.variance[k].sqrt()));
        let mut at = 0;
        for i in 0..N {
            for j in i..N {
                packed[at] = root[j][i];
                at += 1;
            }
        }
    }
    Ok(all)
}

/// Transition over one interval, and the root of its noise.
struct IntervalNoise<const N: usize, T> {
    transition: T,
    step: f64,
    root: Columns<N>,
}

impl<const N: usize, T: Transition<N>> IntervalNoise<N, T> {
    fn new(given: PosteriorInput) -> Self {
        Self { transition: T::new(given.noise.oscillator), step: f64::NAN, root: [[0.0; N]; N] }
    }

    /// Sets the interval to the one after sample k; returns G.
    fn noise(&mut self, given: PosteriorInput, k: usize) -> Columns<N> {
        if given.step[k] != self.step {
            self.step = given.step[k];
            self.transition.set(self.step);
            self.root = upper_cholesky(self.transition.noise());
        }
        let size = given.noise.after(k).sqrt();
        self.root.map(|column| column.map(|x| size * x))
    }
}

/// The steps of a chain.
struct ChainSteps<'a, const N: usize, T> {
    chain: &'a Posterior<'a>,
    next: usize,
    interval: IntervalNoise<N, T>,
}

impl<'a, const N: usize, T: Transition<N>> ChainSteps<'a, N, T> {
    fn new(chain: &'a Posterior<'a>) -> Self {
        Self { chain, next: 0, interval: IntervalNoise::new(chain.given) }
    }
}

impl<const N: usize, T: Transition<N>> Iterator for ChainSteps<'_, N, T> {
    type Item = MarkovStep;

    fn next(&mut self) -> Option<MarkovStep> {
        let k = self.next;
        if k >= self.chain.count() {
            return None;
        }
        self.next += 1;
        let given = self.chain.given;
        let packed = &self.chain.information[k * N * (N + 1) / 2..];
        let mut root = [[0.0; N]; N];
        let mut at = 0;
        for i in 0..N {
            for j in i..N {
                root[j][i] = packed[at];
                at += 1;
            }
        }
        Some(if k == 0 {
            let covariance = core::array::from_fn(|i| core::array::from_fn(|j| given.covariance[i * N + j]));
            let from_nothing = T::new(given.noise.oscillator);
            dispatch!(chain_step(&root, upper_cholesky(&covariance), &from_nothing))
        } else {
            let noise = self.interval.noise(given, k - 1);
            dispatch!(chain_step(&root, noise, &self.interval.transition))
        })
    }
}

/// The step of a chain: A = Phi - G U^-1 V, L = G U^-1.
#[inline(always)]
fn chain_step<const N: usize, T: Transition<N>>(
    root: &Columns<N>,
    noise: Columns<N>,
    transition: &T,
) -> MarkovStep {
    let TimeUpdated { u, v, .. } = time_update(root, noise, transition);
    // L U = G, column by column.
    let mut l = noise;
    for j in 0..N {
        for a in 0..j {
            for i in 0..=a {
                l[j][i] -= l[a][i] * u[j][a];
            }
        }
        for i in 0..=j {
            l[j][i] /= u[j][j];
        }
    }
    let mut step =
        MarkovStep { transition: [[0.0; MAX_ORDER]; MAX_ORDER], noise_root: [[0.0; MAX_ORDER]; MAX_ORDER] };
    for i in 0..N {
        for j in i..N {
            step.noise_root[i][j] = l[j][i];
        }
        for j in 0..N {
            step.transition[i][j] = transition.entry(i, j);
            for a in i..N {
                step.transition[i][j] -= l[a][i] * v[j][a];
            }
        }
    }
    step
}

#[cfg(test)]
mod tests {
    use super::super::data::Oscillator;
    use super::super::derivatives::Derivatives;
    use super::super::ringing::Ringing;
    use super::*;
    use nalgebra::DMatrix;

    const STEP: [f64; 5] = [0.4, 1.3, 0.7, 2.0, 1.0];
    const VARIANCE: [f64; 6] = [0.5, 2.0, f64::INFINITY, 0.1, 1.0, 0.3];
    const SEGMENT: [u32; 5] = [0, 1, 1, 2, 0];

    fn given<'a>(
        covariance: &'a [f64],
        density: &'a [f64],
        oscillator: Option<Oscillator>,
    ) -> PosteriorInput<'a> {
        PosteriorInput {
            step: &STEP,
            variance: &VARIANCE,
            covariance,
            noise: ProcessNoise { segment: &SEGMENT, density, oscillator },
            watch: Watch::NEVER,
        }
    }

    /// The whole model as rows of unit noise: of the start, of every interval, of every sample. With QR = rows the covariance is R^-1
    /// R^-T.
    fn dense<const N: usize, T: Transition<N>>(given: PosteriorInput) -> DMatrix<f64> {
        let count = given.variance.len();
        let white = |covariance: DMatrix<f64>| {
            let root = covariance.cholesky().expect("positive definite").l();
            root.try_inverse().expect("positive definite")
        };
        let mut rows = DMatrix::zeros((N + 1) * count, N * count);
        let start = white(DMatrix::from_row_slice(N, N, given.covariance));
        rows.view_mut((0, 0), (N, N)).copy_from(&start);
        let mut transition = T::new(given.noise.oscillator);
        for k in 0..count - 1 {
            transition.set(given.step[k]);
            let size = given.noise.after(k);
            let white = white(DMatrix::from_fn(N, N, |i, j| size * transition.noise()[i][j]));
            let phi = DMatrix::from_fn(N, N, |i, j| transition.entry(i, j));
            rows.view_mut((N * (k + 1), N * k), (N, N)).copy_from(&(-&white * phi));
            rows.view_mut((N * (k + 1), N * (k + 1)), (N, N)).copy_from(&white);
        }
        for k in 0..count {
            rows[(N * count + k, N * k)] = 1.0 / given.variance[k].sqrt();
        }
        let inverse = rows.qr().r().try_inverse().expect("all is known");
        &inverse * inverse.transpose()
    }

    fn square(rows: &Square, order: usize) -> DMatrix<f64> {
        DMatrix::from_fn(order, order, |i, j| rows[i][j])
    }

    fn is_the_posterior<const N: usize, T: Transition<N>>(oscillator: Option<Oscillator>) {
        let start = DMatrix::<f64>::from_fn(N, N, |i, j| if i == j { 3.0 + i as f64 } else { 0.5 });
        let covariance: Vec<f64> = start.iter().copied().collect();
        let given = given(&covariance, &[1.0, 30.0, 0.02], oscillator);
        let wanted = dense::<N, T>(given);
        let chain = Posterior::new(N, given).expect("memory").expect("an order from 2 to 6");
        let mut before = DMatrix::zeros(N, N);
        for (k, step) in chain.steps().enumerate() {
            let (carry, noise) = (square(&step.transition, N), square(&step.noise_root, N));
            let across = &carry * &before;
            before = &across * carry.transpose() + &noise * noise.transpose();
            let block = wanted.view((N * k, N * k), (N, N));
            assert!((&before - block).amax() < 1e-7 * block.amax(), "order {N}, sample {k}");
            if k > 0 {
                let block = wanted.view((N * k, N * (k - 1)), (N, N));
                assert!((&across - block).amax() < 1e-7 * wanted.amax(), "order {N}, to sample {k}");
            }
        }
    }

    #[test]
    fn the_chain_has_the_covariances_of_the_posterior() {
        is_the_posterior::<2, Derivatives<2>>(None);
        is_the_posterior::<3, Derivatives<3>>(None);
        is_the_posterior::<4, Derivatives<4>>(None);
        is_the_posterior::<5, Derivatives<5>>(None);
        is_the_posterior::<6, Derivatives<6>>(None);
    }

    #[test]
    fn with_an_oscillator_too() {
        for damping in [0.05, 1.0] {
            let at = |acceleration| Some(Oscillator { frequency: 1.3, damping, acceleration });
            is_the_posterior::<4, Ringing<4>>(at(1));
            is_the_posterior::<5, Ringing<5>>(at(1));
            is_the_posterior::<5, Ringing<5>>(at(2));
            is_the_posterior::<6, Ringing<6>>(at(2));
        }
    }

    #[test]
    fn without_noise_there_is_no_deviation() {
        let chain = Posterior::new(3, given(&[0.0; 9], &[0.0; 3], None)).expect("memory").expect("order 3");
        assert!(chain.steps().all(|step| step.noise_root == [[0.0; MAX_ORDER]; MAX_ORDER]));
    }

    #[test]
    fn orders_are_2_to_6() {
        assert!(Posterior::new(1, given(&[1.0], &[1.0; 3], None)).expect("memory").is_none());
        assert!(Posterior::new(7, given(&[1.0; 49], &[1.0; 3], None)).expect("memory").is_none());
    }
}
