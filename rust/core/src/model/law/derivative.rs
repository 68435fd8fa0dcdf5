//! Derivatives of a law by its parameters.

use super::{Kind, Law, LawParameter};

/// Derivative of the numbers of a law by a value: k of a linear one; k₊, k₋ and c of a sided one; k₀ and F₀ of a preloaded one; the logarithm of
/// the forces of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LawDerivative([f64; 3]);

impl LawDerivative {
    /// The derivative of `law` by a value that sets `parameters`, in the order of [`LawParameter`]: the parameter, its value, and the
    /// derivative of that.
    ///
    /// # Errors
    /// The parameter by which there is no derivative, but one to either side: the clearance of a law that has none, or one of two equal
    /// sides.
    pub(crate) fn new(
        law: &Law,
        parameters: impl Iterator<Item = (LawParameter, f64, f64)>,
    ) -> Result<Self, LawParameter> {
        let mut numbers = [0.0; 3];
        for (parameter, value, rate) in parameters {
            match (&law.0, parameter) {
                (Kind::Curve(_), _) => numbers[0] = rate / value,
                (Kind::Linear(stiffness), LawParameter::Scale) => numbers[0] += rate / value * stiffness,
                (Kind::Sided(_) | Kind::Preloaded(_), LawParameter::Scale) => {
                    let scaled = law.numbers();
                    // The clearance is no force.
                    let forces = if law.sides().is_some() { 0..2 } else { 0..3 };
                    for i in forces {
                        numbers[i] += rate / value * scaled[i];
                    }
                }
                (Kind::Linear(_) | Kind::Preloaded(_), LawParameter::Stiffness) => numbers[0] = rate,
                (Kind::Preloaded(_), LawParameter::Preload) => numbers[1] = rate,
                (Kind::Sided(sided), LawParameter::Stiffness) => {
                    let [positive, negative, _] = sided.sides();
                    let nominal = f64::max(positive, negative);
                    (numbers[0], numbers[1]) = (rate * (positive / nominal), rate * (negative / nominal));
                }
                (Kind::Sided(_), LawParameter::PositiveStiffness) => numbers[0] = rate,
                (Kind::Sided(_), LawParameter::NegativeStiffness) => numbers[1] = rate,
                (Kind::Sided(sided), LawParameter::Clearance) if rate != 0.0 && sided.clearance == 0.0 => {
                    return Err(parameter);
                }
                (Kind::Sided(_), LawParameter::Clearance) => numbers[2] = rate,
                _ if rate == 0.0 => {}
                _ => return Err(parameter),
            }
        }
        Ok(Self(numbers))
    }

    /// Whether nothing changes.
    pub(crate) fn is_zero(&self) -> bool {
        self.0 == [0.0; 3]
    }
}

impl Law {
    /// The numbers of a law in the order of [`LawDerivative`].
    fn numbers(&self) -> [f64; 3] {
        match &self.0 {
            Kind::Linear(stiffness) => [*stiffness, 0.0, 0.0],
            Kind::Sided(law) => law.sides(),
            Kind::Preloaded(law) => [law.stiffness, law.preload, 0.0],
            Kind::Curve(_) => [1.0, 0.0, 0.0],
        }
    }

    /// Derivative of the force at a fixed deflection `d`.
    pub(crate) fn force_derivative(&self, d: f64, LawDerivative(by): &LawDerivative) -> f64 {
        match &self.0 {
            Kind::Linear(_) => by[0] * d,
            Kind::Curve(law) => by[0] * law.force(d),
            Kind::Sided(law) => {
                let [positive, negative, clearance] = law.sides();
                if d >= clearance {
                    by[0] * (d - clearance) - positive * by[2]
                } else if d <= -clearance {
                    by[1] * (d + clearance) + negative * by[2]
                } else {
                    0.0
                }
            }
            Kind::Preloaded(law) => {
                // F = F₀ g(δ/d₀) with d₀ = 2 n F₀/k₀, so that a change of d₀ stretches the law along δ.
                let stretch = by[1] / law.preload - by[0] / law.stiffness;
                by[1] / law.preload * law.force(d) - stretch * d * law.tangent(d)
            }
        }
    }

    /// Relative size of the terms of [`Law::force_derivative`] that cancel each other; none do but those of a preloaded law.
    pub(crate) fn cancelling_derivative(&self, LawDerivative(by): &LawDerivative) -> f64 {
        match &self.0 {
            Kind::Preloaded(law) => 2.0 * by[1].abs() / law.preload + by[0].abs() / law.stiffness,
            _ => 0.0,
        }
    }

    /// Derivative of the slope at a fixed deflection `d`.
    pub(crate) fn tangent_derivative(&self, d: f64, LawDerivative(by): &LawDerivative) -> f64 {
        match &self.0 {
            Kind::Linear(_) => by[0],
            Kind::Curve(_) => by[0] * self.tangent(d),
            Kind::Sided(law) => match d {
                _ if d >= law.clearance => by[0],
                _ if d <= -law.clearance => by[1],
                _ => 0.0,
            },
            Kind::Preloaded(law) => {
                let stretch = by[1] / law.preload - by[0] / law.stiffness;
                by[0] / law.stiffness * law.tangent(d) - stretch * d * law.curvature(d)
            }
        }
    }

    /// Derivatives of (a, k) of [`Law::segment`], at the same index.
    pub(crate) fn segment_derivative(&self, index: usize, LawDerivative(by): &LawDerivative) -> (f64, f64) {
        let (load, stiffness) = self.segment(index);
        match &self.0 {
            Kind::Curve(_) => (by[0] * load, by[0] * stiffness),
            Kind::Sided(_) if stiffness == 0.0 => (0.0, 0.0),
            Kind::Sided(law) if index == 0 => (by[1] * law.clearance + stiffness * by[2], by[1]),
            Kind::Sided(law) => (-by[0] * law.clearance - stiffness * by[2], by[0]),
            Kind::Linear(_) | Kind::Preloaded(_) => (0.0, by[0]),
        }
    }

    /// Derivative of the deflection of an edge.
    pub(crate) fn edge_derivative(&self, index: usize, LawDerivative(by): &LawDerivative) -> f64 {
        match &self.0 {
            Kind::Sided(law) => {
                if law.edges()[index] < 0.0 {
                    -by[2]
                } else {
                    by[2]
                }
            }
            Kind::Preloaded(law) => {
                let rate = by[1] / law.preload - by[0] / law.stiffness;
                rate * law.edges[index]
            }
            Kind::Linear(_) | Kind::Curve(_) => 0.0,
        }
    }

    /// Derivative of the nominal stiffness.
    pub(crate) fn nominal_derivative(&self, LawDerivative(by): &LawDerivative) -> f64 {
        match &self.0 {
            Kind::Curve(law) => by[0] * law.nominal(),
            Kind::Sided(law) => {
                let [positive, negative, _] = law.sides();
                by[usize::from(negative > positive)]
            }
            Kind::Linear(_) | Kind::Preloaded(_) => by[0],
        }
    }

    /// Second derivative of the force by the deflection at `d`, N/m²; zero for straight segments.
    pub(crate) fn curvature(&self, d: f64) -> f64 {
        match &self.0 {
            Kind::Preloaded(law) => law.curvature(d),
            _ => 0.0,
        }
    }
}
