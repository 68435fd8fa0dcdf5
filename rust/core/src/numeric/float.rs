//! The one place where `std` ends: elementary functions that `core` lacks.
//!
//! With `std` all compute the same bits on every platform: `sqrt` and `fma` are correctly rounded, the others come from `libm`.

#[cfg(feature = "std")]
pub(crate) use libm::log;
pub(crate) use libm::{atanh, ceil, copysign, cos, exp, expm1, floor, hypot, log1p, pow, sin, sinh};

/// Square root. (With `std` not that of `libm`, which is assembly and would stop vectorisation.)
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn sqrt(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.sqrt();
    #[cfg(not(feature = "std"))]
    return libm::sqrt(x);
}

/// `a * b + c`.
///
/// With `std` it is fused, that is rounded once, on every processor; one without such an instruction is slower but computes the same
/// bits. Without `std` it is two operations, as most processors there have no fused one.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn fma(a: f64, b: f64, c: f64) -> f64 {
    #[cfg(feature = "std")]
    return a.mul_add(b, c);
    #[cfg(not(feature = "std"))]
    return a * b + c;
}

/// Sum of the products of the entries of two vectors.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Euclidean norm.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn norm(vector: &[f64]) -> f64 {
    sqrt(dot(vector, vector))
}

/// Adds `factor * column` to `sum`.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn add_scaled<const N: usize>(sum: &mut [f64; N], column: &[f64; N], factor: f64) {
    for i in 0..N {
        sum[i] = fma(column[i], factor, sum[i]);
    }
}

/// Adds a matrix, by columns, times a vector to `sum`.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn add_columns<const N: usize>(sum: &mut [f64; N], columns: &[[f64; N]], vector: &[f64]) {
    for (column, &factor) in columns.iter().zip(vector) {
        add_scaled(sum, column, factor);
    }
}

/// A matrix, by columns, times a vector.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn times<const N: usize>(columns: &[[f64; N]], vector: &[f64]) -> [f64; N] {
    let mut sum = [0.0; N];
    add_columns(&mut sum, columns, vector);
    sum
}

/// Multiplies a column by a factor.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn scale<const N: usize>(column: &mut [f64; N], factor: f64) {
    for entry in column {
        *entry *= factor;
    }
}
