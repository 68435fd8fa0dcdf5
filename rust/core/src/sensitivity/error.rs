//! Why there is no derivative.

use core::fmt;

use nalgebra::Vector6;

use crate::error::SceneError;
use crate::variation::{SampleError, Target};

/// Why a system has no derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensitivityError {
    /// There is no system with these values.
    Sample(SampleError),
    /// The scene stands on an elastic base.
    ElasticBase,
    /// The body is loose at rest, so its static position is one of many.
    Loose {
        /// A motion of L in which it is loose, largest entry 1.
        motion: Vector6<f64>,
    },
    /// A link rests where the slope of its law jumps.
    AtEdge {
        /// Which link.
        link: usize,
        /// Its deflection at rest, m.
        deflection: f64,
    },
    /// A law has another derivative to either side.
    OneSided {
        /// The number that varies.
        target: Target,
    },
}

impl From<SampleError> for SensitivityError {
    fn from(error: SampleError) -> Self {
        Self::Sample(error)
    }
}

impl From<SceneError> for SensitivityError {
    fn from(error: SceneError) -> Self {
        Self::Sample(error.into())
    }
}

impl fmt::Display for SensitivityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sample(error) => error.fmt(f),
            Self::ElasticBase => f.write_str(
                "base: derivatives are for a rigid base; leave the base out, or vary its machine in a study",
            ),
            Self::Loose { motion } => write!(
                f,
                "at rest the body is loose within its clearance in the motion {:.3?} (x y z rx ry rz), so its static position is one of \
                 many and has no derivative; change the clearance or the loads so that it is held",
                motion.as_slice()
            ),
            Self::AtEdge { link, deflection } => write!(
                f,
                "links[{link}] rests at a deflection of {deflection:.6e} m, where its law has a kink and no derivative; change its clearance \
                 or the weight a little"
            ),
            Self::OneSided { target } => write!(
                f,
                "{target}: without clearance and with equal sides the law is linear, and has another derivative to either side; \
                 give it a clearance above 0 or unequal sides"
            ),
        }
    }
}

impl core::error::Error for SensitivityError {}
