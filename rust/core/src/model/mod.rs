//! Description of a machine: body, riders, degrees of freedom, elastic laws, links, and the scene of them all.

mod body;
mod dof;
mod law;
mod link;
mod rider;
mod scene;

pub use body::Body;
pub use dof::{Dof, Free};
pub(crate) use law::LawDerivative;
pub use law::{Law, LawParameter, MAX_CURVE_POINTS};
pub(crate) use law::{ball_compressions, ball_force, forces};
pub use link::{Link, carriage_ends, carriage_links};
pub use rider::Rider;
pub use scene::Scene;
