//! Acceleration, reactions and drive forces of a body with moving riders, whose mass matrix depends on their travel.

use nalgebra::{Vector3, Vector6};

use super::loads::{Part, Wrench, group_load, position, velocity};
use crate::excitation::MAX_RIDERS;
use crate::model::Rider;
use crate::system::{Input, State, System};

/// A body with riders: the quantities that depend on their motion.
#[derive(Debug, Clone)]
pub struct BodyWithRiders<'a> {
    system: &'a System,
    riders: &'a [Rider],
    position: Wrench<'a>,
    velocity: Wrench<'a>,
    links: Wrench<'a>,
}

/// Quantities of a body with riders at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyWithRidersInstant {
    /// Acceleration `(u'', φ'')` of L in the travelling frame: m/s², rad/s².
    pub acceleration: [f64; 6],
    /// Reactions of the held degrees of freedom, N and N m; zero for free ones.
    pub reaction: [f64; 6],
    /// Force and moment about L by which the motion of the riders differs from riders that stand at travel zero, N and N m.
    pub wrench: [f64; 6],
    /// Force of the drive on each rider along its direction, N; zero past the number of riders.
    pub drive: [f64; MAX_RIDERS],
}

impl<'a> BodyWithRiders<'a> {
    /// The body of a system that includes the riders at travel zero; only the first [`MAX_RIDERS`] count.
    pub fn new(system: &'a System, riders: &'a [Rider]) -> Self {
        let riders = &riders[..usize::min(riders.len(), MAX_RIDERS)];
        let links = group_load(system, 0..system.links().len(), Vector3::zeros(), Part::Total);
        Self { system, riders, position: position(system), velocity: velocity(system), links }
    }

    /// The quantities at a state and excitation; `travel`: travel (m), speed (m/s) and acceleration (m/s²) of each rider.
    pub fn at(&self, travel: &[[f64; 3]], state: &State, input: &Input) -> BodyWithRidersInstant {
        let (system, gravity) = (self.system, self.system.gravity());
        let vectors =
            |six: [f64; 6]| [Vector3::new(six[0], six[1], six[2]), Vector3::new(six[3], six[4], six[5])];
        let [_, turn] = vectors(self.position.at(state, input));
        let [_, turning] = vectors(self.velocity.at(state, input));
        let drive = Vector3::new(input[0], input[1], input[2]);
        // Acceleration of a rider's centre of mass relative to the point of the body where it is.
        let relative = |rider: &Rider, [_, speed, acceleration]: [f64; 3]| {
            let direction = rider.direction();
            turning.cross(&direction) * (2.0 * speed) + (direction + turn.cross(&direction)) * acceleration
        };
        let mut mass = system.matrices().mass;
        let mut force = system.matrices().weight - Vector6::from(self.links.at(state, input));
        force += Vector6::from_column_slice(&input[3..]);
        let mut wrench = Vector6::zeros();
        for (rider, &moved) in self.riders.iter().zip(travel) {
            let (start, now) = (rider.body(), rider.at(moved[0]));
            mass += now.mass_matrix() - start.mass_matrix();
            // `weight` is the force on a body in a field: here of gravity, and of the relative acceleration.
            wrench += now.weight(&(gravity - relative(rider, moved))) - start.weight(&gravity);
        }
        force += wrench;
        force -= mass.fixed_columns::<3>(0) * drive;
        let acceleration = system.solved(mass, force);
        let mut reaction = mass * acceleration - force;
        let change = mass - system.matrices().mass;
        wrench -= change * acceleration + change.fixed_columns::<3>(0) * drive;
        for dof in system.free().iter() {
            reaction[dof as usize] = 0.0;
        }
        let [linear, angular] = vectors(acceleration.into());
        let mut drives = [0.0; MAX_RIDERS];
        for ((rider, &moved), to) in self.riders.iter().zip(travel).zip(&mut drives) {
            let arm = rider.at(moved[0]).center_of_mass();
            let total = drive - gravity + linear + angular.cross(&arm) + relative(rider, moved);
            let along = rider.direction() + turn.cross(&rider.direction());
            *to = rider.body().mass() * along.dot(&total);
        }
        BodyWithRidersInstant {
            acceleration: acceleration.into(),
            reaction: reaction.into(),
            wrench: wrench.into(),
            drive: drives,
        }
    }
}
