//! Many samples in one call, on a PC: the steps of [`Monitor::push_wide`], compiled for the vector instructions of the processor as well. The
//! operations and their order are the same, and so are the bits of the results.
#![allow(unsafe_code)] // for instructions that not every processor has

use core::ops::ControlFlow;

use crate::input::Sample;
use crate::monitor::Monitor;
use crate::prepared::Prepared;
use guideload_life::Real;

impl<T: Real, const S: usize, const C: usize, const N: usize> Monitor<T, S, C, N> {
    /// Takes pairs of time stamp and counter one after the other, as `push_wide` does, and calls `after` after each; ends early if it breaks.
    pub fn push_many(
        &mut self,
        prepared: &Prepared<T, S, C, N>,
        samples: impl IntoIterator<Item = (i64, u32)>,
        after: impl FnMut(&Self, Sample) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just been asked for AVX2.
            return unsafe { self.push_with_avx2(prepared, samples, after) };
        }
        self.push_each(prepared, samples, after)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn push_with_avx2(
        &mut self,
        prepared: &Prepared<T, S, C, N>,
        samples: impl IntoIterator<Item = (i64, u32)>,
        after: impl FnMut(&Self, Sample) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.push_each(prepared, samples, after)
    }

    #[inline(always)]
    fn push_each(
        &mut self,
        prepared: &Prepared<T, S, C, N>,
        samples: impl IntoIterator<Item = (i64, u32)>,
        mut after: impl FnMut(&Self, Sample) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        for (stamp, count) in samples {
            let taken = self.push_wide(prepared, stamp, count);
            after(self, taken)?;
        }
        ControlFlow::Continue(())
    }
}
