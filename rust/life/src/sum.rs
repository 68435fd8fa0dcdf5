//! Exact addition.

use crate::rows::Number;

/// The sum of two numbers as rounded, and what rounding takes from it (Knuth).
#[inline(always)]
pub fn two_sum<N: Number>(a: N, b: N) -> [N; 2] {
    let sum = a + b;
    let of_b = sum - a;
    [sum, (a - (sum - of_b)) + (b - of_b)]
}
