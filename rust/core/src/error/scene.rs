//! Errors of scenes.

use core::fmt;

use nalgebra::{Vector3, Vector6};

/// Why a scene is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneError {
    /// Mass not positive.
    Mass {
        /// kg.
        got: f64,
    },
    /// NaN or infinity in a field.
    NotFinite {
        /// Its path.
        field: &'static str,
    },
    /// A number that is too large or too small to compute with.
    OutOfRange {
        /// Which one, or of what.
        what: &'static str,
    },
    /// Inertia tensor that is not symmetric.
    InertiaAsymmetric {
        /// Largest difference of mirrored entries, kg m².
        by: f64,
    },
    /// Inertia about the centre of mass that is not positive definite.
    InertiaNotPositive {
        /// Principal moments, ascending, kg m².
        principal: [f64; 3],
    },
    /// Principal moments of which the largest exceeds the sum of the others.
    InertiaTriangle {
        /// Principal moments, ascending, kg m².
        principal: [f64; 3],
    },
    /// Link direction without length.
    Direction {
        /// As given.
        got: [f64; 3],
    },
    /// Negative or non-finite number of a carriage.
    Carriage {
        /// Index of the carriage, in the order in which they are added.
        index: usize,
        /// Its field.
        field: &'static str,
        /// Unit of the field.
        unit: &'static str,
        /// As given.
        got: f64,
    },
    /// Negative or non-finite stiffness.
    Stiffness {
        /// N/m.
        got: f64,
    },
    /// Negative or non-finite stiffness of a side, or both zero.
    Sides {
        /// When the body moves along the link's direction, N/m.
        positive: f64,
        /// When the body moves against the link's direction, N/m.
        negative: f64,
    },
    /// Negative or non-finite clearance.
    Clearance {
        /// m.
        got: f64,
    },
    /// Stiffness of a preloaded law that is not positive.
    PreloadedStiffness {
        /// N/m.
        got: f64,
    },
    /// Preload that is not positive.
    Preload {
        /// N.
        got: f64,
    },
    /// Exponent outside 1 to 2.
    Exponent {
        /// As given.
        got: f64,
    },
    /// Too few or too many points of a curve.
    CurvePoints {
        /// Most points of a curve.
        max: usize,
        /// Points.
        got: usize,
    },
    /// Deflections of a curve out of order.
    CurveOrder {
        /// At which point, from 0.
        index: usize,
        /// Deflection of the point before, m.
        before: f64,
        /// Its own, m.
        got: f64,
    },
    /// A curve whose force decreases.
    CurveFalls {
        /// At which point, from 0.
        index: usize,
        /// Force of the point before, N.
        before: f64,
        /// Its own, N.
        got: f64,
    },
    /// A curve with the same force everywhere.
    CurveFlat {
        /// That force, N.
        load: f64,
    },
    /// Factor on a law that is not positive, or leaves the range of numbers.
    Factor {
        /// As given.
        got: f64,
    },
    /// Parameter that a law of this kind does not have.
    NoParameter {
        /// Name of the parameter.
        parameter: &'static str,
        /// Kind of the law.
        law: &'static str,
    },
    /// Negative or non-finite damping.
    Damping {
        /// N s/m.
        got: f64,
    },
    /// Link with neither stiffness nor damping.
    IdleLink,
    /// Damping only in contact, on a link without clearance.
    AlwaysInContact,
    /// Compliance of the base that is not symmetric and positive semidefinite.
    BaseCompliance {
        /// Smallest eigenvalue, with a diagonal of ones, less the asymmetry.
        smallest: f64,
    },
    /// Nonlinear law of a link on an elastic base.
    NonlinearOnBase {
        /// Index of the link.
        link: usize,
        /// Kind of its law.
        law: &'static str,
    },
    /// No free degree of freedom.
    NothingFree,
    /// No link.
    NoLinks,
    /// More links than fit without an allocator.
    TooManyLinks {
        /// Most links.
        max: usize,
        /// Links of the scene.
        got: usize,
    },
    /// No static equilibrium: the weight drives the body out of its links.
    NoEquilibrium {
        /// The motion `(u, φ)` in which the body leaves, largest entry 1.
        motion: Vector6<f64>,
    },
    /// Links that hold the weight so softly that the body rests far away.
    FarEquilibrium {
        /// The motion `(u, φ)` from the unloaded position to rest, largest entry 1.
        motion: Vector6<f64>,
        /// Travel of the body in it, m.
        travel: f64,
    },
    /// No link resists a motion of the free degrees of freedom.
    Unsupported {
        /// That motion `(u, φ)`, largest entry 1.
        motion: Vector6<f64>,
        /// Number of independent such motions.
        count: usize,
    },
}

