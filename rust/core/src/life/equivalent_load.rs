//! The equivalent load of a carriage: one number for its force and moment, by the rule of a maker.

use super::rows::{loaded_row, opening};
use crate::numeric::float::pow;

/// Number of components that a rule counts: Fy, Fz, Mx, My, Mz, entries 1 to 5 of a load.
pub(crate) const COMPONENTS: usize = 5;

/// A preload that raises small loads, by its force in N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Preload {
    /// No effect.
    None,
    /// `F (P / (2.8 F) + 1)^1.5` below 2.8 F (Rexroth, SKF).
    Power(f64),
    /// `F + 2/3 P` below 3 F (Thomson).
    Linear(f64),
    /// The load of the loaded one of two rows that are preloaded against each other, as by [`crate::Law::preloaded`]: `F (1 + e)^n`, where
    /// `P = F ((1 + e)^n - (1 - e)^n)`, below the load `2^n F` at which the other row opens.
    Rows {
        /// F.
        force: f64,
        /// n, above 1: 3/2 for balls, 10/9 for rollers.
        exponent: f64,
    },
}

impl Preload {
    /// Load below which it acts, N.
    pub fn opening(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Power(force) => 2.8 * force,
            Self::Linear(force) => 3.0 * force,
            Self::Rows { force, exponent } => force * opening(exponent),
        }
    }

    /// The effect of a preload that is larger by a factor.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        match self {
            Self::None => Self::None,
            Self::Power(force) => Self::Power(factor * force),
            Self::Linear(force) => Self::Linear(factor * force),
            Self::Rows { force, exponent } => Self::Rows { force: factor * force, exponent },
        }
    }

    /// P with the effect of the preload, from P without it, N.
    pub fn raised(self, load: f64) -> f64 {
        match self {
            Self::Power(force) if load < self.opening() => force * pow(load / self.opening() + 1.0, 1.5),
            Self::Linear(force) if load < self.opening() => force + 2.0 / 3.0 * load,
            Self::Rows { force, exponent } if load < self.opening() => {
                force * loaded_row(load / force, exponent)[0]
            }
            _ => load,
        }
    }
}

/// Rule of the equivalent load. With two groups A and B of weighted magnitudes of the components Fy, Fz, Mx, My, Mz, P is
/// `max(A, B) + minor min(A, B)`; a preload raises small P. The load is linear in time where the components are, and no component and not
/// A - B changes its sign, and P does not pass the opening of the preload.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EquivalentLoad {
    /// Weights of the groups A and B, of each component, for positive and negative values; 1 for forces, 1/m for moments.
    pub weights: [[[f64; 2]; COMPONENTS]; 2],
    /// Factor on the smaller group; 1 for a plain sum.
    pub minor: f64,
    /// Effect of the preload.
    pub preload: Preload,
}

impl EquivalentLoad {
    /// `|Fy| + |Fz|`.
    pub const SUM_OF_FORCES: Self = {
        let mut weights = [[[0.0; 2]; COMPONENTS]; 2];
        (weights[0][0], weights[0][1]) = ([1.0; 2], [1.0; 2]);
        Self { weights, minor: 1.0, preload: Preload::None }
    };

    /// Whether a component has a weight.
    pub fn counts(&self, component: usize) -> bool {
        self.weights.iter().any(|group| group[component] != [0.0; 2])
    }

    /// The groups A and B of the components of a load, N.
    pub(crate) fn groups(&self, load: &[f64; COMPONENTS]) -> [f64; 2] {
        self.weights.map(|weights| {
            let mut sum = 0.0;
            for (value, [above, below]) in load.iter().zip(weights) {
                sum += if *value >= 0.0 { above } else { -below } * value;
            }
            sum
        })
    }

    /// P of the groups, without the effect of the preload, N.
    pub(crate) fn combined(&self, [first, second]: [f64; 2]) -> f64 {
        let (larger, smaller) = if first >= second { (first, second) } else { (second, first) };
        larger + self.minor * smaller
    }

    /// P of the components of a load, without the effect of the preload, N.
    pub fn without_preload(&self, load: &[f64; COMPONENTS]) -> f64 {
        self.combined(self.groups(load))
    }

    /// P of the components of a load, N.
    pub fn of(&self, load: &[f64; COMPONENTS]) -> f64 {
        self.preload.raised(self.without_preload(load))
    }
}
