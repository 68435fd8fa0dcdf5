//! Loops compiled for the widest vectors of the processor at hand, chosen when they run.
//!
//! AVX2 is as wide as a state of twelve numbers needs: AVX-512 was measured slower here, up to 1.6 times in the step methods.
//! Every width performs the same operations in the same order on every number, so the results are the same bits.

/// A loop. What it calls must be `#[cfg_attr(feature = "std", inline(always))]`, or it is compiled for the oldest processor; closures are too.
/// (Without `std` there is one processor and nothing to choose, and inlining everything makes programs three times as large.)
pub(crate) trait Kernel {
    /// What it returns.
    type Output;

    /// The loop itself, `#[cfg_attr(feature = "std", inline(always))]`.
    fn run(self) -> Self::Output;
}

/// Runs a kernel.
#[inline]
pub(crate) fn widest<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(all(feature = "std", target_arch = "x86_64"))]
    {
        use std::arch::is_x86_feature_detected as has;

        #[target_feature(enable = "avx2,fma")]
        fn avx2<K: Kernel>(kernel: K) -> K::Output {
            kernel.run()
        }

        if has!("avx2") && has!("fma") {
            // SAFETY: the processor has just been asked for both.
            return unsafe { avx2(kernel) };
        }
    }
    kernel.run()
}

/// Runs a kernel of long loops over numbers side by side, for which twice as wide vectors pay.
#[cfg(feature = "std")]
#[inline]
pub(crate) fn widest_of_all<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;

        #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
        fn avx512<K: Kernel>(kernel: K) -> K::Output {
            kernel.run()
        }

        if has!("avx512f") && has!("avx512dq") && has!("avx512vl") && has!("fma") {
            // SAFETY: the processor has just been asked for all of them; those with AVX-512 have AVX2.
            return unsafe { avx512(kernel) };
        }
    }
    widest(kernel)
}
