//! A linear scene sampled at a fixed period, as matrices for a controller.

use core::ops::{Add, Mul};

use super::Propagator;
use crate::system::{ModelLevel, System};

/// The exact step of a linear scene over a fixed period, under an acceleration of L along x that is linear in between:
/// `s(h) = s + E s + b₀ a(0) + b₁ a(h)`.
#[derive(Debug, Clone, Copy)]
pub struct SampledSystem<T = f64> {
    /// E by columns.
    pub exp_minus_identity: [[T; 12]; 12],
    /// b₀, √J per m/s².
    pub from_start: [T; 12],
    /// b₁, √J per m/s².
    pub from_end: [T; 12],
}

impl SampledSystem {
    /// The step over `period` s; none if that is not positive and finite, or the scene is not linear.
    pub fn new(system: &System, period: f64) -> Option<Self> {
        if !(period > 0.0 && period.is_finite()) || system.model_level() != ModelLevel::Linear {
            return None;
        }
        let propagator = Propagator::new(system, &system.influence()[..1], period);
        let (&exp_minus_identity, &from_start, &from_end) = propagator.parts(0);
        Some(Self { exp_minus_identity, from_start, from_end })
    }

    /// The step in other numbers.
    pub(crate) fn rounded<T>(&self, number: impl Fn(f64) -> T + Copy) -> SampledSystem<T> {
        SampledSystem {
            exp_minus_identity: self.exp_minus_identity.map(|column| column.map(number)),
            from_start: self.from_start.map(number),
            from_end: self.from_end.map(number),
        }
    }
}

impl<T> SampledSystem<T> {
    /// All numbers.
    pub(crate) fn entries(&self) -> impl Iterator<Item = &T> {
        self.exp_minus_identity.as_flattened().iter().chain(&self.from_start).chain(&self.from_end)
    }
}

impl<T: Copy + Add<Output = T> + Mul<Output = T>> SampledSystem<T> {
    /// The state one period after `state`, from the accelerations at the start and at the end of the period, m/s².
    pub fn after(&self, state: &[T; 12], [start, end]: [T; 2]) -> [T; 12] {
        let mut next: [T; 12] =
            core::array::from_fn(|i| state[i] + (self.from_start[i] * start + self.from_end[i] * end));
        for (column, &entry) in self.exp_minus_identity.iter().zip(state) {
            next = core::array::from_fn(|i| next[i] + column[i] * entry);
        }
        next
    }
}
