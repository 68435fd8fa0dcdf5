//! The motion of each scene where it is drawn: the first component of the excitation in a block, one scene in each lane.

use pulp::{Simd, WithSimd};

use super::aligned_buffer::AlignedBuffer;
use super::timeline::{BLOCK, Timeline};
use super::vector::Real;
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

/// Places of a drawn block: the values at its samples, their changes, the last value before it, and the smallest and largest value.
pub(super) const VALUES: usize = 0;
pub(super) const CHANGES: usize = BLOCK;
const BEFORE: usize = 2 * BLOCK;
const RANGE: usize = BEFORE + 1;
pub(super) const SIZE: usize = RANGE + 2;

/// Writes the first component of the excitation of each scene in a block.
pub(super) struct DrawnBlock<'a> {
    pub deviations: Deviations<'a>,
    pub timeline: &'a Timeline,
    pub block: usize,
    pub to: &'a mut AlignedBuffer,
}

impl WithSimd for DrawnBlock<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { deviations, timeline, block, to } = self;
        let Some(to) = to.vectors_mut::<S>().first_chunk_mut::<SIZE>() else { return };
        let components = timeline.components.len();
        let mut before = Real::new(simd, to[BEFORE]);
        let (mut least, mut most) = (before, before);
        for k in 0..BLOCK {
            let sample = block * BLOCK + k;
            let estimate = Real::splat(simd, timeline.values[sample * components]);
            // Past the end, the last value is repeated.
            let value = estimate + deviations.at(simd, usize::min(sample, timeline.count - 1));
            if sample == 0 && timeline.starts_still {
                before = value;
            }
            (least, most) = if k == 0 { (value, value) } else { (least.min(value), most.max(value)) };
            (to[VALUES + k], to[CHANGES + k]) = (value.lanes, (value - before).lanes);
            before = value;
        }
        to[BEFORE] = before.lanes;
        (to[RANGE], to[RANGE + 1]) = (least.lanes, most.lanes);
    }
}

/// Smallest and largest value of a drawn block.
#[inline(always)]
pub(super) fn range<S: Simd>(simd: S, block: &AlignedBuffer) -> [Real<S>; 2] {
    let block = block.vectors::<S>();
    [Real::new(simd, block[RANGE]), Real::new(simd, block[RANGE + 1])]
}
