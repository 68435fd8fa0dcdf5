//! The load of the loaded one of two preloaded rows of balls or rollers, by formulas for one number or for several side by side.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// What the formulas are computed with.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant of the kind of this number.
    #[must_use]
    fn constant(self, value: f64) -> Self;
    /// `self * b + c`.
    #[must_use]
    fn multiply_add(self, b: Self, c: Self) -> Self;
    /// Magnitude.
    #[must_use]
    fn abs(self) -> Self;
    /// The smaller one.
    #[must_use]
    fn at_most(self, other: Self) -> Self;
    /// The larger one.
    #[must_use]
    fn at_least(self, other: Self) -> Self;
    /// `x^(n - 1)` for rows of balls, n = 3/2: the square root.
    #[must_use]
    fn root_of_balls(self) -> Self;
    /// `x^(n - 1)` for rows of rollers, n = 10/9: the ninth root.
    #[must_use]
    fn root_of_rollers(self) -> Self;
}

/// Two rows whose load is `F (1 + e)^n` and `F (1 - e)^n` under `P = F ((1 + e)^n - (1 - e)^n)`, n = 3/2 for balls and 10/9 for rollers.
#[derive(Debug, Clone, Copy)]
pub struct Rows<N> {
    /// F, N.
    pub preload: N,
    /// P at which a row opens, e = 1, N.
    pub opening: N,
    /// Balls, else rollers.
    pub balls: bool,
}

impl<N: Number> Rows<N> {
    #[inline(always)]
    fn number(&self, value: f64) -> N {
        self.preload.constant(value)
    }

    /// n.
    #[inline(always)]
    fn exponent(&self) -> N {
        self.number(if self.balls { 3.0 / 2.0 } else { 10.0 / 9.0 })
    }

    /// `x^(n - 1)`.
    #[inline(always)]
    pub fn root(&self, x: N) -> N {
        if self.balls { x.root_of_balls() } else { x.root_of_rollers() }
    }

    /// e under a load below the opening. P over e falls from `2 n F` to `2^n F`, so e is between both lines; P is concave in it, so Newton's
    /// steps converge from anywhere. Two of them leave 1e-10, three leave rounding.
    #[inline(always)]
    pub fn deflection(&self, load: N, steps: usize) -> N {
        let (one, exponent) = (self.number(1.0), self.exponent());
        let (share, ratio) = (load / self.opening, load / self.preload);
        // 2^n / (2 n).
        let slope = self.number(if self.balls { 0.942_809_041_582_063_4 } else { 0.972_053_765_003_075_5 });
        let mut e = share * (slope + (one - slope) * share * share);
        for _ in 0..steps {
            let (more, less) = (one + e, one - e);
            let (above, below) = (self.root(more), self.root(less));
            e = e - (more * above - less * below - ratio) / (exponent * (above + below));
            e = e.at_most(one);
        }
        e
    }

    /// Coefficients of the Taylor series of the load of the loaded row about a load below the opening, by powers 0 to 4 of its change.
    #[inline(always)]
    pub fn series(&self, load: N) -> [N; 5] {
        let (one, n) = (self.number(1.0), self.exponent());
        // Two steps are enough: the series takes in the rest as a change of the load.
        let e = self.deflection(load, 2);
        let (more, less) = (one + e, one - e);
        // The series of (1 + e)^n, and that of P/F with its coefficients over the first one.
        let (root, other) = (self.root(more), self.root(less));
        let [a1, a2, a3, a4] = self.of_row(n, more, root);
        let [b1, b2, b3, b4] = self.of_row(n, less, other);
        // (1 - e)^n: its odd coefficients have the other sign.
        let p1 = a1 + b1;
        let [p2, p3, p4] = [(a2 - b2) / p1, (a3 + b3) / p1, (a4 - b4) / p1];
        // The series of e in the change of P/F over the first coefficient.
        let square = p2 * p2;
        let two = self.number(2.0);
        let e2 = -p2;
        let e3 = square + square - p3;
        let e4 = self.number(5.0) * p2 * (p3 - square) - p4;
        let over = one / (self.preload * p1);
        let rest = (load / self.preload - (more * root - less * other)) / p1;
        let mut series = [
            more * root + a1 * rest,
            a1,
            a1 * e2 + a2,
            a1 * e3 + two * a2 * e2 + a3,
            a1 * e4 + a2 * (e3 + e3 + square) + self.number(3.0) * a3 * e2 + a4,
        ];
        let mut factor = self.preload;
        for coefficient in &mut series {
            *coefficient = *coefficient * factor;
            factor = factor * over;
        }
        series
    }

    /// Coefficients of the series of `x^n`, by powers 1 to 4 of the change of x, from `x^(n - 1)`.
    #[inline(always)]
    fn of_row(&self, n: N, x: N, root: N) -> [N; 4] {
        let first = n * root;
        let second = self.number(0.5) * (n - self.number(1.0)) * first / x;
        let third = self.number(1.0 / 3.0) * (n - self.number(2.0)) * second / x;
        [first, second, third, self.number(0.25) * (n - self.number(3.0)) * third / x]
    }
}
