//! Derivatives of the quantities of a run with preloaded links: what the laws bend away from their slopes at rest adds to those of linear links.

use std::iter;

use nalgebra::{Vector3, Vector6};

use super::error::SensitivityError;
use super::rows::Quantity;
use super::smooth::{NonlinearResiduals, SmoothSystem};
use super::smooth_run::SmoothRun;
use super::system::VariedSystem;
use crate::error::RunError;
use crate::excitation::Excitation;
use crate::model::Dof;
use crate::numeric::float::{add_columns, add_scaled, times};
use crate::numeric::watch::{Watch, check_memory};
use crate::output::{Part, Recovery, acceleration, reaction};
use crate::system::{NO_FORCE, State};
use crate::variation::Group;

/// Row of a quantity, place of a nonlinear link, and what a newton of it adds there.
type Share = (usize, usize, f64);

impl SmoothSystem {
    /// The system, its states at the samples of a run and their derivatives (column, sample).
    ///
    /// # Errors
    /// [`SensitivityError::ContactDamper`]; and those of a run.
    pub(super) fn run(
        varied: &VariedSystem,
        excitation: &Excitation,
        quasi_static: bool,
        watch: Watch,
    ) -> Result<(Self, Vec<State>, Vec<State>), SensitivityError> {
        if let Some(link) = varied.system.links().position(|link| link.is_damped_in_contact()) {
            return Err(SensitivityError::ContactDamper { link });
        }
        let count = (varied.derivatives.len() + 1).saturating_mul(excitation.count());
        check_memory(count.saturating_mul(size_of::<State>()))?;
        let mut start = [0.0; 12];
        if quasi_static {
            let force = times(varied.system.influence(), &excitation.input(0));
            start = varied
                .system
                .quasi_static(&force)
                .map_err(|motion| RunError::NoQuasiStaticState { motion })?;
        }
        let smooth = Self::new(varied);
        let run = SmoothRun { smooth: &smooth, varied, excitation, watch };
        let (states, tangents) = run.run(start, quasi_static)?;
        Ok((smooth, states, tangents))
    }

    /// Adds to the derivatives of a quantity by each column, (column, sample, width), what the laws bend.
    pub(super) fn add_bends(
        &self,
        (varied, groups): (&VariedSystem, &[Group]),
        (states, tangents): (&[State], &[State]),
        quantity: Quantity,
        wanted: impl Fn(usize) -> bool,
        out: &mut [f64],
    ) {
        let (count, width) = (states.len(), quantity.width(varied, groups));
        let shares = self.shares(varied, groups, quantity);
        if shares.is_empty() {
            return;
        }
        let turned: Vec<Vec<Share>> = (0..self.columns.len())
            .map(|column| self.turned_shares((varied, groups), quantity, column))
            .collect();
        let (mut residuals, mut slopes) = (NonlinearResiduals::default(), vec![0.0; self.links.len()]);
        for sample in (0..count).filter(|&sample| wanted(sample)) {
            self.set_residuals(varied, &states[sample], &mut residuals);
            for (column, turned) in turned.iter().enumerate() {
                let at = column * count + sample;
                for (place, slope) in slopes.iter_mut().enumerate() {
                    let run = (&states[sample], &tangents[at]);
                    *slope = self.bend_derivative((varied, column), place, &residuals, run);
                }
                let out = &mut out[at * width..(at + 1) * width];
                for &(row, place, share) in &shares {
                    out[row] += share * slopes[place];
                }
                for &(row, place, share) in turned {
                    out[row] += share * residuals.of_links[place][1];
                }
            }
        }
    }

