//! Changes: which numbers of the scene or the motion vary, as linear functions of the values of a sample.

use core::fmt;

use crate::model::LawParameter;

/// A number that a change sets. SI; axes and directions are x y z = 0 1 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// Mass of the body.
    Mass,
    /// Its centre of mass along an axis, from L.
    CenterOfMass(usize),
    /// An entry of its inertia tensor, and the mirrored entry.
    Inertia(usize, usize),
    /// Gravity along an axis.
    Gravity(usize),
    /// Point at which a link holds the body, along an axis, from L.
    Point {
        /// Which link.
        link: usize,
        /// Which axis.
        axis: usize,
    },
    /// Damping of a link.
    Damping(usize),
    /// Offset of the foot of a link along its direction.
    Offset(usize),
    /// A parameter of the law of a link.
    Law {
        /// Which link.
        link: usize,
        /// Which parameter.
        parameter: LawParameter,
    },
    /// Centre of a group, the reference point of its moments, along an axis, from L.
    Center {
        /// Which group.
        group: usize,
        /// Which axis.
        axis: usize,
    },
    /// Mass of a payload.
    PayloadMass(usize),
    /// Centre of mass of a payload along an axis, from L.
    PayloadCenterOfMass {
        /// Which payload.
        payload: usize,
        /// Which axis.
        axis: usize,
    },
    /// Factor on the accelerations of the motion.
    Acceleration,
    /// Factor on its external loads.
    Wrench,
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = |axis: usize| *["x", "y", "z"].get(axis).unwrap_or(&"?");
        match *self {
            Self::Mass => f.write_str("body.mass"),
            Self::CenterOfMass(i) => write!(f, "body.center_of_mass.{}", axis(i)),
            Self::Inertia(i, j) => write!(f, "body.inertia.{}{}", axis(i), axis(j)),
            Self::Gravity(i) => write!(f, "gravity.{}", axis(i)),
            Self::Point { link, axis: i } => write!(f, "links[{link}].point.{}", axis(i)),
            Self::Damping(link) => write!(f, "links[{link}].damping"),
            Self::Offset(link) => write!(f, "links[{link}].offset"),
            Self::Law { link, parameter } => write!(f, "links[{link}].{}", parameter.name()),
            Self::Center { group, axis: i } => write!(f, "centers[{group}].{}", axis(i)),
            Self::PayloadMass(payload) => write!(f, "payloads[{payload}].mass"),
            Self::PayloadCenterOfMass { payload, axis: i } => {
                write!(f, "payloads[{payload}].center_of_mass.{}", axis(i))
            }
            Self::Acceleration => f.write_str("factor on the acceleration"),
            Self::Wrench => f.write_str("factor on the external load"),
        }
    }
}

/// A changed number as a function of the values of a sample: `constant + Σ factor * value[column]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The number that is set.
    pub target: Target,
    /// Its value if all terms are zero.
    pub constant: f64,
    /// Columns and factors.
    pub terms: Vec<(usize, f64)>,
}

impl Change {
    /// The number for a sample.
    #[inline]
    pub fn at(&self, values: &[f64]) -> f64 {
        self.terms.iter().fold(self.constant, |sum, &(column, factor)| sum + factor * values[column])
    }
}
