//! The travel of a motion: weights with which the powers of the loads of all samples are summed over the distance.

use core::ops::Range;

use super::error::BatchError;
use crate::excitation::Excitation;
use crate::life::{Interval, MAX_EXPONENT, speed_coefficients};
use crate::numeric::float::{floor, pow};
use crate::numeric::power::Power;
use crate::numeric::watch::check_memory;
use core::cell::Cell;
use guideload_life::Travel as Course;

/// The weights fill blocks of samples of any size up to this one.
const PADDING: usize = 64;

/// Terms of the series for an exponent that is not whole, and the largest |b - a|/(a + b) of the loads a and b at the ends of an interval
/// for which it is used: the first term left out is then below 1e-13 for exponents up to 5.
const TERMS: usize = 9;

/// Most terms of a whole exponent, which has one more than its value; larger ones count as not whole.
pub(super) const MOST_TERMS: usize = 17;
pub(super) const LARGEST_CHANGE_OF_SERIES: f64 = 0.05;

/// The same for the series on a piece, and the size of its terms that are left out.
const LARGEST_RATIO: f64 = 1.0 / 3.0;
const NEGLIGIBLE: f64 = 1e-17;

/// The motion that all samples follow.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Excitation of all samples.
    pub excitation: Excitation<'a>,
    /// Velocity of the cart along x at its samples, m/s, for mean loads.
    pub speed: Option<&'a [f64]>,
    /// Exponent p of the mean load, 1 to 100: 3 for balls, 10/3 for rollers.
    pub exponent: f64,
}

/// Memory of a batch for each sample of its motion: times, intervals, kinds and weights, and for each component value, change and range.
const BYTES_PER_SAMPLE: usize = 48;
const BYTES_PER_COMPONENT: usize = 17;
/// Memory of the travel for each sample: an interval and up to nine weights.
const BYTES_OF_TRAVEL: usize = 112;

impl Motion<'_> {
    /// Checks speed and exponent, and whether there is memory for a batch of it.
    pub(super) fn check(&self) -> Result<(), BatchError> {
        let excitation = &self.excitation;
        if !(1.0..=MAX_EXPONENT).contains(&self.exponent) {
            return Err(BatchError::Exponent { got: self.exponent });
        }
        if let Some(speed) = self.speed {
            let (expected, got) = (excitation.count(), speed.len());
            if expected != got {
                return Err(BatchError::Length { field: "speed", expected, got });
            }
            if let Some(index) = speed.iter().position(|x| !x.is_finite()) {
                return Err(BatchError::Speed { index });
            }
        }
        let components = excitation.peak().iter().filter(|peak| **peak > 0.0).count();
        let travel = if self.speed.is_some() { BYTES_OF_TRAVEL } else { 0 };
        let bytes = BYTES_PER_SAMPLE + BYTES_PER_COMPONENT * components + travel;
        Ok(check_memory(bytes.saturating_mul(excitation.count()))?)
    }
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
    /// [`one_way`] of the intervals that end at the samples.
    pub one_way: Vec<Option<[f64; 3]>>,
    /// Coefficients of the series on a piece of an interval, see [`series_on_piece`].
    pub on_piece: Vec<[f64; 3]>,
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
        let whole = exponent == floor(exponent) && exponent < MOST_TERMS as f64;
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
        let half = pow(0.5, exponent);
        for (sample, moments) in (1..).zip(intervals.iter().map(|interval| moments(interval, terms))) {
            let mut factor = half;
            for (term, (weights, moment)) in weights.iter_mut().zip(moments).enumerate() {
                weights[sample] = factor * moment;
                factor *= (exponent - term as f64) / (term + 1) as f64;
            }
        }
        let path = intervals.iter().map(Interval::path).sum();
        let one_way = core::iter::once(None).chain(intervals.iter().map(one_way)).collect();
        let (power, on_piece) = (Power::new(exponent), series_on_piece(exponent, whole));
        (path > 0.0).then_some(Self { intervals, weights, one_way, on_piece, whole, power, exponent, path })
    }

    /// The weights of some samples, the first of which ends no interval.
    pub(super) fn part(&self, samples: &Range<usize>) -> Self {
        let mut part = self.clone();
        part.intervals = self.intervals[samples.start..samples.end - 1].to_vec();
        part.one_way = self.one_way[samples.clone()].to_vec();
        for weights in &mut part.weights {
            weights.copy_within(samples.clone(), 0);
            weights.truncate(samples.len());
            weights[0] = 0.0;
            weights.resize(samples.len().next_multiple_of(PADDING), 0.0);
        }
        part
    }

    /// Whether the cart moves in the intervals that end at `count` samples from `start` on.
    pub(super) fn moves(&self, start: usize, count: usize) -> bool {
        self.weights[0][start..].iter().take(count).any(|&weight| weight != 0.0)
    }

    /// Largest |b - a|/(a + b) of the loads a and b at the ends of a piece for which its series is used.
    pub(super) fn largest_ratio(&self) -> f64 {
        if self.whole { f64::INFINITY } else { LARGEST_RATIO }
    }
}

