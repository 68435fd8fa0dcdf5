//! A stiffness for each side, with a clearance between them.

use super::kernels::sided_force;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sided {
    positive: f64,
    negative: f64,
    pub(super) clearance: f64,
    edges: [f64; 2],
    /// Number of edges in use.
    count: usize,
}

impl Sided {
    pub(super) fn new(positive: f64, negative: f64, clearance: f64) -> Self {
        // A side without stiffness has no edge.
        let (edges, count) = if clearance == 0.0 {
            ([0.0; 2], 1)
        } else if positive == 0.0 {
            ([-clearance, 0.0], 1)
        } else if negative == 0.0 {
            ([clearance, 0.0], 1)
        } else {
            ([-clearance, clearance], 2)
        };
        Self { positive, negative, clearance, edges, count }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn sides(&self) -> [f64; 3] {
        [self.positive, self.negative, self.clearance]
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self { positive: self.positive * factor, negative: self.negative * factor, ..*self }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn nominal(&self) -> f64 {
        f64::max(self.positive, self.negative)
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn edges(&self) -> &[f64] {
        &self.edges[..self.count]
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn force(&self, d: f64) -> f64 {
        sided_force(self.sides(), d)
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn energy(&self, d: f64) -> f64 {
        let (right, left) = (f64::max(d - self.clearance, 0.0), f64::max(-d - self.clearance, 0.0));
        0.5 * (self.positive * right * right + self.negative * left * left)
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn segment(&self, index: usize) -> (f64, f64) {
        if index == 0 && self.edges[0] <= 0.0 {
            (self.negative * self.clearance, self.negative)
        } else if index >= self.count {
            (-self.positive * self.clearance, self.positive)
        } else {
            (0.0, 0.0)
        }
    }
}
