//! Elastic laws: the force of a link as a function of its deflection (load-deflection curve).
//!
//! The deflection δ [m] is positive when the body moves along the link's direction; the force [N] is that of the
//! body on the link. The force of every law increases or is constant, so the elastic energy is convex and the static loads are unique.
//!
//! A new law needs a file beside `sided`, `preloaded` and `curve`, a variant of `Kind`, and its arms in the methods of [`Law`]. Contact
//! changes are then located at its [`Law::edges`].

mod curve;
mod derivative;
mod kernels;
mod parameter;
mod preloaded;
mod sided;

use crate::error::SceneError;
use curve::Curve;
use kernels::sided_force;
use preloaded::Preloaded;
use sided::Sided;

pub use curve::MAX_CURVE_POINTS;
pub(crate) use derivative::LawDerivative;
pub(crate) use kernels::{ball_compressions, ball_force};
pub use parameter::LawParameter;

/// An elastic law, checked when it is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law(Kind);

#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // there may be no allocator to put a curve elsewhere
enum Kind {
    Linear(f64),
    Sided(Sided),
    Preloaded(Preloaded),
    Curve(Curve),
}

impl Law {
    /// `F = k δ`, with a `stiffness` k in N/m that may be zero.
    ///
    /// # Errors
    /// [`SceneError::Stiffness`].
    pub fn linear(stiffness: f64) -> Result<Self, SceneError> {
        if !(stiffness >= 0.0 && stiffness.is_finite()) {
            return Err(SceneError::Stiffness { got: stiffness });
        }
        Ok(Self(Kind::Linear(stiffness)))
    }

    /// `F = k₊ (δ - c)₊ - k₋ (-δ - c)₊`: a stiffness for each side, N/m, one of which may be zero, and a `clearance` c to either side, m.
    /// Equal sides without clearance are a linear law.
    ///
    /// # Errors
    /// [`SceneError::Sides`], [`SceneError::Clearance`].
    pub fn sided(positive: f64, negative: f64, clearance: f64) -> Result<Self, SceneError> {
        let valid = |k: f64| k >= 0.0 && k.is_finite();
        if !(valid(positive) && valid(negative) && (positive > 0.0 || negative > 0.0)) {
            return Err(SceneError::Sides { positive, negative });
        }
        if !(clearance >= 0.0 && (clearance * f64::max(positive, negative)).is_finite()) {
            return Err(SceneError::Clearance { got: clearance });
        }
        if positive == negative && clearance == 0.0 {
            return Self::linear(positive);
        }
        Ok(Self(Kind::Sided(Sided::new(positive, negative, clearance))))
    }

    /// Two rows of rolling elements preloaded against each other: `F = K [(d₀ + δ)₊ⁿ - (d₀ - δ)₊ⁿ]`, given by catalogue values: the
    /// `stiffness` k₀ at δ = 0, N/m, and the `preload` F₀ = K d₀ⁿ of a row, N. Balls have the `exponent` n = 3/2, rollers 10/9. At |δ| =
    /// d₀ = 2 n F₀ / k₀ one row opens, under the load 2ⁿ F₀.
    ///
    /// # Errors
    /// [`SceneError::PreloadedStiffness`], [`SceneError::Preload`], [`SceneError::Exponent`] (outside 1 to 2), and
    /// [`SceneError::NotFinite`] for a d₀ or K out of the range of numbers.
    pub fn preloaded(stiffness: f64, preload: f64, exponent: f64) -> Result<Self, SceneError> {
        Ok(Self(Kind::Preloaded(Preloaded::new(stiffness, preload, exponent)?)))
    }

    /// Linear between `points` (δ, F), m and N, ascending in δ and nowhere decreasing in F; beyond the ends the end slopes continue.
    ///
    /// The curve need not pass through the origin: with a force at δ = 0 it pushes on the unloaded body. Points at which the slope
    /// changes by no more than rounding are dropped. If only the ends are left and the line passes through the origin, the law is linear.
    ///
    /// # Errors
    /// [`SceneError::CurvePoints`] for a count other than 2 to [`MAX_CURVE_POINTS`], [`SceneError::NotFinite`],
    /// [`SceneError::CurveOrder`], [`SceneError::CurveFalls`], [`SceneError::CurveFlat`].
    pub fn curve(points: &[[f64; 2]]) -> Result<Self, SceneError> {
        let curve = Curve::new(points)?;
        match curve.straight() {
            Some((0.0, stiffness)) => Self::linear(stiffness),
            _ => Ok(Self(Kind::Curve(curve))),
        }
    }

