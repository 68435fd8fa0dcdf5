//! Derivatives of the loads of links and groups of links as functions of the state.

use nalgebra::Vector3;

use super::system::{SystemDerivative, VariedSystem};
use crate::output::{Axes, Linear, Part};
use crate::variation::Group;

impl VariedSystem {
    /// Derivative of the load of a link at rest by a column, N per its unit.
    ///
    /// # Panics
    /// If there is no such column or link.
    pub fn static_link_load(&self, column: usize, link: usize) -> f64 {
        link_load(self, column, link, Part::Total).constant[0]
    }

    /// Derivative of the load of the group with this index at rest by a column, along its axes and about its centre.
    ///
    /// # Panics
    /// If there is no such column or group.
    pub fn static_group_load(&self, column: usize, index: usize, group: &Group) -> [f64; 6] {
        let links = group.links.iter().copied();
        group_load(self, column, links, self.place(column, index, group), Part::Total).constant
    }
}

/// Derivative of the load of a link along its direction at a fixed state, linearised at rest.
pub(super) fn link_load(varied: &VariedSystem, column: usize, link: usize, part: Part) -> Linear<1> {
    let mut out = Linear::NOTHING;
    add(&mut out, varied, &varied.derivatives[column], (link, part), &[1.0]);
    out
}

/// Derivative of the load of a group of links about a center at a fixed state, linearised at rest. `center`: the point and its derivative.
pub(super) fn group_load(
    varied: &VariedSystem,
    column: usize,
    links: impl IntoIterator<Item = usize>,
    (center, axes): ([Vector3<f64>; 2], Axes),
    part: Part,
) -> Linear<6> {
    let by = &varied.derivatives[column];
    let mut out = Linear::NOTHING;
    for link in links {
        let row = &varied.system.rows()[link];
        let direction = row.link.direction();
        let o = axes.components(direction);
        let m = axes.components((row.link.point() - center[0]).cross(&direction));
        let s = axes.components((by.links[link].point - center[1]).cross(&direction));
        add(&mut out, varied, by, (link, part), &[o.x, o.y, o.z, m.x, m.y, m.z]);
        let load = (row.load, &row.elastic, &row.damping);
        add_load(&mut out, load, part, &[0.0, 0.0, 0.0, s.x, s.y, s.z]);
    }
    out
}

/// Adds the derivative of the load of a link times `direction`.
fn add<const ROWS: usize>(
    to: &mut Linear<ROWS>,
    varied: &VariedSystem,
    by: &SystemDerivative,
    (link, part): (usize, Part),
    direction: &[f64; ROWS],
) {
    let (row, of) = (&varied.system.rows()[link], &by.links[link]);
    let turned = of.rate(&varied.system);
    let frequency = varied.system.frequencies();
    let (mut elastic, mut damping) = ([0.0; 6], [0.0; 6]);
    for mode in 0..varied.system.mode_count() {
        elastic[mode] = of.stiffness * row.deflection[mode] + row.stiffness * turned[mode] / frequency[mode];
        damping[mode] = of.damping * row.rate[mode] + row.link.damping() * turned[mode];
    }
    add_load(to, (of.load, &elastic, &damping), part, direction);
}

/// Adds the elastic and the damping load of a link times `direction`.
fn add_load<const ROWS: usize>(
    to: &mut Linear<ROWS>,
    (load, elastic, damping): (f64, &[f64; 6], &[f64; 6]),
    part: Part,
    direction: &[f64; ROWS],
) {
    if part != Part::Damping {
        to.add_elastic((load, elastic), direction);
    }
    if part != Part::Elastic {
        to.add_damping(damping, direction);
    }
}
