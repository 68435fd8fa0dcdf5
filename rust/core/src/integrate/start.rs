//! The state in which a run starts.

use nalgebra::{Matrix6, Vector6};

use crate::equations::Riders;
use crate::error::RunError;
use crate::excitation::{Excitation, Forcing};
use crate::model::Dof;
use crate::numeric::float::add_columns;
use crate::output::{position, velocity};
use crate::system::{NO_INPUT, State, System};

/// The state in which a run starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Static equilibrium under the weight.
    AtRest,
    /// Static equilibrium under the weight and the first sample of the excitation, at rest in the travelling frame: as if that acceleration,
    /// that external load and the inertia forces and weights of moving riders had acted for a long time.
    QuasiStatic,
    /// A given state.
    State {
        /// `(u, φ)` of L in the travelling frame, sag included: m, rad.
        position: Vector6<f64>,
        /// Its rate: m/s, rad/s.
        velocity: Vector6<f64>,
    },
}

impl Start {
    /// The state on a system, under an excitation with this forcing.
    pub(super) fn state(
        self,
        system: &System,
        forcing: &Forcing,
        riders: &Riders,
        excitation: &Excitation,
    ) -> Result<State, RunError> {
        match self {
            Self::AtRest => Ok([0.0; 12]),
            Self::QuasiStatic => {
                let mut first = [0.0; 9];
                forcing.sample(excitation, 0, &mut first);
                let mut force = riders.first_force();
                add_columns(&mut force, forcing.influence(), &first);
                system.quasi_static(&force).map_err(|motion| RunError::NoQuasiStaticState { motion })
            }
            Self::State { position, velocity } => {
                for (component, value) in position.iter().chain(&velocity).enumerate() {
                    let held = Dof::ALL.get(component % 6).is_some_and(|dof| !system.free().contains(*dof));
                    if !value.is_finite() || held && *value != 0.0 {
                        return Err(RunError::StartState { component, got: *value, held });
                    }
                }
                Ok(system.state_of(&position, &velocity))
            }
        }
    }
}

impl Start {
    /// The start of a machine whose mass changes while it moves: `from` in the state `end` becomes `to`, for instance because it grips or
    /// releases a payload. `kept`: the masses that are on it before and after.
    ///
    /// What joins was at rest in the travelling frame, what leaves goes with its velocity: the position does not change, and the momentum of
    /// the free degrees of freedom after it is that of the kept masses before it, `M⁺ q'⁺ = M q'⁻` (an inelastic impact). The impulse of the
    /// held degrees of freedom is that of the drive.
    pub fn after_change(from: &System, end: &State, kept: &System, to: &System) -> Self {
        Self::after_change_of_mass(from, end, &kept.matrices().mass, to)
    }

    /// [`Start::after_change`] by the mass matrix of the kept masses.
    pub(crate) fn after_change_of_mass(from: &System, end: &State, kept: &Matrix6<f64>, to: &System) -> Self {
        let [position, before] =
            [position(from), velocity(from)].map(|of| Vector6::from(of.at(end, &NO_INPUT)));
        let after = to.matrices().mass;
        if after == *kept {
            return Self::State { position, velocity: before };
        }
        // The mass matrix of a body is positive definite, so that there is a solution; if not, the start is refused as not finite.
        let velocity = to.solved(after, kept * before);
        Self::State { position, velocity }
    }
}
