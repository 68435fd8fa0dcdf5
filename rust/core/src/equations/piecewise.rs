//! The equations between two contact changes: each link is on one segment of its law, so all are linear.

use super::{Equations, StageData};
use crate::excitation::Instant;
use crate::numeric::float::{add_scaled, fma};
use crate::system::{Force, LinkRow, ModelLevel, NO_FORCE, Square, State, System};

/// Linear equations of one combination of segments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SegmentEquations {
    frequency: [f64; 6],
    /// Columns of S: negative modal force per unit of `ω η`.
    stiffness: Square,
    damping: Square,
    constant: Force,
    key: u32,
}

impl SegmentEquations {
    /// Linear equations with these matrices (columns).
    pub(super) fn new(frequency: [f64; 6], [stiffness, damping]: [Square; 2], constant: Force) -> Self {
        Self { frequency, stiffness, damping, constant, key: 0 }
    }

    /// The equations of the linear links alone, to which the others are added.
    pub(crate) fn of_linear_links(system: &System) -> Self {
        let mut piece = Self::new(*system.frequencies(), [[[0.0; 6]; 6]; 2], NO_FORCE);
        if system.model_level() == ModelLevel::Linear {
            // From the modes: on an elastic base the body feels less than the sum of its links.
            (piece.stiffness, piece.damping) = system.tangent(&[0.0; 12], Instant::FIRST);
            return piece;
        }
        for row in system.rows().iter().filter(|row| row.link.law().is_linear()) {
            piece.add(row, row.stiffness, 0.0, true);
        }
        piece
    }

    /// Adds a link on a segment with this `stiffness`, whose elastic load at the static position exceeds the load at rest by `excess`,
    /// and its damper if `damped`. Links are only added, never subtracted, so no digits cancel where a stiff link is out of contact.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn add(&mut self, row: &LinkRow, stiffness: f64, excess: f64, damped: bool) {
        for j in 0..6 {
            add_scaled(&mut self.stiffness[j], &row.rate, stiffness * row.deflection[j]);
        }
        for i in 0..6 {
            self.constant[i] = fma(-excess, row.rate[i], self.constant[i]);
        }
        if damped {
            for j in 0..6 {
                add_scaled(&mut self.damping[j], &row.rate, row.damping[j]);
            }
        }
    }

    /// With the nonlinear links, each on a segment of its law, asked for link by link; preloaded ones, which have no straight segments, as
    /// springs with their stiffness at rest.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn with_links(mut self, system: &System, mut segment: impl FnMut(&LinkRow) -> usize) -> Self {
        for (_, row) in system.nonlinear() {
            let segment = segment(row);
            if row.link.law().is_piecewise_linear() {
                let (stiffness, excess, damped) = row.on_segment(segment);
                self.add(row, stiffness, excess, damped);
            } else {
                self.add(row, row.stiffness, 0.0, true);
            }
        }
        self
    }

    /// The same equations with another key.
    pub(crate) fn with_key(mut self, key: u32) -> Self {
        self.key = key;
        self
    }
}

impl Equations for SegmentEquations {
    const PIECEWISE: bool = true;
    const LINEAR: bool = true;

    #[cfg_attr(feature = "std", inline(always))]
    fn key(&self) -> u32 {
        self.key
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn frequency(&self) -> &[f64; 6] {
        &self.frequency
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn linear(&self, state: &State, force: &Force) -> State {
        let mut fast = [0.0; 6];
        let mut slow: [f64; 6] = core::array::from_fn(|i| force[i]);
        let mut other = [0.0; 6];
        for i in 0..6 {
            fast[i] = self.frequency[i] * state[6 + i];
        }
        for j in 0..6 {
            add_scaled(&mut slow, &self.stiffness[j], -state[j]);
            add_scaled(&mut other, &self.damping[j], -state[6 + j]);
        }
        let mut rate = [0.0; 12];
        for i in 0..6 {
            rate[i] = fast[i];
            rate[6 + i] = slow[i] + other[i];
        }
        rate
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn constant(&self) -> &Force {
        &self.constant
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn rate(&self, state: &State, force: &Force, _: (&StageData, usize)) -> State {
        let mut sum = self.constant;
        add_scaled(&mut sum, force, 1.0);
        self.linear(state, &sum)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn tangent(&self, _: &State, _: Instant) -> (Square, Square) {
        (self.stiffness, self.damping)
    }
}
