//! Powers of non-negative numbers, eight at a time.

use core::f64::consts::{LN_2, LOG2_E};

use super::float::fma;
use super::simd::{LANES, Lanes};

/// An exponent p, and whether it is a whole number.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Power {
    exponent: f64,
    whole: Option<u32>,
}

impl Power {
    pub(crate) fn new(exponent: f64) -> Self {
        let whole = (1..=16).find(|&whole| f64::from(whole) == exponent);
        Self { exponent, whole }
    }

    /// `x^p` of eight non-negative numbers.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn of(&self, loads: &Lanes) -> Lanes {
        let Some(whole) = self.whole else {
            return if self.exponent == TEN_THIRDS { ten_thirds(loads) } else { power(loads, self.exponent) };
        };
        let mut raised = *loads;
        for _ in 1..whole {
            for i in 0..LANES {
                raised[i] *= loads[i];
            }
        }
        raised
    }
}

/// Bits of √½, mask of the mantissa, and bits of 1, whose exponent counts as zero.
const ROOT_HALF: u64 = 0x3FE6_A09E_667F_3BCD;
const MANTISSA: u64 = (1 << 52) - 1;
const ONE: u64 = 0x3FF0_0000_0000_0000;

/// 1.5 2^52 and 2^52: adding a whole number to one of them puts that number into its last bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;
const WHOLE_FROM_ZERO: f64 = 4_503_599_627_370_496.0;

/// 1 / (2 k + 1) and 1 / k!, the coefficients of artanh and exp.
const ARTANH: [f64; 12] = {
    let mut series = [0.0; 12];
    let mut k = 0;
    while k < 12 {
        series[k] = 1.0 / (2 * k + 1) as f64;
        k += 1;
    }
    series
};
const EXP: [f64; 15] = {
    let mut series = [1.0; 15];
    let mut k = 1;
    while k < 15 {
        series[k] = series[k - 1] / k as f64;
        k += 1;
    }
    series
};

/// A polynomial at eight numbers (Horner).
#[cfg_attr(feature = "std", inline(always))]
fn polynomial(coefficients: &[f64], at: &Lanes) -> Lanes {
    let mut sum = [0.0; LANES];
    for coefficient in coefficients.iter().rev() {
        for i in 0..LANES {
            sum[i] = fma(sum[i], at[i], *coefficient);
        }
    }
    sum
}

/// `x^p` for x >= 0, with an error of a few roundings times p; without branches, for vectors.
#[cfg_attr(feature = "std", inline(always))]
fn power(x: &Lanes, p: f64) -> Lanes {
    // x = 2^e m with m from √½ to √2, and ln m = 2 artanh s with s = (m - 1) / (m + 1).
    let (mut e, mut s, mut squares) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let shifted = x[i].to_bits().wrapping_add(ONE - ROOT_HALF);
        e[i] = f64::from_bits((shifted >> 52) | WHOLE_FROM_ZERO.to_bits()) - (WHOLE_FROM_ZERO + 1023.0);
        let m = f64::from_bits((shifted & MANTISSA) + ROOT_HALF);
        s[i] = (m - 1.0) / (m + 1.0);
        squares[i] = s[i] * s[i];
    }
    let artanh = polynomial(&ARTANH, &squares);
    // x^p = 2^whole e^rest
    let (mut whole, mut rest) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let l = p * (2.0 * LOG2_E * s[i] * artanh[i]);
        let both = fma(p, e[i], l);
        let low = if both > -2000.0 { both } else { -2000.0 };
        whole[i] = if low < 2046.0 { low } else { 2046.0 } + WHOLE - WHOLE;
        rest[i] = LN_2 * (fma(p, e[i], -whole[i]) + l);
    }
    let mut out = polynomial(&EXP, &rest);
    for i in 0..LANES {
        // In two factors, so that neither overflows before the product does.
        let half = 0.5 * whole[i] + WHOLE - WHOLE;
        let product = out[i] * two_to(half) * two_to(whole[i] - half);
        out[i] = if x[i] > 0.0 { product } else { 0.0 };
    }
    out
}

/// The exponent of roller bearings, which has a shorter way.
const TEN_THIRDS: f64 = 10.0 / 3.0;

/// High half of the bits of `x^(-1/3)` plus a third of that of x, nearly the same for all x: the root is then right to 4 %.
const INVERSE_ROOT: f64 = 1_430_187_599.0;

/// `x^(10/3)` for x >= 0, with an error of a few roundings; without branches, for vectors.
#[cfg_attr(feature = "std", inline(always))]
fn ten_thirds(x: &Lanes) -> Lanes {
    let mut out = [0.0; LANES];
    for i in 0..LANES {
        let high = f64::from_bits((x[i].to_bits() >> 32) | WHOLE_FROM_ZERO.to_bits()) - WHOLE_FROM_ZERO;
        let y = f64::from_bits((INVERSE_ROOT - high * (1.0 / 3.0) + WHOLE_FROM_ZERO).to_bits() << 32);
        // With e = 1 - x y³, x^(-1/3) is y (1 - e)^(-1/3), whose series leaves 1e-6, then 1e-17.
        let e = fma(-(y * x[i]), y * y, 1.0);
        let series = fma(e, fma(e, fma(e, 35.0 / 243.0, 14.0 / 81.0), 2.0 / 9.0), 1.0 / 3.0);
        let y = fma(y * e, series, y);
        let e = fma(-(y * x[i]), y * y, 1.0);
        let y = fma(y * e, fma(e, 2.0 / 9.0, 1.0 / 3.0), y);
        let root = x[i] * x[i] * y;
        out[i] = root * root;
    }
    out
}

/// `2^k` for a whole number k.
#[cfg_attr(feature = "std", inline(always))]
fn two_to(k: f64) -> f64 {
    f64::from_bits((k + (WHOLE + 1023.0)).to_bits() << 52)
}

#[cfg(test)]
mod tests {
    use super::super::float::pow;
    use super::{LANES, Power, power};

    #[test]
    fn powers_are_those_of_the_library() {
        for p in [1.0, 10.0 / 3.0, 2.5, 9.0] {
            for k in -60..60 {
                let x = 1.37_f64.powi(k) * 1000.0;
                let want = pow(x, p);
                let got = power(&[x; LANES], p)[0];
                assert!((got - want).abs() <= 1e-14 * want, "{x}^{p}: {got} {want}");
            }
        }
        for k in -600..600 {
            let x = 1.37_f64.powi(k);
            let (want, got) = (pow(x, 10.0 / 3.0), Power::new(10.0 / 3.0).of(&[x; LANES])[4]);
            // The library raises to 10/3 rounded to a binary number.
            let rounding = 2e-15 + 1.5e-16 * x.ln().abs();
            assert!((got - want).abs() <= rounding * want + f64::MIN_POSITIVE, "{x}^(10/3): {got} {want}");
        }
        for (x, want) in [(0.0, 0.0), (1e-310, 0.0), (1e-200, 0.0), (1e200, f64::INFINITY)] {
            assert_eq!(Power::new(10.0 / 3.0).of(&[x; LANES])[1], want);
        }
        // Zero, underflow, overflow.
        assert_eq!(power(&[0.0; LANES], 2.5)[3], 0.0);
        assert_eq!(power(&[1e-300; LANES], 3.0)[5], 0.0);
        assert_eq!(power(&[1e300; LANES], 3.0)[7], f64::INFINITY);
    }
}
