//! How far a value may bow away from the chords between the samples of a motion.

use super::block::BLOCK;
use crate::output::{BOW, beyond, is_unknown};

/// What second differences at the samples of a block say of a value in the interval before a sample.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bow {
    /// Length of the interval, s.
    pub length: f64,
    /// Factors on the changes to the sample and to the next one in the second difference quotient at the sample, 1/s²; zero if it is unknown.
    pub factors: [f64; 2],
    /// Whether the quotients at both ends of the interval are known: to the block alone, so not at the sample before it and its last one.
    pub known: [bool; 2],
    /// Bow over the larger quotient at the ends of the interval, s².
    pub size: f64,
    /// Infinite where the bow is not known, see [`is_unknown`], else zero.
    pub unknown: f64,
    /// What a change of the rate of the excitation at the sample adds to the curvature at the end of an interval beside what the quotient says:
    /// factor on the effect of the rate on the curvature, and on the direct effect, 1/s. Zero where the quotient is unknown.
    pub kink: [f64; 2],
}

/// The largest bows of a block.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MostBow {
    /// Over the range of a value in the block.
    pub by_range: f64,
    /// Over a curvature, s².
    pub by_curvature: f64,
    /// Infinite if a bow is unknown, else zero.
    pub unknown: f64,
}

/// The bows of a motion.
#[derive(Debug, Clone)]
pub(super) struct Bows {
    /// Of the interval before each sample.
    all: Vec<Bow>,
    /// Of each block.
    most: Vec<MostBow>,
    components: usize,
    kinks: Vec<[f64; 2]>,
}

impl Bows {
    /// Those of intervals, each before its sample, s, and of values of some components of the excitation, sample by sample.
    pub(super) fn new(intervals: &[f64], values: &[f64], components: usize) -> Self {
        let all = bows(intervals);
        let most = all.chunks_exact(BLOCK).map(most_bow).collect();
        let kinks = kinks(intervals, values, components, &all);
        Self { all, most, components, kinks }
    }

    /// The bow of the interval before a sample.
    pub(super) fn at(&self, sample: usize) -> &Bow {
        &self.all[sample]
    }

    /// The bows of a block.
    pub(super) fn of(&self, block: usize) -> Option<&[Bow; BLOCK]> {
        self.all[block * BLOCK..].first_chunk()
    }

    /// The largest bows of a block.
    pub(super) fn most(&self, block: usize) -> &MostBow {
        &self.most[block]
    }

    /// Largest changes of the rate of each component at the ends of the intervals of a block, with the factors of [`Bow::kink`].
    pub(super) fn kinks(&self, block: usize) -> &[[f64; 2]] {
        &self.kinks[block * self.components..][..self.components]
    }
}

fn bows(intervals: &[f64]) -> Vec<Bow> {
    let mut bows = vec![Bow::default(); intervals.len()];
    for (k, bow) in bows.iter_mut().enumerate() {
        let (length, next) = (intervals[k], intervals.get(k + 1).copied().unwrap_or(0.0));
        if length > 0.0 && next > 0.0 {
            bow.factors = [length, next].map(|part| 2.0 / ((length + next) * part));
            bow.kink = [f64::max(length, next) / (length + next), 2.0 / (length + next)];
        }
        (bow.length, bow.size) = (length, BOW * 0.125 * length * length);
    }
    for block in bows.chunks_exact_mut(BLOCK) {
        let count = block[..BLOCK - 1].iter().filter(|bow| bow.factors[0] > 0.0).count();
        for k in 0..BLOCK {
            let known = |k: usize| block[k].factors[0] > 0.0;
            block[k].known = [k > 0 && known(k - 1), k + 1 < BLOCK && known(k)];
            if block[k].length > 0.0 && is_unknown(block[k].known, count) {
                block[k].unknown = f64::INFINITY;
            }
        }
    }
    bows
}

fn most_bow(block: &[Bow]) -> MostBow {
    let mut most = MostBow::default();
    // The largest quotient over the range of a value at each sample, none at the last one, and at all.
    let mut quotients = [0.0; BLOCK + 1];
    for (quotient, bow) in quotients[1..BLOCK].iter_mut().zip(block) {
        *quotient = bow.factors[0] + bow.factors[1];
    }
    let largest = quotients.iter().copied().fold(0.0, f64::max);
    for (k, bow) in block.iter().enumerate() {
        let ends = f64::max(quotients[k], quotients[k + 1]);
        let quotient = if bow.known == [true; 2] { ends } else { beyond(ends, largest) };
        most.by_range = f64::max(most.by_range, bow.size * quotient);
        most.by_curvature = f64::max(most.by_curvature, bow.size);
        most.unknown = f64::max(most.unknown, bow.unknown);
    }
    most
}

/// See [`Bows::kinks`].
fn kinks(intervals: &[f64], values: &[f64], components: usize, bows: &[Bow]) -> Vec<[f64; 2]> {
    let rate = |k: usize, component: usize| {
        let value = |k: usize| values[k * components + component];
        if k > 0 && intervals[k] > 0.0 { (value(k) - value(k - 1)) / intervals[k] } else { 0.0 }
    };
    let mut kinks = vec![[0.0; 2]; intervals.len() / BLOCK * components];
    for (index, kinks) in kinks.iter_mut().enumerate() {
        let (block, component) = (index / components, index % components);
        for k in (block * BLOCK).saturating_sub(1)..usize::min((block + 1) * BLOCK, intervals.len() - 1) {
            let change = (rate(k + 1, component) - rate(k, component)).abs();
            for (most, factor) in kinks.iter_mut().zip(bows[k].kink) {
                *most = f64::max(*most, factor * change);
            }
        }
    }
    kinks
}
