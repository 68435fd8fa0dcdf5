//! The motion as all scenes see it: values and changes at the samples, interval lengths that come again, weights.

use crate::excitation::Excitation;

/// Samples that are worked on at a time: their states and loads stay in the first cache.
pub(super) const BLOCK: usize = 16;

/// Interval lengths of which the step is stores_values; from a trace with more, each is made when it comes.
const MAX_LENGTHS: usize = 64;

/// A motion, laid out for marching from block to block.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    /// Number of samples.
    pub count: usize,
    /// Components of the excitation that are not zero throughout.
    pub components: Vec<usize>,
    /// Their values at the samples, and the changes from the sample before, sample by sample; whole blocks, the last value repeated.
    pub values: Vec<f64>,
    pub changes: Vec<f64>,
    /// Smallest and largest value of each component in each block.
    ranges: Vec<[f64; 2]>,
    /// Time from the sample before, s.
    pub intervals: Vec<f64>,
    /// Lengths that come again, and which of them each interval has; none if there are too many.
    pub lengths: Vec<f64>,
    pub kinds: Option<Vec<u32>>,
    /// Weights of the samples in time and in travel, zero past the last one.
    pub time: Vec<f64>,
    pub travel: Vec<f64>,
    /// s.
    pub duration: f64,
}

impl Timeline {
    /// Of an excitation, and of the weights of its samples in time and, if anything, in travel.
    pub(super) fn new(excitation: &Excitation, time: &[f64], travel: &[f64]) -> Self {
        let count = excitation.count();
        let peak = excitation.peak();
        let components: Vec<usize> = (0..9).filter(|&component| peak[component] > 0.0).collect();
        let whole = count.next_multiple_of(BLOCK);
        let mut values = Vec::with_capacity(whole * components.len());
        let mut changes = Vec::with_capacity(whole * components.len());
        for k in 0..whole {
            let (now, before) = (usize::min(k, count - 1), usize::min(k.saturating_sub(1), count - 1));
            for &component in &components {
                let value = excitation.component(now, component);
                values.push(value);
                // The motion begins at rest, where the excitation would hold nothing yet: a first value is a change.
                let from = if k == 0 { 0.0 } else { excitation.component(before, component) };
                changes.push(value - from);
            }
        }
        let mut ranges = Vec::with_capacity(whole / BLOCK * components.len());
        for block in values.chunks_exact(usize::max(BLOCK * components.len(), 1)) {
            for component in 0..components.len() {
                let of = block[component..].iter().step_by(components.len());
                ranges.push(of.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], &value| {
                    [f64::min(least, value), f64::max(most, value)]
                }));
            }
        }
        let mut intervals = vec![0.0; whole];
        for k in 1..count {
            intervals[k] = excitation.interval(k - 1);
        }
        let mut lengths: Vec<f64> = Vec::new();
        let mut kinds = Some(Vec::with_capacity(whole));
        for &interval in &intervals {
            let known = lengths.iter().rposition(|&length| length == interval);
            match (&mut kinds, known) {
                (Some(kinds), Some(kind)) => kinds.push(kind as u32),
                (Some(kinds), None) if lengths.len() < MAX_LENGTHS => {
                    kinds.push(lengths.len() as u32);
                    lengths.push(interval);
                }
                _ => {
                    (kinds, lengths) = (None, Vec::new());
                    break;
                }
            }
        }
        let padded = |weights: &[f64]| {
            let mut weights = weights.to_vec();
            weights.resize(whole, 0.0);
            weights
        };
        let duration = excitation.duration();
        Self {
            count,
            components,
            values,
            changes,
            ranges,
            intervals,
            lengths,
            kinds,
            time: padded(time),
            travel: padded(travel),
            duration,
        }
    }

    /// Blocks of [`BLOCK`] samples, the last one filled up.
    pub(super) fn blocks(&self) -> usize {
        self.count.div_ceil(BLOCK)
    }

    /// Smallest and largest value of each component in a block.
    pub(super) fn range(&self, block: usize) -> &[[f64; 2]] {
        &self.ranges[block * self.components.len()..][..self.components.len()]
    }

    /// Which length the intervals up to all samples of a block have, if it is the same.
    pub(super) fn kind(&self, block: usize) -> Option<usize> {
        let kinds = self.kinds.as_ref()?;
        let kinds = &kinds[block * BLOCK..usize::min((block + 1) * BLOCK, self.count)];
        kinds.iter().all(|kind| *kind == kinds[0]).then(|| kinds[0] as usize)
    }
}
