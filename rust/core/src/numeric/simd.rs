//! Vector loops: one source, compiled for several instruction sets and chosen when the program runs.
//!
//! There are two tools, for two kinds of loops:
//!
//! - [`dispatch`], here: loops over plain `[f64; LANES]` arrays, which the compiler turns into vector code. Used wherever the numbers of *one*
//!   run lie side by side (entries of a state, links, quantities, draws). AVX2 is as wide as a state of twelve numbers needs: AVX-512 was
//!   measured slower there, up to 1.6 times in the step methods. [`dispatch_wide`] is for long loops and longer columns, where AVX-512 pays.
//! - the crate `pulp`, in `batch::lanes` and `side_by_side`: *one scene per lane*, with the number of lanes as a type. Used where the algorithm itself is
//!   written in vectors and masks (Jacobi rotations, whose number of sweeps differs between lanes); no compiler vectorises it by itself.
//!
//! Code for instructions that not every processor has is the only `unsafe` code of the core.
//!
//! Both perform the same operations in the same order on every number, so results have the same bits at any width.
#![allow(unsafe_code)]

/// Numbers per array in vector loops: two AVX2 registers, or one of AVX-512.
pub(crate) const LANES: usize = 8;

/// Most lanes of the vectors of any processor, with `pulp`.
pub(crate) const MAX_LANES: usize = 8;

/// Number of lanes of the vectors, with `pulp`.
#[cfg(feature = "studies")]
pub(crate) struct LaneCount;

#[cfg(feature = "studies")]
impl pulp::WithSimd for LaneCount {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

/// Runs a kernel with the widest vectors of the processor. As in [`dispatch`], x86-64 processors without AVX2 need the feature `any-processor`.
#[cfg(feature = "studies")]
pub(crate) fn on_widest<Op: pulp::WithSimd>(op: Op) -> Op::Output {
    #[cfg(target_arch = "x86_64")]
    if !HAS_FALLBACK {
        use pulp::{Simd, x86};

        if let Some(simd) = x86::V4::try_new() {
            return Simd::vectorize(simd, op);
        }
        if let Some(simd) = x86::V3::try_new() {
            return Simd::vectorize(simd, op);
        }
        without_avx2();
    }
    pulp::Arch::new().dispatch(op)
}

/// One number in each lane.
pub(crate) type Lanes = [f64; LANES];

/// Aligned to cache lines: no vector lies across two of them. Across two, drawing normal numbers takes up to 1.4 times as long.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Aligned<T>(pub T);

/// Evaluates a call with AVX2 and FMA where the processor has them. What is called, and everything that it calls, must be
/// `#[cfg_attr(feature = "std", inline(always))]`, closures included: a function that is not inlined is compiled for the oldest processor.
/// For processors without AVX2 everything is compiled a second time, with the feature `any-processor` alone: there every fused multiplication
/// and addition is a call, so that this code is larger than that with AVX2, and a fifth of the time of a build.
/// (Without `std` there is one instruction set, and inlining everything makes programs three times as large.)
macro_rules! dispatch {
    ($call:expr) => {
        $crate::numeric::simd::on_avx2(
            #[cfg_attr(feature = "std", inline(always))]
            || $call,
        )
    };
}

/// [`dispatch`] of a call that consumes what it captures.
macro_rules! dispatch_once {
    ($call:expr) => {
        $crate::numeric::simd::on_avx2_once(
            #[cfg_attr(feature = "std", inline(always))]
            || $call,
        )
    };
}

/// Evaluates a call with AVX-512 where the processor has it, otherwise as [`dispatch`].
macro_rules! dispatch_wide {
    ($call:expr) => {
        $crate::numeric::simd::on_avx512(
            #[cfg_attr(feature = "std", inline(always))]
            || $call,
        )
    };
}

pub(crate) use {dispatch, dispatch_once, dispatch_wide};

/// See [`dispatch`]. `FnMut`: called by `FnOnce`, a closure is wrapped in a function that is not inlined.
#[inline]
pub(crate) fn on_avx2<T>(mut call: impl FnMut() -> T) -> T {
    #[cfg(all(feature = "std", target_arch = "x86_64"))]
    {
        #[target_feature(enable = "avx2,fma")]
        fn avx2<T>(mut call: impl FnMut() -> T) -> T {
            call()
        }

        if has_avx2() {
            // SAFETY: the processor has just been asked for both.
            return unsafe { avx2(call) };
        }
    }
    if !HAS_FALLBACK {
        without_avx2();
    }
    call()
}

/// See [`dispatch_once`].
#[inline]
pub(crate) fn on_avx2_once<T>(call: impl FnOnce() -> T) -> T {
    #[cfg(all(feature = "std", target_arch = "x86_64"))]
    {
        #[target_feature(enable = "avx2,fma")]
        fn avx2<T>(call: impl FnOnce() -> T) -> T {
            call()
        }

        if has_avx2() {
            // SAFETY: the processor has just been asked for both.
            return unsafe { avx2(call) };
        }
    }
    if !HAS_FALLBACK {
        without_avx2();
    }
    call()
}

/// See [`dispatch_wide`].
#[inline]
pub(crate) fn on_avx512<T>(call: impl FnMut() -> T) -> T {
    #[cfg(all(feature = "std", target_arch = "x86_64"))]
    {
        use std::arch::is_x86_feature_detected as has;

        #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
        fn avx512<T>(mut call: impl FnMut() -> T) -> T {
            call()
        }

        let has_avx512 = has!("avx512f") && has!("avx512dq") && has!("avx512vl");
        if has_avx512 && has_avx2() {
            // SAFETY: the processor has just been asked for all of them.
            return unsafe { avx512(call) };
        }
    }
    on_avx2(call)
}

/// Whether code without AVX2 is compiled. Decided at compile time: where it is not, what follows is no part of the program.
const HAS_FALLBACK: bool =
    cfg!(any(not(feature = "std"), not(target_arch = "x86_64"), feature = "any-processor"));

/// Whether the processor has AVX2 and FMA.
#[inline]
fn has_avx2() -> bool {
    #[cfg(all(feature = "std", target_arch = "x86_64"))]
    return std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(all(feature = "std", target_arch = "x86_64")))]
    false
}

#[cold]
fn without_avx2() -> ! {
    panic!("guideload was built without the feature `any-processor`, and this processor has no AVX2 and FMA")
}

/// Whether this build runs on this processor: without the feature `any-processor`, x86-64 processors need AVX2 and FMA. Where it does not, each
/// run panics.
pub fn runs_on_this_processor() -> bool {
    HAS_FALLBACK || has_avx2()
}