    /// The law with `factor` times the force at each deflection.
    ///
    /// # Errors
    /// [`SceneError::Factor`] for a factor that is not positive, or that leaves the range of numbers.
    pub fn scaled(&self, factor: f64) -> Result<Self, SceneError> {
        let refused = SceneError::Factor { got: factor };
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(refused);
        }
        let scaled = Self(match &self.0 {
            Kind::Linear(stiffness) => Kind::Linear(stiffness * factor),
            Kind::Sided(law) => Kind::Sided(law.scaled(factor)),
            Kind::Preloaded(law) => Kind::Preloaded(law.scaled(factor)),
            Kind::Curve(law) => Kind::Curve(law.scaled(factor)),
        });
        let in_range = |before: f64, after: f64| before == 0.0 || after.is_normal();
        let at = |d: f64| in_range(self.force(d), scaled.force(d));
        let all =
            in_range(self.nominal(), scaled.nominal()) && at(0.0) && self.edges().iter().all(|&d| at(d));
        if all { Ok(scaled) } else { Err(refused) }
    }

    /// `linear`, `sided`, `preloaded` or `curve`.
    pub fn kind(&self) -> &'static str {
        match self.0 {
            Kind::Linear(_) => "linear",
            Kind::Sided(_) => "sided",
            Kind::Preloaded(_) => "preloaded",
            Kind::Curve(_) => "curve",
        }
    }

    /// Whether `F = k δ`.
    pub fn is_linear(&self) -> bool {
        matches!(self.0, Kind::Linear(_))
    }

    /// Preload of a row of a preloaded law, N; 0 of others.
    pub fn preload(&self) -> f64 {
        if let Kind::Preloaded(law) = &self.0 { law.preload } else { 0.0 }
    }

    /// Whether it consists of straight segments: every law but a preloaded one.
    pub fn is_piecewise_linear(&self) -> bool {
        match self.0 {
            Kind::Linear(_) | Kind::Sided(_) | Kind::Curve(_) => true,
            Kind::Preloaded(_) => false,
        }
    }

    /// Nominal stiffness, N/m: k; of a sided law the larger side; of a preloaded one k₀; of a curve its largest slope.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn nominal(&self) -> f64 {
        match &self.0 {
            Kind::Linear(stiffness) => *stiffness,
            Kind::Sided(law) => law.nominal(),
            Kind::Preloaded(law) => law.stiffness,
            Kind::Curve(law) => law.nominal(),
        }
    }

    /// Force at the deflection `d`, N.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn force(&self, d: f64) -> f64 {
        match &self.0 {
            Kind::Linear(stiffness) => stiffness * d,
            Kind::Sided(law) => law.force(d),
            Kind::Preloaded(law) => law.force(d),
            Kind::Curve(law) => law.force(d),
        }
    }

    /// Slope of the force at the deflection `d`, N/m; at an edge the slope to its right.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn tangent(&self, d: f64) -> f64 {
        match &self.0 {
            Kind::Linear(stiffness) => *stiffness,
            Kind::Sided(law) => law.segment(self.segment_of(d)).1,
            Kind::Preloaded(law) => law.tangent(d),
            Kind::Curve(law) => law.segment(self.segment_of(d)).1,
        }
    }

    /// Energy at the deflection `d`, J: the integral of the force from 0.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn energy(&self, d: f64) -> f64 {
        match &self.0 {
            Kind::Linear(stiffness) => 0.5 * stiffness * d * d,
            Kind::Sided(law) => law.energy(d),
            Kind::Preloaded(law) => law.energy(d),
            Kind::Curve(law) => law.energy(d),
        }
    }

    /// Clearance to either side, m; zero but for a sided law.
    pub fn clearance(&self) -> f64 {
        match &self.0 {
            Kind::Sided(law) => law.clearance,
            _ => 0.0,
        }
    }

    /// Positive and negative stiffness and clearance of a sided law.
    pub(crate) fn sides(&self) -> Option<[f64; 3]> {
        match &self.0 {
            Kind::Sided(law) => Some(law.sides()),
            _ => None,
        }
    }

    /// d₀ in m and K of a preloaded law of balls, n = 3/2.
    pub(crate) fn balls(&self) -> Option<[f64; 2]> {
        match &self.0 {
            Kind::Preloaded(law) => law.balls(),
            _ => None,
        }
    }

    /// Deflections at which a contact opens or closes, ascending, m: where the slope changes, and for a preloaded law -d₀ and d₀.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn edges(&self) -> &[f64] {
        match &self.0 {
            Kind::Linear(_) => &[],
            Kind::Sided(law) => law.edges(),
            Kind::Preloaded(law) => &law.edges,
            Kind::Curve(law) => law.edges(),
        }
    }

    /// Index of the segment in which `d` lies: the number of edges up to `d`, so that an edge belongs to the segment on its right.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn segment_of(&self, d: f64) -> usize {
        let mut segment = 0;
        for &edge in self.edges() {
            segment += usize::from(edge <= d);
        }
        segment
    }

    /// (a, k) of `F = a + k δ` on a segment of a piecewise linear law, N and N/m; for an index past the last segment that of the last.
    /// For a preloaded law, which has no straight segments, the tangent at δ = 0.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn segment(&self, index: usize) -> (f64, f64) {
        match &self.0 {
            Kind::Linear(stiffness) => (0.0, *stiffness),
            Kind::Sided(law) => law.segment(index),
            Kind::Preloaded(law) => (0.0, law.stiffness),
            Kind::Curve(law) => law.segment(index),
        }
    }
}

impl Law {
    /// The linear law with the slope of a segment of this one.
    pub(crate) fn slope_of(&self, segment: usize) -> Self {
        Self(Kind::Linear(self.segment(segment).1))
    }
}

/// Forces of a law at several deflections, in a vector loop for the common laws.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn forces<const N: usize>(law: &Law, at: &[f64; N]) -> [f64; N] {
    let mut out = *at;
    if let Some(sides) = law.sides() {
        for force in &mut out {
            *force = sided_force(sides, *force);
        }
    } else if let Some([opening, coefficient]) = law.balls() {
        for force in &mut out {
            *force = coefficient * ball_force(opening, *force);
        }
    } else {
        for force in &mut out {
            *force = law.force(*force);
        }
    }
    out
}
