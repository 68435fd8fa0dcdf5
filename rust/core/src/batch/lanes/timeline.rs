//! The motion of all scenes: values and changes at the samples, recurring interval lengths, weights.

pub(super) use super::block::BLOCK;
use super::bows::Bows;
use crate::excitation::Excitation;

/// Largest number of interval lengths with a stored step; if a trace has more, the step is computed for each interval.
const MAX_LENGTHS: usize = 64;

/// A motion, laid out in blocks.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    /// Number of samples.
    pub count: usize,
    /// Whether the first values have acted for long, so that they are no change.
    pub starts_still: bool,
    /// Components of the excitation that are not zero throughout.
    pub components: Vec<usize>,
    /// Values of these components at the samples, and changes from the sample before, sample by sample. The last block is filled with the
    /// last value.
    pub values: Vec<f64>,
    pub changes: Vec<f64>,
    /// Smallest and largest value of each component from the sample before each block to its last one.
    ranges: Vec<[f64; 2]>,
    /// Time from the sample before, s.
    pub intervals: Vec<f64>,
    /// How far values may bow away from the chords of the intervals.
    pub bows: Bows,
    /// Recurring lengths, and which of them each interval has; none if there are too many.
    pub lengths: Vec<f64>,
    pub kinds: Option<Vec<u32>>,
    /// Of each block: the kind of all of its intervals, if they have the same, and the longest, s.
    same: Vec<Option<u32>>,
    longest: Vec<f64>,
    /// Weights of the samples in time, zero past the last one.
    pub time: Vec<f64>,
    /// Duration, s.
    pub duration: f64,
}

impl Timeline {
    /// The timeline of an excitation. `quasi_static`: whether the first values have acted for long. `drawn`: whether each scene has a
    /// deviation of the first component of its own. `time`: weights of its samples in time.
    pub(super) fn new(excitation: &Excitation, quasi_static: bool, drawn: bool, time: &[f64]) -> Self {
        let count = excitation.count();
        let peak = excitation.peak();
        let is_there = |&component: &usize| peak[component] > 0.0 || (drawn && component == 0);
        let components: Vec<usize> = (0..9).filter(is_there).collect();
        let whole = count.next_multiple_of(BLOCK);
        let (values, mut changes) = values_and_changes(excitation, &components, whole);
        if quasi_static {
            changes[..components.len()].fill(0.0);
        }
        let ranges = ranges(&values, components.len());
        let mut intervals = vec![0.0; whole];
        for k in 1..count {
            intervals[k] = excitation.interval(k - 1);
        }
        let bows = Bows::new(&intervals, &values, components.len());
        let (lengths, kinds) = recurring_lengths(&intervals);
        let same = same_kinds(kinds.as_deref(), count);
        let longest =
            intervals.chunks(BLOCK).map(|block| block.iter().copied().fold(0.0, f64::max)).collect();
        let mut time = time.to_vec();
        time.resize(whole, 0.0);
        let duration = excitation.duration();
        let starts_still = quasi_static;
        Self {
            count,
            starts_still,
            components,
            values,
            changes,
            ranges,
            intervals,
            bows,
            lengths,
            kinds,
            same,
            longest,
            time,
            duration,
        }
    }

    /// Number of blocks of [`BLOCK`] samples, the last one filled up.
    pub(super) fn blocks(&self) -> usize {
        self.count.div_ceil(BLOCK)
    }

    /// The longest interval that ends in a block, s.
    pub(super) fn longest(&self, block: usize) -> f64 {
        self.longest[block]
    }

    /// Smallest and largest value of each component from the sample before a block to its last one.
    pub(super) fn range(&self, block: usize) -> &[[f64; 2]] {
        &self.ranges[block * self.components.len()..][..self.components.len()]
    }

    /// The index of the length of all intervals of a block, if they have the same length.
    pub(super) fn kind(&self, block: usize) -> Option<usize> {
        self.same[block].map(|kind| kind as usize)
    }
}

/// For each block of intervals, which of the recurring lengths all of its intervals have.
fn same_kinds(kinds: Option<&[u32]>, count: usize) -> Vec<Option<u32>> {
    let Some(kinds) = kinds else { return vec![None; count.div_ceil(BLOCK)] };
    let same = |block: &[u32]| block.iter().all(|kind| *kind == block[0]).then(|| block[0]);
    kinds[..count].chunks(BLOCK).map(same).collect()
}

/// Values of the components at `whole` samples, and their changes from the sample before, sample by sample.
fn values_and_changes(excitation: &Excitation, components: &[usize], whole: usize) -> (Vec<f64>, Vec<f64>) {
    let last = excitation.count() - 1;
    let mut values = Vec::with_capacity(whole * components.len());
    let mut changes = Vec::with_capacity(whole * components.len());
    for k in 0..whole {
        let (now, before) = (usize::min(k, last), usize::min(k.saturating_sub(1), last));
        for &component in components {
            let value = excitation.component(now, component);
            values.push(value);
            // The motion begins at rest without excitation: the first value is a change.
            let from = if k == 0 { 0.0 } else { excitation.component(before, component) };
            changes.push(value - from);
        }
    }
    (values, changes)
}

/// Smallest and largest value of each of `count` components from the sample before each block to its last one.
fn ranges(values: &[f64], count: usize) -> Vec<[f64; 2]> {
    let mut ranges = Vec::with_capacity(values.len() / BLOCK);
    let size = usize::max(BLOCK * count, 1);
    for start in (0..values.len()).step_by(size) {
        let block = &values[start.saturating_sub(count)..start + size];
        for component in 0..count {
            let of = block[component..].iter().step_by(count);
            ranges.push(of.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], &value| {
                [f64::min(least, value), f64::max(most, value)]
            }));
        }
    }
    ranges
}

/// The different lengths of the intervals, and which of them each interval has; none if there are more than [`MAX_LENGTHS`].
fn recurring_lengths(intervals: &[f64]) -> (Vec<f64>, Option<Vec<u32>>) {
    let mut lengths: Vec<f64> = Vec::new();
    let mut kinds = Vec::with_capacity(intervals.len());
    for &interval in intervals {
        match lengths.iter().rposition(|&length| length == interval) {
            Some(kind) => kinds.push(kind as u32),
            None if lengths.len() < MAX_LENGTHS => {
                kinds.push(lengths.len() as u32);
                lengths.push(interval);
            }
            None => return (Vec::new(), None),
        }
    }
    (lengths, Some(kinds))
}
