//! Derivatives of a system: matrices, static position, loads at rest, stiffness in the modes.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::error::SensitivityError;
use super::scene::{LinkNumbers, SceneDerivative};
use crate::equations::SegmentEquations;
use crate::model::LawDerivative;
use crate::output::{Axes, Part, Wrench};
use crate::system::{Force, LinkRow, ModelLevel, System};
use crate::variation::{Base, Group, Instance, Plan};

/// A system with given values, and its derivatives by each column of them.
#[derive(Debug, Clone)]
pub struct VariedSystem {
    /// The system.
    pub system: System,
    /// Its derivatives by each column.
    pub derivatives: Vec<SystemDerivative>,
    /// Centres of the groups, m from L.
    pub centers: Vec<Vector3<f64>>,
    /// Factors on the accelerations of the motion and on its external loads.
    pub factors: [f64; 2],
    /// If it is the system that holds while all links stay on some segments of their laws.
    pub(super) on_segments: Option<OnSegments>,
}

/// Derivatives of a system by one column of values.
#[derive(Debug, Clone)]
pub struct SystemDerivative {
    /// Of the mass matrix.
    pub mass: Matrix6<f64>,
    /// Of the damping matrix.
    pub damping: Matrix6<f64>,
    /// Of the stiffness matrix at rest.
    pub stiffness: Matrix6<f64>,
    /// Of the weight.
    pub weight: Vector6<f64>,
    /// Of the static position `(u, φ)`.
    pub static_position: Vector6<f64>,
    /// Of each link.
    pub links: Vec<LinkDerivative>,
    /// Of the centres of the groups.
    pub centers: Vec<Vector3<f64>>,
    /// Of the factors on the accelerations of the motion and on its external loads.
    pub factors: [f64; 2],
}

/// Derivatives of a link at rest.
#[derive(Debug, Clone, Copy)]
pub struct LinkDerivative {
    /// Of its row d, the deflection per unit of `(u, φ)`.
    pub row: Vector6<f64>,
    /// Of its point.
    pub point: Vector3<f64>,
    /// Of its stiffness in the modes.
    pub stiffness: f64,
    /// Of its damping.
    pub damping: f64,
    /// Of its deflection at rest.
    pub rest: f64,
    /// Of its elastic load at rest.
    pub load: f64,
    /// Of its law.
    pub(super) law: LawDerivative,
}

impl LinkDerivative {
    /// Of its deflection rate per unit of `η'`, with the mode shapes as they are.
    pub(super) fn rate(&self, system: &System) -> [f64; 6] {
        (system.shapes().transpose() * self.row).into()
    }
}

/// What the equations of a system whose links are on some segments of their laws have beyond those of a linear one.
#[derive(Debug, Clone)]
pub(super) struct OnSegments {
    pub equations: SegmentEquations,
    /// Derivatives of the constant force by each column, with the mass matrix as it is.
    pub constants: Vec<Force>,
}

impl VariedSystem {
    /// The system of a base with these values, one for each column, that carries some of its payloads.
    ///
    /// # Errors
    /// [`SensitivityError`].
    pub fn new(
        base: &Base,
        plan: &Plan,
        values: &[f64],
        carried: &[usize],
    ) -> Result<Self, SensitivityError> {
        if base.base_compliance.is_some() {
            return Err(SensitivityError::ElasticBase);
        }
        let mut instance = Instance::new(base)?;
        plan.apply(base, values, &mut instance)?;
        let system = System::new(&instance.scene_of(instance.carrying(carried))?)?;
        if let Some(motion) = system.free_at_rest().next() {
            return Err(SensitivityError::Loose { motion: motion / motion.amax() });
        }
        if let Some(link) = system.rows().iter().position(is_at_edge) {
            return Err(SensitivityError::AtEdge { link, deflection: system.rows()[link].rest });
        }
        let derivative = |column| {
            let scene = SceneDerivative::new(base, plan, (&instance, values), carried, column)?;
            Ok::<_, SensitivityError>(SystemDerivative::new(&system, &scene))
        };
        let derivatives = (0..values.len()).map(derivative).collect::<Result<Vec<_>, _>>()?;
        let (centers, factors) = (instance.centers().to_vec(), instance.factors());
        Ok(Self { derivatives, centers, factors, system, on_segments: None })
    }

    /// Indices of the links without stiffness at rest, which enter the modes with their nominal stiffness.
    pub fn out_of_contact(&self) -> impl Iterator<Item = usize> {
        let rows = self.system.rows().iter().enumerate();
        rows.filter(|(_, row)| !row.slope_at_rest().1).map(|(link, _)| link)
    }

