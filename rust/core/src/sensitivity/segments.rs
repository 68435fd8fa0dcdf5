//! The linear system that holds while each link stays on one segment of its law, and its derivatives.

use super::system::{OnSegments, VariedSystem};
use crate::equations::{Equations, SegmentEquations};
use crate::excitation::Instant;
use crate::system::{Force, NO_FORCE, Square};

impl VariedSystem {
    /// The system with the nonlinear links on these segments: (index, segment). Its rows and their derivatives are those of linear links
    /// with the slopes of the segments, and their loads at rest lie on the segments too, extended as far as that.
    pub(super) fn on_segments(&self, segments: &[(usize, u8)]) -> (Self, SegmentEquations) {
        let mut out = self.clone();
        let mut equations = SegmentEquations::of_linear_links(&self.system);
        let mut constants = vec![NO_FORCE; self.derivatives.len()];
        for &(link, segment) in segments {
            let (row, segment) = (&self.system.rows()[link], usize::from(segment));
            let (stiffness, excess, damped) = row.on_segment(segment);
            equations.add(row, stiffness, excess, damped);
            let law = row.link.law();
            for ((by, constant), own) in out.derivatives.iter_mut().zip(&mut constants).zip(&self.derivatives)
            {
                let of = &mut by.links[link];
                let (load_at_zero, slope) = law.segment_derivative(segment, &of.law);
                let further = if segment == law.segment_of(row.rest) {
                    0.0
                } else {
                    load_at_zero + slope * row.rest + stiffness * of.rest - own.links[link].load
                };
                (of.load, of.stiffness) = (of.load + further, slope);
                if !damped {
                    of.damping = 0.0;
                }
                let turned = of.rate(&self.system);
                for mode in 0..6 {
                    constant[mode] -= turned[mode] * excess + row.rate[mode] * further;
                }
            }
            out.system.rows_mut()[link].stay_on(segment, (stiffness, excess, damped));
        }
        out.system.damping = equations.tangent(&[0.0; 12], Instant::FIRST).1;
        out.on_segments = Some(OnSegments { equations, constants });
        (out, equations)
    }

    /// Stiffness S and constant force of the equations.
    pub(super) fn stiffness_and_constant(&self) -> (Square, Force) {
        match &self.on_segments {
            Some(OnSegments { equations, .. }) => {
                (equations.tangent(&[0.0; 12], Instant::FIRST).0, *equations.constant())
            }
            None => (self.system.tangent(&[0.0; 12], Instant::FIRST).0, NO_FORCE),
        }
    }

    /// Derivative of the constant force of the equations by a column, with the mass matrix as it is.
    pub(super) fn constant_derivative(&self, column: usize) -> Force {
        self.on_segments.as_ref().map_or(NO_FORCE, |of| of.constants[column])
    }
}
