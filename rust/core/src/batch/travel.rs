//! The travel of a motion: weights with which the powers of the loads of all samples are summed over the distance.

use crate::excitation::Excitation;
use crate::life::Interval;
use crate::numeric::float::{floor, pow};
use crate::numeric::power::Power;

/// The weights fill blocks of samples of any size up to this one.
const PADDING: usize = 64;

/// Terms of the series for an exponent that is not whole, and the largest |b - a|/(a + b) of the loads a and b at the ends of an interval
/// for which it is used: the first term left out is then below 1e-13 for exponents up to 5.
const TERMS: usize = 9;
pub(super) const NEARLY_CONSTANT: f64 = 0.05;

/// The motion that all samples follow.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Excitation of all samples.
    pub excitation: Excitation<'a>,
    /// Velocity of the cart along x at its samples, m/s, for mean loads.
    pub speed: Option<&'a [f64]>,
    /// Exponent p of the mean load: 3 for balls, 10/3 for rollers.
    pub exponent: f64,
}

/// Weights of the intervals of a motion.
///
/// On an interval, a load P that is linear from a to b has `P^p = ((a + b)/2)^p Σ C(p, k) r^k x^k` with `r = (b - a)/(a + b)` and x from -1
/// to 1. The integral of `P^p |v|` is therefore a sum of products of powers of a + b and b - a with weights that depend on the motion only.
#[derive(Debug, Clone)]
pub(super) struct Travel {
    pub intervals: Vec<Interval>,
    /// Weights of `(a + b)^(p - k) (b - a)^k`, for each k those of the intervals that end at the samples; zero for the first sample, and
    /// after the last one, so that blocks are full.
    pub weights: Vec<Vec<f64>>,
    /// Whether the exponent is whole, so that the weights hold for any loads.
    pub whole: bool,
    pub power: Power,
    pub exponent: f64,
    /// Distance, m.
    pub path: f64,
}

impl Travel {
    /// The travel at a velocity along x, m/s, at the samples; none for a motion that never moves.
    pub(super) fn new(excitation: &Excitation, velocity: &[f64], exponent: f64) -> Option<Self> {
        let whole = exponent == floor(exponent) && exponent < 17.0;
        let terms = if whole { exponent as usize + 1 } else { TERMS };
        let mut weights = vec![vec![0.0; excitation.count().next_multiple_of(PADDING)]; terms];
        let at = |k: usize| excitation.component(k, 0);
        let intervals: Vec<Interval> = (1..excitation.count())
            .map(|k| Interval {
                length: excitation.interval(k - 1),
                velocity: [velocity[k - 1], velocity[k]],
                acceleration: [at(k - 1), at(k)],
            })
            .collect();
        let mut factor = pow(0.5, exponent);
        for (term, weights) in weights.iter_mut().enumerate() {
            for (weight, interval) in weights[1..].iter_mut().zip(&intervals) {
                *weight = factor * interval.moment(term as u32);
            }
            factor *= (exponent - term as f64) / (term + 1) as f64;
        }
        let path = intervals.iter().map(Interval::path).sum();
        let power = Power::new(exponent);
        (path > 0.0).then_some(Self { intervals, weights, whole, power, exponent, path })
    }
}