    /// The load of the group with this index, along its axes and about its centre.
    ///
    /// # Panics
    /// If there is no such group.
    pub fn group_load(&self, index: usize, group: &Group, part: Part) -> Wrench<'_> {
        group.load(&self.system, self.centers[index], part)
    }

    /// Centre of a group and its derivative, and its axes.
    pub(super) fn place(&self, column: usize, index: usize, group: &Group) -> ([Vector3<f64>; 2], Axes) {
        ([self.centers[index], self.derivatives[column].centers[index]], group.axes)
    }
}

/// Distance from an edge, relative to the deflections there, within which a link is at the edge.
const AT_EDGE: f64 = 1e-9;

fn is_at_edge(row: &LinkRow) -> bool {
    let near = |edge: &f64| (row.rest - edge).abs() <= AT_EDGE * f64::max(row.rest.abs(), edge.abs());
    row.link.law().edges().iter().any(near)
}

impl SystemDerivative {
    fn new(system: &System, scene: &SceneDerivative) -> Self {
        let rows = system.rows();
        let mut numbers = vec![LinkNumbers::default(); rows.len()];
        for &(link, of) in &scene.links {
            numbers[link] = of;
        }
        let q = system.static_position();
        // Equilibrium: Σ d F(d·q - e) = Q.
        let mut force = scene.weight;
        let mut links = Vec::with_capacity(rows.len());
        for (row, of) in rows.iter().zip(&numbers) {
            let law = row.link.law();
            let moment = of.point.cross(&row.link.direction());
            let turned = Vector6::new(0.0, 0.0, 0.0, moment.x, moment.y, moment.z);
            let rest = turned.dot(&q) - of.offset;
            let load = law.force_derivative(row.rest, &of.law) + row.slope_at_rest().0 * rest;
            force -= turned * row.load + row.link.row() * load;
            let (point, damping, law) = (of.point, of.damping, of.law);
            links.push(LinkDerivative { row: turned, point, stiffness: 0.0, damping, rest, load, law });
        }
        let moved = displacement(system, &force);
        let (mut damping, mut stiffness) = (Matrix6::zeros(), Matrix6::zeros());
        for ((row, of), link) in rows.iter().zip(&numbers).zip(&mut links) {
            let (law, d) = (row.link.law(), row.link.row());
            let further = d.dot(&moved);
            let (slope, in_modes) = row.slope_at_rest();
            link.rest += further;
            link.load += slope * further;
            link.stiffness = if in_modes {
                law.tangent_derivative(row.rest, &of.law) + law.curvature(row.rest) * link.rest
            } else {
                law.nominal_derivative(&of.law)
            };
            add_link(&mut stiffness, (row.stiffness, link.stiffness), (&d, &link.row));
            add_link(&mut damping, (row.link.damping(), of.damping), (&d, &link.row));
        }
        Self {
            mass: scene.mass,
            damping,
            stiffness,
            weight: scene.weight,
            static_position: moved,
            links,
            centers: scene.centers.clone(),
            factors: scene.factors,
        }
    }
}

/// Adds the derivative of `k d dᵀ`.
fn add_link(to: &mut Matrix6<f64>, (k, by_k): (f64, f64), (d, by_d): (&Vector6<f64>, &Vector6<f64>)) {
    to.ger(by_k, d, d, 1.0);
    to.ger(k, by_d, d, 1.0);
    to.ger(k, d, by_d, 1.0);
}

/// Displacement `(u, φ)` under a small additional force at rest, with the slopes of all laws.
fn displacement(system: &System, force: &Vector6<f64>) -> Vector6<f64> {
    let (n, frequency) = (system.mode_count(), system.frequencies());
    let modal = system.shapes().transpose() * force;
    // In energy coordinates: the identity plus what links lack whose stiffness in the modes is not their slope.
    let mut stiffness = Matrix6::<f64>::identity();
    let mut right = Vector6::zeros();
    for mode in 0..n {
        right[mode] = modal[mode] / frequency[mode];
    }
    let mut moved = right;
    if system.model_level() != ModelLevel::Linear && !system.rows().iter().all(|row| row.slope_at_rest().1) {
        stiffness.fill(0.0);
        for row in system.rows() {
            let d = Vector6::from(row.deflection);
            stiffness.ger(row.slope_at_rest().0, &d, &d, 1.0);
        }
        for mode in n..6 {
            stiffness[(mode, mode)] = 1.0;
        }
        moved = stiffness.cholesky().map_or(Vector6::repeat(f64::NAN), |factors| factors.solve(&right));
    }
    system.position_of(&moved.into())
}
