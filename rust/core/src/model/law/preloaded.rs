//! Two rows of rolling elements preloaded against each other.

use crate::error::SceneError;
use crate::numeric::float::{atanh, copysign, exp, expm1, log1p, pow, sinh, sqrt};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Preloaded {
    /// k₀, N/m.
    pub(super) stiffness: f64,
    /// -d₀ and d₀, m.
    pub(super) edges: [f64; 2],
    /// F₀, N.
    pub(super) preload: f64,
    /// K = F₀ / d₀ⁿ.
    coefficient: f64,
    /// n.
    exponent: f64,
}

/// Exponent of balls, for which `x √x` replaces the power.
const BALL: f64 = 1.5;

/// Fraction of d₀ up to which the difference of powers loses digits; hyperbolic functions replace it there.
const SMALL: f64 = 0.5;

impl Preloaded {
    pub(super) fn new(stiffness: f64, preload: f64, exponent: f64) -> Result<Self, SceneError> {
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            return Err(SceneError::PreloadedStiffness { got: stiffness });
        }
        if !(preload > 0.0 && preload.is_finite()) {
            return Err(SceneError::Preload { got: preload });
        }
        if !(exponent > 1.0 && exponent <= 2.0) {
            return Err(SceneError::Exponent { got: exponent });
        }
        let opening = 2.0 * exponent * (preload / stiffness);
        let mut law = Self { stiffness, edges: [-opening, opening], preload, coefficient: 0.0, exponent };
        law.coefficient = preload / law.power(opening);
        if !(opening.is_normal() && law.coefficient.is_normal()) {
            return Err(SceneError::OutOfRange { what: "law: preload over stiffness" });
        }
        Ok(law)
    }

    /// The law of the same rolling elements with another stiffness and preload.
    pub(super) fn with(&self, stiffness: f64, preload: f64) -> Result<Self, SceneError> {
        Self::new(stiffness, preload, self.exponent)
    }

    /// d₀ and K, if n is that of balls.
    pub(super) fn balls(&self) -> Option<[f64; 2]> {
        (self.exponent == BALL).then_some([self.edges[1], self.coefficient])
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            stiffness: self.stiffness * factor,
            preload: self.preload * factor,
            coefficient: self.coefficient * factor,
            ..*self
        }
    }

    /// xⁿ.
    #[cfg_attr(feature = "std", inline(always))]
    fn power(&self, x: f64) -> f64 {
        if self.exponent == BALL { x * sqrt(x) } else { pow(x, self.exponent) }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn force(&self, d: f64) -> f64 {
        let (size, opening) = (d.abs(), self.edges[1]);
        let force = if size >= opening {
            self.coefficient * self.power(opening + size)
        } else if self.exponent == BALL {
            // (a³ - b³) over the sum of the roots, so that no digits cancel.
            let x = size / opening;
            let (a, b) = (1.0 + x, 1.0 - x);
            self.preload * (2.0 * x * (3.0 + x * x) / (a * sqrt(a) + b * sqrt(b)))
        } else {
            self.preload * self.closed_force(size / opening)
        };
        copysign(force, d)
    }

    /// `(1 + x)ⁿ - (1 - x)ⁿ`.
    fn closed_force(&self, x: f64) -> f64 {
        let n = self.exponent;
        if x <= SMALL {
            2.0 * exp(0.5 * n * log1p(-x * x)) * sinh(n * atanh(x))
        } else {
            pow(1.0 + x, n) - pow(1.0 - x, n)
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn tangent(&self, d: f64) -> f64 {
        let (size, opening) = (d.abs(), self.edges[1]);
        if size >= opening {
            self.exponent * self.coefficient * self.root(opening + size)
        } else {
            let x = size / opening;
            0.5 * self.stiffness * (self.root(1.0 + x) + self.root(1.0 - x))
        }
    }

    /// Second derivative of the force, N/m²; at an edge it is infinite, except for n = 2.
    pub(super) fn curvature(&self, d: f64) -> f64 {
        let (size, opening, n) = (d.abs(), self.edges[1], self.exponent);
        let power = |x: f64| pow(x, n - 2.0);
        let curvature = if size >= opening {
            n * (n - 1.0) * self.coefficient * power(opening + size)
        } else {
            let x = size / opening;
            0.5 * self.stiffness * (n - 1.0) / opening * (power(1.0 + x) - power(1.0 - x))
        };
        if d < 0.0 { -curvature } else { curvature }
    }

    /// xⁿ⁻¹.
    #[cfg_attr(feature = "std", inline(always))]
    fn root(&self, x: f64) -> f64 {
        if self.exponent == BALL { sqrt(x) } else { pow(x, self.exponent - 1.0) }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn energy(&self, d: f64) -> f64 {
        let (size, opening, over) = (d.abs(), self.edges[1], self.exponent + 1.0);
        if size >= opening {
            let sum = opening + size;
            self.coefficient * self.power(sum) * sum / over - 2.0 * self.preload * opening / over
        } else if self.exponent == BALL {
            // √(1+x)⁵ + √(1-x)⁵ - 2 in terms of q = 1 - √(1-x²) and c = √(1+x) + √(1-x), so that no digits cancel.
            let x = size / opening;
            let q = x * x / (1.0 + sqrt((1.0 - x) * (1.0 + x)));
            let c = sqrt(4.0 - 2.0 * q);
            self.preload * opening * (q * (c * (4.0 - q) - 2.0 / (c + 2.0))) / over
        } else {
            self.preload * opening * self.closed_energy(size / opening) / over
        }
    }

    /// `(1 + x)ⁿ⁺¹ + (1 - x)ⁿ⁺¹ - 2`.
    fn closed_energy(&self, x: f64) -> f64 {
        let m = self.exponent + 1.0;
        if x <= SMALL {
            // 2 (e^l cosh θ - 1)
            let (l, half) = (0.5 * m * log1p(-x * x), sinh(0.5 * m * atanh(x)));
            2.0 * (2.0 * exp(l) * half * half + expm1(l))
        } else {
            pow(1.0 + x, m) + pow(1.0 - x, m) - 2.0
        }
    }
}
