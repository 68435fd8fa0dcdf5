//! Why there is no derivative.

use core::fmt;

use nalgebra::Vector6;

use crate::error::{RunError, SceneError, Stopped, from_variants};
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
    /// Some links are not linear, whose derivatives are known at the samples alone.
    BetweenSamples,
    /// A damper acts only in contact, beside preloaded links.
    ContactDamper {
        /// Its link.
        link: usize,
    },
    /// A contact changes just at a sample of the motion.
    AtSample {
        /// The link.
        link: usize,
        /// Time of the sample, s.
        time: f64,
    },
    /// A factor on the motion is zero, by which there is no relative derivative.
    Factor,
    /// The run failed.
    Run(RunError),
    /// The watch stopped it, or there is not enough memory.
    Stopped(Stopped),
    /// A law has another derivative to either side.
    OneSided {
        /// The number that varies.
        target: Target,
    },
}

from_variants!(SensitivityError: Sample(SampleError), Run(RunError), Stopped(Stopped));

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
            Self::BetweenSamples => f.write_str(
                "links: between the samples of the motion histories have derivatives where all links are linear; ask at the samples",
            ),
            Self::ContactDamper { link } => write!(
                f,
                "links[{link}]: beside preloaded links histories have no derivatives for dampers that act only in contact; set \
                 damping_in_contact = false, or vary the machine in a study"
            ),
            Self::AtSample { link, time } => write!(
                f,
                "links[{link}] makes or loses contact just at the sample at {time:.9} s, where its load has another derivative to either \
                 side; change its clearance or the time stamps a little"
            ),
            Self::Factor => f.write_str(
                "motion.scale: expected another value than 0, at which the derivative of the histories is taken",
            ),
            Self::Run(error) => error.fmt(f),
            Self::Stopped(stopped) => stopped.fmt(f),
            Self::OneSided { target } => write!(
                f,
                "{target}: without clearance and with equal sides the law is linear, and has another derivative to either side; \
                 give it a clearance above 0 or unequal sides"
            ),
        }
    }
}

impl core::error::Error for SensitivityError {}
