//! Real and complex numbers, one scene in each lane.
//!
//! Every operation works on each lane separately and rounds as the same operation on one number does, so a result is the same to the last
//! bit in any lane of any width. Callers must be `#[inline(always)]` up to the function that is compiled for the vectors of the processor, or
//! they are compiled for the oldest processor.

use core::ops::{Add, Div, Mul, Neg, Sub};

pub(super) use guideload_life::Number;
use pulp::{Simd, WithSimd};

/// Evaluates a call with the vectors of `simd` in a function of its own.
macro_rules! vectorize {
    ($simd:expr, $call:expr) => {
        $simd.vectorize($crate::batch::lanes::vector::Call(
            #[inline(always)]
            || $call,
        ))
    };
}

pub(super) use vectorize;

/// See [`vectorize`]. `FnMut`: called by `FnOnce`, a closure is wrapped in a function that is not inlined.
pub(super) struct Call<F>(pub F);

impl<T, F: FnMut() -> T> WithSimd for Call<F> {
    type Output = T;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> T {
        (self.0)()
    }
}

/// A number in each lane.
#[derive(Debug, Clone, Copy)]
pub(in crate::batch) struct Real<S: Simd> {
    simd: S,
    pub(in crate::batch) lanes: S::f64s,
}

impl<S: Simd> Real<S> {
    /// From a vector register.
    #[inline(always)]
    pub(in crate::batch) fn new(simd: S, lanes: S::f64s) -> Self {
        Self { simd, lanes }
    }

    /// The same number in all lanes.
    #[inline(always)]
    pub(super) fn splat(simd: S, value: f64) -> Self {
        Self::new(simd, simd.splat_f64s(value))
    }

    /// From a function of the lane.
    #[inline(always)]
    pub(super) fn gather(simd: S, of: impl Fn(usize) -> f64) -> Self {
        let mut lanes = simd.splat_f64s(0.0);
        for (lane, value) in numbers_mut::<S>(&mut lanes).iter_mut().enumerate() {
            *value = of(lane);
        }
        Self::new(simd, lanes)
    }

    /// The number in one lane.
    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> f64 {
        numbers::<S>(&self.lanes)[lane]
    }

    /// `self * b + c`, rounded once.
    #[inline(always)]
    pub(super) fn mul_add(self, b: Self, c: Self) -> Self {
        Self::new(self.simd, self.simd.mul_add_f64s(self.lanes, b.lanes, c.lanes))
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Self::new(self.simd, self.simd.sqrt_f64s(self.lanes))
    }

    /// The larger one; not for numbers that may be NaN.
    #[inline(always)]
    pub(super) fn max(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.max_f64s(self.lanes, other.lanes))
    }

    /// The smaller one; not for numbers that may be NaN.
    #[inline(always)]
    pub(super) fn min(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.min_f64s(self.lanes, other.lanes))
    }

    /// Lanes in which it is less than the other; none where one of them is NaN.
    #[inline(always)]
    pub(super) fn less_than(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, lanes: self.simd.less_than_f64s(self.lanes, other.lanes) }
    }
}

impl<S: Simd> Number for Real<S> {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self::new(self.simd, self.simd.abs_f64s(self.lanes))
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline(always)]
    fn at_least(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn root_of_balls(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn root_of_rollers(self) -> Self {
        Self::gather(self.simd, |lane| self.lane(lane).root_of_rollers())
    }
}

/// A truth value in each lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mask<S: Simd> {
    simd: S,
    lanes: S::m64s,
}

impl<S: Simd> Mask<S> {
    /// The first number where true, the second where false.
    #[inline(always)]
    pub(super) fn select(self, yes: Real<S>, no: Real<S>) -> Real<S> {
        Real::new(self.simd, self.simd.select_f64s(self.lanes, yes.lanes, no.lanes))
    }

    #[inline(always)]
    pub(super) fn or(self, other: Self) -> Self {
        Self { simd: self.simd, lanes: self.simd.or_m64s(self.lanes, other.lanes) }
    }

    /// Whether any lane is true.
    #[inline(always)]
    pub(super) fn any(self) -> bool {
        self.simd.first_true_m64s(self.lanes) < S::F64_LANES
    }

    #[inline(always)]
    pub(super) fn and(self, other: Self) -> Self {
        Self { simd: self.simd, lanes: self.simd.and_m64s(self.lanes, other.lanes) }
    }

