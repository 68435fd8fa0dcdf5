//! A linear scene sampled at a fixed period, as matrices for a controller.

use super::Propagator;
use crate::system::{ModelLevel, State, System};

/// The exact step of a linear scene over a fixed period, under an acceleration of L along x that is linear in between:
/// `s(h) = s + E s + b₀ a(0) + b₁ a(h)`.
#[derive(Debug, Clone, Copy)]
pub struct SampledSystem {
    /// E by columns.
    pub change: [State; 12],
    /// b₀, √J per m/s².
    pub from_start: State,
    /// b₁, √J per m/s².
    pub from_end: State,
}

impl SampledSystem {
    /// The step over `period` > 0 s; none if the scene is not linear.
    pub fn new(system: &System, period: f64) -> Option<Self> {
        if system.model_level() != ModelLevel::Linear {
            return None;
        }
        let propagator = Propagator::new(system, &system.influence()[..1], period);
        let (&change, &from_start, &from_end) = propagator.parts(0);
        Some(Self { change, from_start, from_end })
    }
}
