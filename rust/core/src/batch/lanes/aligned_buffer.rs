//! Aligned buffer: vectors of any width in plain memory, so that one function can read with one width what another wrote with another.

use pulp::Simd;

/// Numbers that begin at a cache line, so that no load of the widest vectors crosses two lines.
#[derive(Debug, Default)]
pub(super) struct AlignedBuffer {
    numbers: Vec<f64>,
    start: usize,
    count: usize,
}

const LINE: usize = 64;

impl AlignedBuffer {
    /// Sets the buffer to `count` vectors of zeros.
    #[inline(always)]
    pub(super) fn clear<S: Simd>(&mut self, count: usize) -> &mut [S::f64s] {
        self.count = count * S::F64_LANES;
        self.numbers.clear();
        self.numbers.resize(self.count + LINE / size_of::<f64>(), 0.0);
        self.start = self.numbers.as_ptr().align_offset(LINE);
        self.vectors_mut::<S>()
    }

    /// The vectors.
    #[inline(always)]
    pub(super) fn vectors<S: Simd>(&self) -> &[S::f64s] {
        S::as_simd_f64s(&self.numbers[self.start..self.start + self.count]).0
    }

    /// The vectors, mutable.
    #[inline(always)]
    pub(super) fn vectors_mut<S: Simd>(&mut self) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(&mut self.numbers[self.start..self.start + self.count]).0
    }

    /// One number: a lane of a vector, where vectors have `lanes`.
    pub(super) fn lane(&self, vector: usize, lane: usize, lanes: usize) -> f64 {
        self.numbers[self.start + vector * lanes + lane]
    }

    /// The same, mutable.
    pub(super) fn lane_mut(&mut self, vector: usize, lane: usize, lanes: usize) -> &mut f64 {
        &mut self.numbers[self.start + vector * lanes + lane]
    }
}
