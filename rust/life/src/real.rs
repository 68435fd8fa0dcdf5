//! The two kinds of numbers: f32 and f64.

use core::fmt::Debug;

use crate::rows::Number;
use core::ops::AddAssign;

/// A floating-point number. The roots are here because `core` has none; they take a fixed number of operations.
pub trait Real: Number + Debug + PartialOrd + AddAssign {
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Above all finite numbers.
    const INFINITY: Self;

    /// Below all finite numbers.
    const NEG_INFINITY: Self;

    /// The nearest number.
    fn from_f64(value: f64) -> Self;
    /// The nearest number.
    fn from_i32(value: i32) -> Self;
    /// The same number.
    fn to_f64(self) -> f64;
    /// The number without its fraction, limited to the range of i32; 0 for NaN.
    fn to_i32(self) -> i32;
    /// Square root of a number from 0 on, to a few roundings.
    fn sqrt(self) -> Self;
    /// Cube root of a number from 0 on, to a few roundings.
    fn cbrt(self) -> Self;
    /// Ninth root of a number from 0 on, to a few roundings.
    fn ninth_root(self) -> Self;
    /// Whether it is neither infinite nor NaN.
    fn is_finite(self) -> bool {
        self.abs() < Self::INFINITY
    }
    /// 1 of a negative number, 0 of a positive one.
    fn sign(self) -> u32;
}

/// Newton's iteration for a root of `x` from the estimate `root`.
fn newton_sqrt<T: Real>(x: T, mut root: T, steps: usize) -> T {
    let half = T::from_f64(0.5);
    for _ in 0..steps {
        root = half * (root + x / root);
    }
    root
}

/// Halley's iteration for the cube root of `x` from the estimate `root`.
fn halley_cbrt<T: Real>(x: T, mut root: T, steps: usize) -> T {
    for _ in 0..steps {
        let cube = root * root * root;
        root = root * ((cube + x + x) / (cube + cube + x));
    }
    root
}

/// Halley's iteration for the ninth root of `x` from the estimate `root`.
fn halley_ninth_root<T: Real>(x: T, mut root: T, steps: usize) -> T {
    let ratio = T::from_f64(0.8);
    for _ in 0..steps {
        let cube = root * root * root;
        let ninth = cube * cube * cube;
        root = root * ((ratio * ninth + x) / (ninth + ratio * x));
    }
    root
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const INFINITY: Self = Self::INFINITY;
    const NEG_INFINITY: Self = Self::NEG_INFINITY;

    fn from_f64(value: f64) -> Self {
        value as Self
    }
    fn from_i32(value: i32) -> Self {
        value as Self
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    fn to_i32(self) -> i32 {
        self as i32
    }
    fn sign(self) -> u32 {
        self.to_bits() >> 31
    }
    // Half, a third and a ninth of the exponent give estimates to 4, 5 and 3 %.
    fn sqrt(self) -> Self {
        if self < Self::MIN_POSITIVE {
            return 0.0;
        }
        newton_sqrt(self, Self::from_bits((self.to_bits() >> 1) + 0x1FBC_0000), 3)
    }
    fn cbrt(self) -> Self {
        if self < Self::MIN_POSITIVE {
            return 0.0;
        }
        halley_cbrt(self, Self::from_bits(self.to_bits() / 3 + 0x2A51_37A0), 2)
    }
    fn ninth_root(self) -> Self {
        if self < Self::MIN_POSITIVE {
            return 0.0;
        }
        halley_ninth_root(self, Self::from_bits(self.to_bits() / 9 + 0x386C_A708), 2)
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const INFINITY: Self = Self::INFINITY;
    const NEG_INFINITY: Self = Self::NEG_INFINITY;

    fn from_f64(value: f64) -> Self {
        value
    }
    fn from_i32(value: i32) -> Self {
        value.into()
    }
    fn to_f64(self) -> f64 {
        self
    }
    fn to_i32(self) -> i32 {
        self as i32
    }
    fn sign(self) -> u32 {
        (self.to_bits() >> 63) as u32
    }
    fn sqrt(self) -> Self {
        if self < Self::MIN_POSITIVE {
            return 0.0;
        }
        #[cfg(feature = "std")]
        return Self::sqrt(self);
        #[cfg(not(feature = "std"))]
        newton_sqrt(self, Self::from_bits((self.to_bits() >> 1) + 0x1FF7_8000_0000_0000), 4)
    }
    fn cbrt(self) -> Self {
        if self < Self::MIN_POSITIVE {
            return 0.0;
        }
        halley_cbrt(self, Self::from_bits(self.to_bits() / 3 + 0x2A9F_7893_0000_0000), 3)
    }
    fn ninth_root(self) -> Self {
        if self < Self::MIN_POSITIVE {
            return 0.0;
        }
        halley_ninth_root(self, Self::from_bits(self.to_bits() / 9 + 0x38D4_B152_0000_0000), 3)
    }
}

macro_rules! number {
    ($type:ty) => {
        impl Number for $type {
            #[inline(always)]
            fn constant(self, value: f64) -> Self {
                Self::from_f64(value)
            }
            #[inline(always)]
            fn multiply_add(self, b: Self, c: Self) -> Self {
                self * b + c
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self::abs(self)
            }
            #[inline(always)]
            fn at_most(self, other: Self) -> Self {
                if self > other { other } else { self }
            }
            #[inline(always)]
            fn at_least(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn root_of_balls(self) -> Self {
                Real::sqrt(self)
            }
            #[inline(always)]
            fn root_of_rollers(self) -> Self {
                self.ninth_root()
            }
        }
    };
}

number!(f32);
number!(f64);

#[cfg(test)]
mod tests {
    use super::Real;

    #[test]
    fn roots_raised_again_are_the_number() {
        for k in -200..200 {
            let x = f64::powi(1.37, k);
            assert!((Real::sqrt(x) / f64::sqrt(x) - 1.0).abs() < 4.0 * f64::EPSILON, "sqrt {x}");
            assert!((Real::cbrt(x) / f64::cbrt(x) - 1.0).abs() < 4.0 * f64::EPSILON, "cbrt {x}");
            assert!((Real::ninth_root(x).powi(9) / x - 1.0).abs() < 36.0 * f64::EPSILON, "ninth root {x}");
            let x = x as f32;
            assert!((Real::ninth_root(x).powi(9) / x - 1.0).abs() < 36.0 * f32::EPSILON, "ninth root {x}");
            assert!((Real::sqrt(x) / f32::sqrt(x) - 1.0).abs() < 4.0 * f32::EPSILON, "sqrt {x}");
            assert!((Real::cbrt(x) / f32::cbrt(x) - 1.0).abs() < 4.0 * f32::EPSILON, "cbrt {x}");
        }
        assert_eq!((Real::sqrt(0.0_f32), Real::cbrt(0.0_f64)), (0.0, 0.0));
    }
}
