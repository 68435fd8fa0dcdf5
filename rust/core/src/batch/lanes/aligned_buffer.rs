//! Memory for vectors of any width, so that one kernel can leave what another takes up.

use pulp::Simd;

/// Numbers that begin at a cache line, which a load of the widest vector must not straddle.
#[derive(Debug, Default)]
pub(super) struct AlignedBuffer {
    numbers: Vec<f64>,
    start: usize,
    count: usize,
}

const LINE: usize = 64;

impl AlignedBuffer {
    /// Zeros for `count` vectors.
    #[inline(always)]
    pub(super) fn clear<S: Simd>(&mut self, count: usize) -> &mut [S::f64s] {
        self.count = count * S::F64_LANES;
        self.numbers.clear();
        self.numbers.resize(self.count + LINE / size_of::<f64>(), 0.0);
        self.start = self.numbers.as_ptr().align_offset(LINE);
        self.vectors_mut::<S>()
    }

    /// What is there.
    #[inline(always)]
    pub(super) fn vectors<S: Simd>(&self) -> &[S::f64s] {
        S::as_simd_f64s(&self.numbers[self.start..self.start + self.count]).0
    }

    /// What is there, to be changed.
    #[inline(always)]
    pub(super) fn vectors_mut<S: Simd>(&mut self) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(&mut self.numbers[self.start..self.start + self.count]).0
    }

    /// The number of a lane of a vector, where vectors hold `lanes`.
    pub(super) fn lane(&self, vector: usize, lane: usize, lanes: usize) -> f64 {
        self.numbers[self.start + vector * lanes + lane]
    }
}