impl fmt::Display for SceneError {
    // Long: one arm per error, so that all messages are in one place.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mass { got } => write!(f, "body.mass: expected > 0 kg, got {got}"),
            Self::NotFinite { field } => write!(f, "{field}: expected finite numbers"),
            Self::OutOfRange { what } => write!(f, "{what} is too large or too small: check the units"),
            Self::InertiaAsymmetric { by } => {
                write!(f, "body.inertia: expected a symmetric tensor, mirrored entries differ by {by} kg m2")
            }
            Self::InertiaNotPositive { principal: [a, b, c] } => write!(
                f,
                "body.inertia: no body has the principal moments {a:.6}, {b:.6}, {c:.6} kg m2 about its centre of mass: \
                 all must be > 0; is the tensor about L rather than about the centre of mass?"
            ),
            Self::InertiaTriangle { principal: [a, b, c] } => write!(
                f,
                "body.inertia: no body has the principal moments {a:.6}, {b:.6}, {c:.6} kg m2 about its centre of mass: \
                 the largest exceeds the sum of the others by {:.6} (triangle rule); are products of inertia given with \
                 the wrong sign, or is the tensor about another point?",
                c - a - b
            ),
            Self::Direction { got: [x, y, z] } => {
                write!(f, "direction: expected a vector with a length, got ({x}, {y}, {z})")
            }
            Self::Carriage { index, field, unit, got } => {
                write!(f, "carriages[{index}].{field}: expected a finite number >= 0 {unit}, got {got}")
            }
            Self::Stiffness { got } => write!(f, "stiffness: expected >= 0 N/m, got {got}"),
            Self::Sides { positive, negative } => write!(
                f,
                "stiffness: expected >= 0 N/m on either side and > 0 on one, got positive {positive}, negative {negative}"
            ),
            Self::Clearance { got } => write!(
                f,
                "clearance: expected >= 0 m to either side, got {got}; parts pressed together have a preload instead"
            ),
            Self::PreloadedStiffness { got } => {
                write!(f, "stiffness: expected > 0 N/m beside a preload, the stiffness at no load, got {got}")
            }
            Self::Preload { got } => {
                write!(
                    f,
                    "preload: expected > 0 N, got {got}; without preload leave it out, play is a clearance"
                )
            }
            Self::Exponent { got } => {
                write!(f, "exponent: expected > 1 and <= 2, got {got}; balls have 3/2, rollers 10/9")
            }
            Self::CurvePoints { max, got } => {
                write!(f, "curve: expected 2 to {max} points, got {got}")?;
                if got > max {
                    f.write_str("; it is linear in between, so leave out points where it is nearly straight")?;
                }
                Ok(())
            }
            Self::CurveOrder { index, before, got } => write!(
                f,
                "curve[{index}]: expected a deflection > {before} m (the point before), got {got} m; sort the points and \
                 keep one at each deflection"
            ),
            Self::CurveFalls { index, before, got } => write!(
                f,
                "curve[{index}]: expected a force >= {before} N (the point before), got {got} N: no support pushes back \
                 less when pressed more; do deflection and force have the same sign?"
            ),
            Self::CurveFlat { load } => {
                write!(f, "curve: expected a force that rises somewhere, got {load} N at all points")
            }
            Self::Factor { got } => {
                write!(f, "factor: expected > 0 and a law within the range of numbers, got {got}")
            }
            Self::NoParameter { parameter, law } => {
                let has = match *law {
                    "preloaded" => "stiffness, preload and scale",
                    "curve" => "scale",
                    _ => "stiffness, positive_stiffness, negative_stiffness, clearance and scale",
                };
                write!(f, "{parameter}: a {law} law has none; change one of its own: {has}")
            }
            Self::Damping { got } => write!(f, "damping: expected >= 0 N s/m, got {got}"),
            Self::IdleLink => {
                f.write_str("stiffness and damping are both zero; give one, or leave the link out")
            }
            Self::BaseCompliance { smallest } => write!(
                f,
                "base compliance: expected a symmetric, positive semidefinite matrix, got one whose smallest eigenvalue less its asymmetry \
                 is {smallest:e} of its diagonal"
            ),
            Self::NonlinearOnBase { link, law } => write!(
                f,
                "base compliance: expected linear links on an elastic base, got a {law} law of link {link}: put the compliance into the \
                 stiffness of each carriage"
            ),
            Self::NothingFree => f.write_str("free: expected at least one of x y z rx ry rz, got none"),
            Self::NoLinks => f.write_str("links: expected at least one, got none"),
            Self::TooManyLinks { max, got } => {
                write!(
                    f,
                    "links: expected up to {max} without an allocator, got {got}; build with the feature std"
                )
            }
            Self::AlwaysInContact => f.write_str(
                "damping_in_contact: expected a link with a clearance, got one that never leaves its contact; leave it out",
            ),
            Self::NoEquilibrium { motion } => {
                f.write_str("no static equilibrium: the weight is more than the links bear against ")?;
                write_motion(f, motion)?;
                f.write_str("; give the side that bears it a stiffness, or check the direction of gravity")
            }
            Self::FarEquilibrium { motion, travel } => {
                write!(f, "no static equilibrium near the machine: the body would rest {travel:.1e} m away, after a ")?;
                write_motion(f, motion)?;
                f.write_str("; check the stiffness that bears the weight against it, and its unit")
            }
            Self::Unsupported { motion, count } => {
                f.write_str("the body is not supported: nothing resists ")?;
                write_motion(f, motion)?;
                if *count > 1 {
                    write!(f, " (one of {count} such motions)")?;
                }
                f.write_str("; add a carriage or link that does, or hold that degree of freedom")
            }
        }
    }
}

