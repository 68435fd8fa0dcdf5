//! The equivalent load of a carriage: one number for its force and moment, by the rule of a maker.

use guideload_life::{COMPONENTS, Integrals, Interval, Rule};

use super::power::{LoadPower, MAX_EXPONENT};

/// A preload that raises small loads, by its force F in N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Preload {
    /// No effect.
    None,
    /// `F (P / (2.8 F) + 1)^1.5` below 2.8 F (Rexroth, SKF).
    Power(f64),
    /// `F + 2/3 P` below 3 F (Thomson).
    Linear(f64),
    /// The load of the loaded one of two rows of balls that are preloaded against each other, as by [`crate::Law::preloaded`]:
    /// `F (1 + e)^1.5`, where `P = F ((1 + e)^1.5 - (1 - e)^1.5)`, below the load `2^1.5 F` at which the other row opens.
    Balls(f64),
    /// The same of rollers, with the exponent 10/9.
    Rollers(f64),
}

impl Preload {
    /// Load below which it acts, N.
    pub fn opening(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Power(force) => 2.8 * force,
            Self::Linear(force) => 3.0 * force,
            Self::Balls(force) => 2.0 * core::f64::consts::SQRT_2 * force,
            Self::Rollers(force) => 2.160_119_477_784_612_5 * force,
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

    /// The rule as loads are judged by it.
    pub fn rule(&self) -> Rule<f64> {
        let (preload, preload_form) = match self.preload {
            Preload::None => (0.0, 0),
            Preload::Power(force) => (force, 0),
            Preload::Linear(force) => (force, 1),
            Preload::Balls(force) => (force, 2),
            Preload::Rollers(force) => (force, 3),
        };
        let (plain, mut weights) = (self.minor == 1.0, self.weights);
        if plain {
            let [first, second] = &mut weights;
            for (to, from) in first.as_flattened_mut().iter_mut().zip(second.as_flattened_mut()) {
                *to += core::mem::take(from);
            }
        }
        Rule {
            weights: weights.map(|group| {
                [
                    group.map(|[above, below]| 0.5 * (above + below)),
                    group.map(|[above, below]| 0.5 * (above - below)),
                ]
            }),
            minor: self.minor,
            preload,
            opening: self.preload.opening(),
            counted: (0..COMPONENTS).filter(|&k| self.counts(k)).map(|component| 1 << component).sum(),
            plain: plain.into(),
            preload_form,
        }
    }

    /// P of the components of a load, without the effect of the preload, N.
    pub fn without_preload(&self, load: &[f64; COMPONENTS]) -> f64 {
        let rule = self.rule();
        rule.combined(rule.weigh(load).groups)
    }

    /// P of the components of a load, N.
    pub fn of(&self, load: &[f64; COMPONENTS]) -> f64 {
        self.rule().with_preload(self.without_preload(load))
    }

    /// The integrals over an interval, for the components Fy, Fz, Mx, My, Mz of the load at both ends, N and N m, linear between them.
    ///
    /// # Panics
    /// If the exponent is not 1 to 100; [`LoadPower::new`] tells.
    pub fn integrals(&self, exponent: f64, travel: &Interval, loads: [&[f64; COMPONENTS]; 2]) -> Integrals {
        let Some(power) = LoadPower::new(exponent) else {
            panic!("exponent: expected 1 to {MAX_EXPONENT}, got {exponent}")
        };
        self.rule().integrals(&power, travel, loads)
    }
}