    /// Negation in each lane.
    #[inline(always)]
    pub(super) fn not(self) -> Self {
        Self { simd: self.simd, lanes: self.simd.not_m64s(self.lanes) }
    }

    /// True in `self` and false in `other`.
    #[inline(always)]
    pub(super) fn and_not(self, other: Self) -> Self {
        Self { simd: self.simd, lanes: self.simd.and_m64s(self.lanes, self.simd.not_m64s(other.lanes)) }
    }

    /// The first number where true, the second where false.
    #[inline(always)]
    pub(super) fn select_complex(self, yes: Complex<S>, no: Complex<S>) -> Complex<S> {
        Complex::new(self.select(yes.re, no.re), self.select(yes.im, no.im))
    }
}

#[inline(always)]
fn numbers<S: Simd>(lanes: &S::f64s) -> &[f64] {
    pulp::bytemuck::cast_slice(core::slice::from_ref(lanes))
}

#[inline(always)]
fn numbers_mut<S: Simd>(lanes: &mut S::f64s) -> &mut [f64] {
    pulp::bytemuck::cast_slice_mut(core::slice::from_mut(lanes))
}

impl<S: Simd> Add for Real<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.add_f64s(self.lanes, other.lanes))
    }
}

impl<S: Simd> Sub for Real<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.sub_f64s(self.lanes, other.lanes))
    }
}

impl<S: Simd> Mul for Real<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.mul_f64s(self.lanes, other.lanes))
    }
}

impl<S: Simd> Div for Real<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.div_f64s(self.lanes, other.lanes))
    }
}

impl<S: Simd> Neg for Real<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(self.simd, self.simd.neg_f64s(self.lanes))
    }
}

/// A complex number in each lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Complex<S: Simd> {
    pub(super) re: Real<S>,
    pub(super) im: Real<S>,
}

impl<S: Simd> Complex<S> {
    #[inline(always)]
    pub(super) fn new(re: Real<S>, im: Real<S>) -> Self {
        Self { re, im }
    }

    /// From vector registers of the real and the imaginary part.
    #[inline(always)]
    pub(super) fn of(simd: S, [re, im]: [S::f64s; 2]) -> Self {
        Self::new(Real::new(simd, re), Real::new(simd, im))
    }

    /// The vector registers.
    #[inline(always)]
    pub(super) fn lanes(self) -> [S::f64s; 2] {
        [self.re.lanes, self.im.lanes]
    }

    #[inline(always)]
    pub(super) fn conj(self) -> Self {
        Self::new(self.re, -self.im)
    }

    #[inline(always)]
    pub(super) fn scale(self, factor: Real<S>) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }

    #[inline(always)]
    pub(super) fn norm_squared(self) -> Real<S> {
        self.re.mul_add(self.re, self.im * self.im)
    }

    /// `self * b + c`.
    #[inline(always)]
    pub(super) fn mul_add(self, b: Self, c: Self) -> Self {
        Self::new(
            (-self.im).mul_add(b.im, self.re.mul_add(b.re, c.re)),
            self.im.mul_add(b.re, self.re.mul_add(b.im, c.im)),
        )
    }

    /// `1 / self`.
    #[inline(always)]
    pub(super) fn recip(self) -> Self {
        let factor = self.re.constant(1.0) / self.norm_squared();
        self.conj().scale(factor)
    }

    /// The square root with a real part that is not negative.
    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        let zero = self.re.constant(0.0);
        let half = self.re.constant(0.5);
        let large = ((self.norm_squared().sqrt() + self.re.abs()) * half).sqrt();
        // The root of zero is zero.
        let small = zero.less_than(large).select(self.im.abs() * half / large, zero);
        let left = self.re.less_than(zero);
        let (re, im) = (left.select(small, large), left.select(large, small));
        Self::new(re, self.im.less_than(zero).select(-im, im))
    }
}

impl<S: Simd> Add for Complex<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl<S: Simd> Sub for Complex<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl<S: Simd> Mul for Complex<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(
            self.re.mul_add(other.re, -(self.im * other.im)),
            self.re.mul_add(other.im, self.im * other.re),
        )
    }
}

impl<S: Simd> Neg for Complex<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.re, -self.im)
    }
}
