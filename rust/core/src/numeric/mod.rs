//! Numerical functions that do not depend on the model: elementary functions, vector loops, tensors, random numbers.

pub(crate) mod bounded_vec;
pub(crate) mod float;
#[cfg(feature = "std")]
pub(crate) mod normal;
pub(crate) mod on_heap;
#[cfg(feature = "std")]
pub(crate) mod power;
pub(crate) mod simd;
pub mod tensor;
#[cfg(feature = "std")]
pub(crate) mod watch;
