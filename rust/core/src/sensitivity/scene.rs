//! Derivatives of the numbers of a scene by each column of values.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::error::SensitivityError;
use crate::model::{Body, LawDerivative, Link};
use crate::numeric::tensor::skew;
use crate::variation::{Base, Change, Instance, Plan, Target};

/// Derivatives of the numbers of a scene by one column of values.
#[derive(Debug, Clone)]
pub(super) struct SceneDerivative {
    pub mass: Matrix6<f64>,
    pub weight: Vector6<f64>,
    /// Of the links that vary, by their indices, ascending.
    pub links: Vec<(usize, LinkNumbers)>,
    /// Of the centres of the groups.
    pub centers: Vec<Vector3<f64>>,
    /// Of the factors on accelerations and external loads.
    pub factors: [f64; 2],
}

/// Derivatives of the numbers of a link.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LinkNumbers {
    pub point: Vector3<f64>,
    pub damping: f64,
    pub offset: f64,
    pub law: LawDerivative,
}

/// Derivatives of the numbers of a body.
#[derive(Default)]
struct BodyNumbers {
    mass: f64,
    center_of_mass: Vector3<f64>,
    inertia: Matrix3<f64>,
}

impl SceneDerivative {
    /// The derivatives at an instance with these `values` that carries some payloads, by column `column`.
    pub(super) fn new(
        base: &Base,
        plan: &Plan,
        (instance, values): (&Instance, &[f64]),
        carried: &[usize],
        column: usize,
    ) -> Result<Self, SensitivityError> {
        let mut body = BodyNumbers::default();
        let mut payloads: Vec<BodyNumbers> = base.payloads.iter().map(|_| BodyNumbers::default()).collect();
        let mut gravity = Vector3::zeros();
        let mut centers = vec![Vector3::zeros(); base.groups.len()];
        let mut factors = [0.0; 2];
        for (change, rate) in varying(plan.changes(), column) {
            match change.target {
                Target::Mass => body.mass = rate,
                Target::CenterOfMass(axis) => body.center_of_mass[axis] = rate,
                Target::Inertia(i, j) => (body.inertia[(i, j)], body.inertia[(j, i)]) = (rate, rate),
                Target::Gravity(axis) => gravity[axis] = rate,
                Target::Center { group, axis } => centers[group][axis] = rate,
                Target::PayloadMass(payload) => payloads[payload].mass = rate,
                Target::PayloadCenterOfMass { payload, axis } => {
                    payloads[payload].center_of_mass[axis] = rate
                }
                Target::Acceleration => factors[0] = rate,
                Target::Wrench => factors[1] = rate,
                Target::Point { .. } | Target::Damping(_) | Target::Offset(_) | Target::Law { .. } => {}
            }
        }
        let mut mass = body.mass_matrix(instance.body(), base.body.inertia_about_reference);
        for &payload in carried {
            let about_reference = base.payloads[payload].body.inertia_about_reference;
            mass += payloads[payload].mass_matrix(&instance.payloads()[payload], about_reference);
        }
        let whole = instance.carrying(carried).mass_matrix();
        let translations = |m: &Matrix6<f64>, g: Vector3<f64>| m.fixed_columns::<3>(0) * g;
        let weight = translations(&mass, instance.gravity()) + translations(&whole, gravity);
        let links = links(plan.changes(), values, instance.links(), column)?;
        Ok(Self { mass, weight, links, centers, factors })
    }
}

impl BodyNumbers {
    /// Derivative of the mass matrix of a body; `about_reference`: whether its inertia about L stays as it is, instead of that about its
    /// centre of mass.
    fn mass_matrix(&self, of: &Body, about_reference: bool) -> Matrix6<f64> {
        let (arm, turn) = (skew(&of.center_of_mass()), skew(&self.center_of_mass));
        let moment = arm * self.mass + turn * of.mass();
        let mut inertia = self.inertia;
        if !about_reference {
            inertia -= arm * arm * self.mass + (turn * arm + arm * turn) * of.mass();
        }
        let mut out = Matrix6::zeros();
        out.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(self.mass);
        out.fixed_view_mut::<3, 3>(0, 3).copy_from(&-moment);
        out.fixed_view_mut::<3, 3>(3, 0).copy_from(&moment);
        out.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
        out
    }
}

/// The derivatives of all links that column `column` changes.
fn links(
    changes: &[Change],
    values: &[f64],
    links: &[Link],
    column: usize,
) -> Result<Vec<(usize, LinkNumbers)>, SensitivityError> {
    let mut found: Vec<(usize, LinkNumbers)> = Vec::new();
    for (change, rate) in varying(changes, column) {
        let link = match change.target {
            Target::Point { link, .. }
            | Target::Damping(link)
            | Target::Offset(link)
            | Target::Law { link, .. } => link,
            _ => continue,
        };
        if found.last().is_none_or(|(last, _)| *last != link) {
            found.push((link, LinkNumbers::default()));
        }
        let Some((_, to)) = found.last_mut() else { continue };
        match change.target {
            Target::Point { axis, .. } => to.point[axis] = rate,
            Target::Damping(_) => to.damping = rate,
            Target::Offset(_) => to.offset = rate,
            Target::Law { .. } if to.law.is_zero() => {
                to.law = law(changes, values, links, (link, column))?;
            }
            _ => {}
        }
    }
    Ok(found)
}

/// The derivative of the law of a link by a column.
fn law(
    changes: &[Change],
    values: &[f64],
    links: &[Link],
    (of, column): (usize, usize),
) -> Result<LawDerivative, SensitivityError> {
    let parameters = changes.iter().filter_map(|change| match change.target {
        Target::Law { link, parameter } if link == of => {
            Some((parameter, change.at(values), rate_of(change, column)))
        }
        _ => None,
    });
    LawDerivative::new(links[of].law(), parameters)
        .map_err(|parameter| SensitivityError::OneSided { target: Target::Law { link: of, parameter } })
}

/// The changes that depend on a column, and their derivatives by it.
fn varying(changes: &[Change], column: usize) -> impl Iterator<Item = (&Change, f64)> {
    let with = move |change| (change, rate_of(change, column));
    changes.iter().map(with).filter(|(_, rate)| *rate != 0.0)
}

fn rate_of(change: &Change, column: usize) -> f64 {
    change.terms.iter().filter(|(of, _)| *of == column).map(|(_, factor)| factor).sum()
}
