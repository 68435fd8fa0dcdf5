//! Parameters of a law by name.

use super::{Kind, Law};
use crate::error::SceneError;

/// A parameter of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LawParameter {
    /// Nominal stiffness, N/m; the ratio of the two sides of a law does not change.
    Stiffness,
    /// Stiffness where the body moves along the link's direction, N/m.
    PositiveStiffness,
    /// Stiffness where the body moves against the link's direction, N/m.
    NegativeStiffness,
    /// Clearance to either side, m.
    Clearance,
    /// Preload of a row, N.
    Preload,
    /// Factor on all forces.
    Scale,
}

impl LawParameter {
    /// All parameters, in the order in which [`Law::with`] must set several.
    pub const ALL: [Self; 6] = [
        Self::Stiffness,
        Self::PositiveStiffness,
        Self::NegativeStiffness,
        Self::Clearance,
        Self::Preload,
        Self::Scale,
    ];

    /// Its name, such as `positive_stiffness`.
    pub const fn name(self) -> &'static str {
        ["stiffness", "positive_stiffness", "negative_stiffness", "clearance", "preload", "scale"]
            [self as usize]
    }

    /// The parameter of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name() == name)
    }
}

impl Law {
    /// The law with one parameter changed. A linear law becomes a sided one if it gets a clearance, or a different stiffness on one
    /// side.
    ///
    /// # Errors
    /// [`SceneError::NoParameter`] for a parameter that a law of this kind does not have, and the errors of the law with the new value.
    #[inline]
    pub fn with(&self, parameter: LawParameter, value: f64) -> Result<Self, SceneError> {
        if parameter == LawParameter::Scale {
            return self.scaled(value);
        }
        let none = SceneError::NoParameter { parameter: parameter.name(), law: self.kind() };
        let [positive, negative, clearance] = match &self.0 {
            Kind::Linear(_) if parameter == LawParameter::Stiffness => return Self::linear(value),
            Kind::Linear(stiffness) => [*stiffness, *stiffness, 0.0],
            Kind::Sided(law) => law.sides(),
            Kind::Preloaded(law) => {
                return match parameter {
                    LawParameter::Stiffness => Ok(Self(Kind::Preloaded(law.with(value, law.preload)?))),
                    LawParameter::Preload => Ok(Self(Kind::Preloaded(law.with(law.stiffness, value)?))),
                    _ => Err(none),
                };
            }
            Kind::Curve(_) => return Err(none),
        };
        match parameter {
            LawParameter::Stiffness => {
                let nominal = f64::max(positive, negative);
                Self::sided(value * (positive / nominal), value * (negative / nominal), clearance)
            }
            LawParameter::PositiveStiffness => Self::sided(value, negative, clearance),
            LawParameter::NegativeStiffness => Self::sided(positive, value, clearance),
            LawParameter::Clearance => Self::sided(positive, negative, value),
            LawParameter::Preload | LawParameter::Scale => Err(none),
        }
    }
}
