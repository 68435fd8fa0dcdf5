//! The motion of each scene where it is drawn: the first component of the excitation in a block, one scene in each lane.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::timeline::{BLOCK, Timeline};
use super::vector::{Number, Real};
use crate::numeric::simd::{Aligned, Lanes};

/// Deviations of the first component of the excitation at all samples of the motion.
#[derive(Debug, Clone, Copy)]
pub(in crate::batch) struct Deviations<'a> {
    rows: &'a [Aligned<Lanes>],
    /// Place in a row of the deviation of the first scene.
    offset: usize,
}

impl<'a> Deviations<'a> {
    /// `offset`: place in a row of the deviation of the first scene; those of the others follow.
    pub(in crate::batch) fn new(rows: &'a [Aligned<Lanes>], offset: usize) -> Self {
        Self { rows, offset }
    }

    /// Those from a sample on.
    pub(super) fn from(self, first: usize) -> Self {
        Self { rows: &self.rows[first..], ..self }
    }

    /// At a sample.
    #[inline(always)]
    pub(super) fn at<S: Simd>(self, simd: S, sample: usize) -> Real<S> {
        Real::new(simd, S::as_simd_f64s(&self.rows[sample].0[self.offset..]).0[0])
    }
}

/// Places of a drawn block: the values at its samples, their changes, the last value before it, the smallest and largest of all these, and the
/// largest changes of its rate with the factors of [`super::bows::Bow::kink`].
pub(super) const VALUES: usize = 0;
pub(super) const CHANGES: usize = BLOCK;
pub(super) const BEFORE: usize = 2 * BLOCK;
const RANGE: usize = BEFORE + 1;
const KINK: usize = RANGE + 2;
pub(super) const SIZE: usize = KINK + 2;

/// Writes the first component of the excitation of each scene in a block.
#[inline(always)]
pub(super) fn set_block<S: Simd>(
    simd: S,
    deviations: Deviations,
    timeline: &Timeline,
    block: usize,
    to: &mut AlignedBuffer,
) {
    let Some(to) = to.vectors_mut::<S>().first_chunk_mut::<SIZE>() else { return };
    let mut before = Real::new(simd, to[VALUES + BLOCK - 1]);
    to[BEFORE] = before.lanes;
    let (mut least, mut most) = (before, before);
    for k in 0..BLOCK {
        let sample = block * BLOCK + k;
        let value = value(simd, timeline, deviations, sample);
        if sample == 0 && timeline.starts_still {
            before = value;
        }
        (least, most) = if sample == 0 { (value, value) } else { (least.min(value), most.max(value)) };
        (to[VALUES + k], to[CHANGES + k]) = (value.lanes, (value - before).lanes);
        before = value;
    }
    (to[RANGE], to[RANGE + 1]) = (least.lanes, most.lanes);
    let first = (block * BLOCK).saturating_sub(1);
    let mut rate_before = rate(simd, timeline, deviations, first);
    let mut kinks = [Real::splat(simd, 0.0); 2];
    for k in first..(block + 1) * BLOCK {
        let next = rate(simd, timeline, deviations, k + 1);
        let change = (next - rate_before).abs();
        for i in 0..2 {
            kinks[i] = kinks[i].max(change * Real::splat(simd, timeline.bows.at(k).kink[i]));
        }
        rate_before = next;
    }
    (to[KINK], to[KINK + 1]) = (kinks[0].lanes, kinks[1].lanes);
}

/// The value at a sample; past the end, the last one.
#[inline(always)]
fn value<S: Simd>(simd: S, timeline: &Timeline, deviations: Deviations, sample: usize) -> Real<S> {
    let sample = usize::min(sample, timeline.count - 1);
    let estimate = Real::splat(simd, timeline.values[sample * timeline.components.len()]);
    estimate + deviations.at(simd, sample)
}

/// The rate in the interval before a sample, 1/s; zero if it has no length.
#[inline(always)]
fn rate<S: Simd>(simd: S, timeline: &Timeline, deviations: Deviations, sample: usize) -> Real<S> {
    let length = timeline.intervals.get(sample).copied().unwrap_or(0.0);
    if length == 0.0 {
        return Real::splat(simd, 0.0);
    }
    let [last, now] =
        [value(simd, timeline, deviations, sample - 1), value(simd, timeline, deviations, sample)];
    (now - last) / Real::splat(simd, length)
}

/// Largest changes of the rate in a drawn block, with the factors of [`super::bows::Bow::kink`].
#[inline(always)]
pub(super) fn kinks<S: Simd>(simd: S, block: &AlignedBuffer) -> [Real<S>; 2] {
    let block = block.vectors::<S>();
    [Real::new(simd, block[KINK]), Real::new(simd, block[KINK + 1])]
}

/// Smallest and largest value from the sample before a drawn block to its last one.
#[inline(always)]
pub(super) fn range<S: Simd>(simd: S, block: &AlignedBuffer) -> [Real<S>; 2] {
    let block = block.vectors::<S>();
    [Real::new(simd, block[RANGE]), Real::new(simd, block[RANGE + 1])]
}
