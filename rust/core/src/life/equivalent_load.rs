//! The equivalent load of a carriage: one number for its force and moment, by the rule of a maker.

use crate::numeric::float::pow;

/// Number of components that a rule counts: Fy, Fz, Mx, My, Mz, entries 1 to 5 of a load.
pub(crate) const COMPONENTS: usize = 5;

/// A preload that raises small loads, by its force F in N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Preload {
    /// No effect.
    None,
    /// `F (P / (2.8 F) + 1)^1.5` below 2.8 F (Rexroth, SKF).
    Power(f64),
    /// `F + 2/3 P` below 3 F (Thomson).
    Linear(f64),
}

impl Preload {
    /// Load below which it acts, N.
    pub fn opening(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Power(force) => 2.8 * force,
            Self::Linear(force) => 3.0 * force,
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
        let load = self.without_preload(load);
        match self.preload {
            Preload::Power(force) if load < self.preload.opening() => {
                force * pow(load / self.preload.opening() + 1.0, 1.5)
            }
            Preload::Linear(force) if load < self.preload.opening() => force + 2.0 / 3.0 * load,
            _ => load,
        }
    }
}
