//! The filter forwards and the smoother backwards, sample by sample; a closure of the caller receives each result.
//!
//! All functions are inlined into those of `smooth` and `adapt` that are compiled for the widest vectors.

use core::marker::PhantomData;

use super::data::{ProcessNoise, Samples, Start};
use super::transition::Transition;
use crate::error::Stopped;
use crate::numeric::watch::room;

/// Prediction of a sample by the filter, as the backward pass needs it.
#[derive(Clone, Copy)]
pub(super) struct Prediction<const N: usize> {
    pub mean: [f64; N],
    pub covariance: [[f64; N]; N],
    pub innovation: f64,
    pub variance: f64,
}

/// Mean and covariance of the state given the samples so far.
#[derive(Clone, Copy)]
struct State<const N: usize> {
    mean: [f64; N],
    covariance: [[f64; N]; N],
}

/// Score of all samples from here on, and its variance.
pub(super) struct Score<const N: usize> {
    pub r: [f64; N],
    pub variance: [[f64; N]; N],
}

/// Both passes over the same samples. The forward pass stores only its state before each block; the backward pass repeats it block by
/// block. This is faster than loading all states from memory, and needs little memory.
pub(super) struct ForwardBackward<const N: usize, T> {
    before: Vec<State<N>>,
    block: Vec<Prediction<N>>,
    transition: PhantomData<T>,
}

const BLOCK: usize = 32; // samples; even for six states they fit into the first-level cache

impl<const N: usize, T: Transition<N>> ForwardBackward<N, T> {
    pub fn new() -> Self {
        Self { before: Vec::new(), block: Vec::new(), transition: PhantomData }
    }

    /// Runs the filter and passes each prediction to `show`.
    #[inline(always)]
    pub fn forward(samples: Samples, start: Start, noise: ProcessNoise, mut show: impl FnMut(Prediction<N>)) {
        let mut state = State::of(start);
        let mut transition = T::new(noise.oscillator);
        let count = samples.value.len();
        // By blocks: a call in the inner loop would cost a tenth.
        for first in (0..count).step_by(BLOCK) {
            if samples.watch.stops_at(first) {
                return;
            }
            for k in first..count.min(first + BLOCK) {
                show(state.pass(&mut transition, k, samples, noise));
            }
        }
    }

    /// Runs the filter for a backward pass.
    #[inline(always)]
    pub fn filter(&mut self, samples: Samples, start: Start, noise: ProcessNoise) -> Result<(), Stopped> {
        self.before.clear();
        if self.before.capacity() == 0 {
            self.before = room(samples.value.len().div_ceil(BLOCK))?;
        }
        let mut state = State::of(start);
        let mut transition = T::new(noise.oscillator);
        let count = samples.value.len();
        for first in (0..count).step_by(BLOCK) {
            self.before.push(state);
            if samples.watch.stops_at(first) {
                return Err(Stopped::Interrupted);
            }
            for k in first..count.min(first + BLOCK) {
                state.pass(&mut transition, k, samples, noise);
            }
        }
        Ok(())
    }

    /// Runs backwards. Passes each interval with the score after it to `interval`, then the sample before with its score to `sample`.
    #[inline(always)]
    pub fn backward(
        &mut self,
        samples: Samples,
        noise: ProcessNoise,
        mut interval: impl FnMut(usize, &T, &Score<N>),
        mut sample: impl FnMut(usize, &Prediction<N>, &Score<N>, [f64; 2]),
    ) -> Result<(), Stopped> {
        let mut score = Score { r: [0.0; N], variance: [[0.0; N]; N] };
        let mut transition = T::new(noise.oscillator);
        let mut ahead = transition.clone();
        let count = samples.value.len();
        for (number, &before) in self.before.iter().enumerate().rev() {
            let first = number * BLOCK;
            if samples.watch.stops_at(first) {
                return Err(Stopped::Interrupted);
            }
            let mut state = before;
            self.block.clear();
            for k in first..count.min(first + BLOCK) {
                self.block.push(state.pass(&mut ahead, k, samples, noise));
            }
            for k in (first..first + self.block.len()).rev() {
                let at = &self.block[k - first];
                if k + 1 < count {
                    transition.set(samples.step[k]);
                    interval(k, &transition, &score);
                    transition.propagate_transposed(&mut score.r);
                    transition.propagate_information(&mut score.variance);
                }
                let gain: [f64; N] = core::array::from_fn(|i| at.covariance[i][0] / at.variance);
                let mut passed = [0.0; N];
                for i in 0..N {
                    for j in 0..N {
                        passed[i] += score.variance[i][j] * gain[j];
                    }
                }
                let (mut u, mut d) = (at.innovation / at.variance, 1.0 / at.variance);
                for i in 0..N {
                    u -= gain[i] * score.r[i];
                    d += gain[i] * passed[i];
                }
                score.r[0] += u;
                for i in 0..N {
                    score.variance[0][i] -= passed[i];
                    score.variance[i][0] -= passed[i];
                }
                score.variance[0][0] += d;
                sample(k, at, &score, [u, d]);
            }
        }
        Ok(())
    }
}

impl<const N: usize> State<N> {
    fn of(start: Start) -> Self {
        Self {
            mean: core::array::from_fn(|i| start.mean[i]),
            covariance: core::array::from_fn(|i| core::array::from_fn(|j| start.covariance[i * N + j])),
        }
    }

    /// Predicts sample k and updates the state with it.
    #[inline(always)]
    fn pass<T: Transition<N>>(
        &mut self,
        transition: &mut T,
        k: usize,
        samples: Samples,
        noise: ProcessNoise,
    ) -> Prediction<N> {
        if k > 0 {
            transition.set(samples.step[k - 1]);
            transition.propagate(&mut self.mean);
            transition.propagate_covariance(&mut self.covariance, noise.after(k - 1));
        }
        let (mean, p) = (self.mean, self.covariance);
        let variance = p[0][0].max(0.0) + samples.variance[k];
        let innovation = samples.value[k] - mean[0];
        for i in 0..N {
            let gain = p[i][0] / variance;
            self.mean[i] += gain * innovation;
            for j in 0..N {
                self.covariance[i][j] -= gain * p[j][0];
            }
        }
        Prediction { mean, covariance: p, innovation, variance }
    }
}
