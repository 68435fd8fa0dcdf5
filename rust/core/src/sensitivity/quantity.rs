//! The quantities that have derivatives along a run.

use crate::output::Part;

/// What is computed from the states of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// A part of the load of each link along its direction, N.
    LinkLoads(Part),
    /// A part of the load of each group about its centre, N and N m.
    GroupLoads(Part),
    /// Position of L in the carriage frame, sag included.
    Position,
    /// Its velocity.
    Velocity,
    /// Its acceleration.
    Acceleration,
    /// Reaction of the held degrees of freedom.
    Reaction,
}