impl core::error::Error for SceneError {}

/// A rigid motion `(u, φ)` in words: a translation along a direction or a rotation about an axis near a point.
pub(super) fn write_motion(f: &mut fmt::Formatter<'_>, motion: &Vector6<f64>) -> fmt::Result {
    let u = motion.fixed_rows::<3>(0).into_owned();
    let phi = motion.fixed_rows::<3>(3).into_owned();
    // A rotation about a point a kilometre away counts as a translation.
    if phi.norm() < 1e-3 * u.norm() {
        f.write_str("translation along ")?;
        return write_direction(f, &u);
    }
    let point = phi.cross(&u) / phi.norm_squared();
    let pitch = phi.dot(&u) / phi.norm_squared();
    f.write_str("rotation about ")?;
    write_direction(f, &phi)?;
    let [x, y, z] = point.map(|c| if c.abs() < 5e-7 { 0.0 } else { c }).into();
    write!(f, " near the point ({x:.3}, {y:.3}, {z:.3}) m")?;
    if pitch.abs() > 1e-6 {
        write!(f, " with a travel of {pitch:.3} m/rad along it")?;
    }
    Ok(())
}

fn write_direction(f: &mut fmt::Formatter<'_>, vector: &Vector3<f64>) -> fmt::Result {
    let unit = vector / vector.norm();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if unit[axis].abs() > 1.0 - 1e-9 {
            return f.write_str(name);
        }
    }
    write!(f, "({:.3}, {:.3}, {:.3})", unit.x, unit.y, unit.z)
}