    /// What the load of each nonlinear link adds to a quantity.
    fn shares(&self, varied: &VariedSystem, groups: &[Group], quantity: Quantity) -> Vec<Share> {
        match quantity {
            Quantity::LinkLoads(Part::Damping) | Quantity::Position | Quantity::Velocity => Vec::new(),
            Quantity::LinkLoads(_) => {
                self.links.iter().enumerate().map(|(place, &link)| (link, place, 1.0)).collect()
            }
            Quantity::GroupLoads(part) => {
                let loads = groups.iter().enumerate().flat_map(|(index, group)| {
                    self.shares_of(varied, &varied.group_load(index, group, part), 6 * index)
                });
                loads.collect()
            }
            Quantity::Acceleration => self.shares_of(varied, &acceleration(&varied.system), 0),
            Quantity::Reaction => self.shares_of(varied, &reaction(&varied.system), 0),
        }
    }

    fn shares_of(&self, varied: &VariedSystem, quantity: &Recovery<6>, from: usize) -> Vec<Share> {
        let rows = varied.system.rows();
        let place = |row| self.links.iter().position(|&link| core::ptr::eq(&rows[link], row));
        let links = quantity.nonlinear.as_slice().iter();
        let placed = links.filter_map(|link| Some((place(link.row)?, link.elastic)));
        placed.flat_map(|(place, elastic)| shares(from, place, &elastic.into())).collect()
    }

    /// Derivatives of the shares by a column.
    fn turned_shares(
        &self,
        (varied, groups): (&VariedSystem, &[Group]),
        quantity: Quantity,
        column: usize,
    ) -> Vec<Share> {
        let by = &varied.derivatives[column];
        let places = || self.links.iter().enumerate();
        match quantity {
            Quantity::LinkLoads(_) | Quantity::Position | Quantity::Velocity => Vec::new(),
            Quantity::GroupLoads(Part::Damping) => Vec::new(),
            Quantity::GroupLoads(_) => {
                let of_group = |(index, group): (usize, &Group)| {
                    let ([_, moved], axes) = varied.place(column, index, group);
                    let members = places().filter(|(_, link)| group.links.contains(link));
                    let all = members.flat_map(|(place, &link)| {
                        let direction = varied.system.rows()[link].link.direction();
                        let moment = axes.components((by.links[link].point - moved).cross(&direction));
                        shares(6 * index, place, &stacked(Vector3::zeros(), moment))
                    });
                    all.collect::<Vec<_>>()
                };
                groups.iter().enumerate().flat_map(of_group).collect()
            }
            Quantity::Acceleration => {
                let all = places()
                    .map(|(place, _)| shares(0, place, &self.turned_acceleration(varied, column, place)));
                all.flatten().collect()
            }
            Quantity::Reaction => {
                let held = |row: usize| !varied.system.free().contains(Dof::ALL[row]);
                let all = places().flat_map(|(place, &link)| {
                    let rate = Vector6::from(varied.system.rows()[link].rate);
                    let mut share =
                        varied.system.matrices().mass * self.turned_acceleration(varied, column, place);
                    share -= by.mass * (varied.system.shapes() * rate);
                    share += by.links[link].row;
                    shares(0, place, &share)
                });
                all.filter(|&(row, ..)| held(row)).collect()
            }
        }
    }

    /// Derivative of the acceleration of L per newton of a nonlinear link.
    fn turned_acceleration(&self, varied: &VariedSystem, column: usize, place: usize) -> Vector6<f64> {
        let (of, row) = (&self.columns[column], &varied.system.rows()[self.links[place]]);
        let mut modal = NO_FORCE;
        if let Some(turned) = &of.turned {
            add_scaled(&mut modal, &turned[place], -1.0);
        }
        if let Some(mass) = &of.mass {
            add_columns(&mut modal, mass, &row.rate);
        }
        varied.system.shapes() * Vector6::from_column_slice(&modal[..6])
    }
}

fn shares(from: usize, place: usize, rows: &Vector6<f64>) -> impl Iterator<Item = Share> + use<> {
    let rows: [f64; 6] = (*rows).into();
    let all = rows.into_iter().enumerate().zip(iter::repeat(place));
    all.map(move |((row, share), place)| (from + row, place, share)).filter(|(.., share)| *share != 0.0)
}

fn stacked(force: Vector3<f64>, moment: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}