/// `∫ |v| x^k dt` over an interval with x from -1 to 1, m, for the first k, `terms` of them.
fn moments(interval: &Interval, terms: usize) -> [f64; MOST_TERMS] {
    let (course, sums) = (Course::new(interval), Cell::new([0.0; MOST_TERMS]));
    let speed = speed_coefficients(&course.whole);
    course.by_turns(&course.whole, [0.0; 2], |piece, _| {
        let ([start, middle, end], mut all) = (piece.speed, sums.get());
        let side = f64::copysign(0.5 * interval.length, start + middle + end);
        for (x, side) in [(2.0 * piece.to - 1.0, side), (2.0 * piece.from - 1.0, -side)] {
            let mut power = side * x;
            for (k, sum) in all.iter_mut().enumerate().take(terms) {
                let terms = [1, 2, 3].map(|more| 1.0 / (k + more) as f64);
                let [even, odd, square] = [speed[0] * terms[0], speed[1] * terms[1], speed[2] * terms[2]];
                *sum += power * (even + x * (odd + x * square));
                power *= x;
            }
        }
        sums.set(all);
        0.0
    });
    sums.get()
}

/// Coefficients of `|v| length = c0 + s (c1 + c2 (s - 1))` at a fraction s of the length, m; none if v changes its sign.
fn one_way(interval: &Interval) -> Option<[f64; 3]> {
    let course = Course::new(interval);
    let [start, middle, end] = course.whole.speed;
    let length = f64::copysign(interval.length, start + middle + end);
    let coefficients = [start, end - start, start - 2.0 * middle + end];
    (course.turns[0] == 1.0).then(|| coefficients.map(|coefficient| length * coefficient))
}

/// Coefficients with which the mean of `P^p v` over a piece is a series: with P linear, m in its middle and `m (1 + r)` at its end, and
/// `v = c0 + c1 x + c2 x²` for x from -1 to 1, it is `m^p Σ r^(2 j) (c0 f_j + c2 g_j + c1 r h_j)`. It ends by itself for a whole p.
fn series_on_piece(exponent: f64, whole: bool) -> Vec<[f64; 3]> {
    let (mut out, mut binomial, mut largest, mut k) = (Vec::new(), 1.0, 1.0, 0.0);
    while f64::abs(binomial) * largest > NEGLIGIBLE {
        let next = binomial * (exponent - k) / (k + 1.0);
        out.push([binomial / (k + 1.0), binomial / (k + 3.0), next / (k + 3.0)]);
        binomial = next * (exponent - k - 1.0) / (k + 2.0);
        largest *= if whole { 1.0 } else { LARGEST_RATIO * LARGEST_RATIO };
        k += 2.0;
    }
    out
}
