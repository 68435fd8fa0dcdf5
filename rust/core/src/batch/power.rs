//! Powers of loads, many at a time.

use core::f64::consts::{LN_2, LOG2_E};

use super::rows::BLOCK;
use crate::float::{fma, pow};

/// An exponent p, and how loads are raised to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Power {
    exponent: f64,
    whole: Option<u32>,
}

impl Power {
    pub(super) fn new(exponent: f64) -> Self {
        let whole = (1..=16).find(|&whole| f64::from(whole) == exponent);
        Self { exponent, whole }
    }

    /// Thirds in the exponent, if they are a whole number of them, as for balls and rollers.
    pub(super) fn thirds(&self) -> Option<u32> {
        [9, 10].into_iter().find(|&thirds| f64::from(thirds) == 3.0 * self.exponent)
    }

    /// `x^p` of one load.
    pub(super) fn of(&self, load: f64) -> f64 {
        power(load, self.exponent)
    }

    /// `x^p` of loads that are not negative.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn raise(&self, loads: &mut [f64; BLOCK]) {
        if let Some(whole) = self.whole {
            let factors = *loads;
            for _ in 1..whole {
                for i in 0..BLOCK {
                    loads[i] *= factors[i];
                }
            }
        } else {
            for load in loads.iter_mut() {
                *load = power(*load, self.exponent);
            }
        }
    }

    /// `x^(1/p)`.
    pub(super) fn root(&self, sum: f64) -> f64 {
        pow(sum, 1.0 / self.exponent)
    }
}

/// Bits of √½, those of a mantissa, and what makes exponents count from zero.
const ROOT_HALF: u64 = 0x3FE6_A09E_667F_3BCD;
const MANTISSA: u64 = (1 << 52) - 1;
const ONE: u64 = 0x3FF0_0000_0000_0000;

/// A number beside which whole numbers stand in the last bits, and another that counts from zero.
const WHOLE: f64 = 6_755_399_441_055_744.0;
const WHOLE_FROM_ZERO: f64 = 4_503_599_627_370_496.0;

/// `x^p` for x >= 0, right to some roundings times p: without branches, so that many are worked out side by side.
#[cfg_attr(feature = "std", inline(always))]
fn power(x: f64, p: f64) -> f64 {
    // x = 2^e m with m from √½ to √2, and ln m = 2 artanh s with s = (m - 1) / (m + 1).
    let shifted = x.to_bits().wrapping_add(ONE - ROOT_HALF);
    let e = f64::from_bits((shifted >> 52) | WHOLE_FROM_ZERO.to_bits()) - (WHOLE_FROM_ZERO + 1023.0);
    let m = f64::from_bits((shifted & MANTISSA) + ROOT_HALF);
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let mut series = 1.0 / 23.0;
    for k in (0..11).rev() {
        series = fma(series, z, 1.0 / f64::from(2 * k + 1));
    }
    let l = 2.0 * LOG2_E * s * series;
    // x^p = 2^(whole + rest)
    let power_of_two = fma(p, e, p * l);
    let whole = power_of_two.clamp(-2000.0, 2046.0) + WHOLE - WHOLE;
    let rest = LN_2 * (fma(p, e, -whole) + p * l);
    let mut sum = 1.0;
    for k in (1..=14).rev() {
        sum = fma(sum * rest, 1.0 / f64::from(k), 1.0);
    }
    // In two factors, so that neither leaves the range before the product does.
    let half = 0.5 * whole + WHOLE - WHOLE;
    let power = sum * two_to(half) * two_to(whole - half);
    if x > 0.0 { power } else { 0.0 }
}

/// `2^k` of a whole number.
#[cfg_attr(feature = "std", inline(always))]
fn two_to(k: f64) -> f64 {
    f64::from_bits((k + (WHOLE + 1023.0)).to_bits() << 52)
}

#[cfg(test)]
mod tests {
    use super::{pow, power};

    #[test]
    fn powers_are_those_of_the_library() {
        for p in [1.0, 10.0 / 3.0, 2.5, 9.0] {
            for k in -60..60 {
                let x = 1.37_f64.powi(k) * 1000.0;
                let want = pow(x, p);
                assert!((power(x, p) - want).abs() <= 1e-14 * want, "{x}^{p}: {} {want}", power(x, p));
            }
            assert_eq!(power(0.0, p), 0.0);
        }
        assert_eq!(power(1e-300, 3.0), 0.0);
        assert_eq!(power(1e300, 3.0), f64::INFINITY);
    }
}
