//! Derivatives of the loads of links and groups of links as functions of the state.

use nalgebra::Vector6;

use super::system::{SystemDerivative, VariedSystem};
use crate::output::{Axes, Linear, Part};
use crate::system::LinkRow;

/// Derivative of the load of a link along its direction at a fixed state, linearised at rest.
pub(crate) fn link_load(varied: &VariedSystem, column: usize, link: usize, part: Part) -> Linear<1> {
    let mut out = Linear::NOTHING;
    add(&mut out, varied, &varied.derivatives[column], (link, part), [1.0]);
    out
}

/// Derivative of the load of a group of links about its centre at a fixed state, linearised at rest. `group`: its index among the centres.
pub(crate) fn group_load(
    varied: &VariedSystem,
    column: usize,
    (group, links, axes): (usize, &[usize], Axes),
    part: Part,
) -> Linear<6> {
    let by = &varied.derivatives[column];
    let mut out = Linear::NOTHING;
    for &link in links {
        let row = &varied.system.rows()[link];
        let direction = row.link.direction();
        let along = axes.components(direction);
        let moment = axes.components((row.link.point() - varied.centers[group]).cross(&direction));
        let shifted = axes.components((by.links[link].point - by.centers[group]).cross(&direction));
        let [o, m, s] = [along, moment, shifted];
        add(&mut out, varied, by, (link, part), [o.x, o.y, o.z, m.x, m.y, m.z]);
        add_load(&mut out, row, part, [0.0, 0.0, 0.0, s.x, s.y, s.z]);
    }
    out
}

/// Adds the derivative of the load of a link times `direction`.
fn add<const ROWS: usize>(
    to: &mut Linear<ROWS>,
    varied: &VariedSystem,
    by: &SystemDerivative,
    (link, part): (usize, Part),
    direction: [f64; ROWS],
) {
    let (row, of) = (&varied.system.rows()[link], &by.links[link]);
    let turned: Vector6<f64> = varied.system.shapes().transpose() * of.row;
    let frequency = varied.system.frequencies();
    for (entry, &factor) in direction.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
        if part != Part::Damping {
            to.constant[entry] += factor * of.load;
        }
        for mode in 0..varied.system.mode_count() {
            let elastic =
                of.stiffness * row.deflection[mode] + row.stiffness * turned[mode] / frequency[mode];
            let damping = of.damping * row.rate[mode] + row.link.damping() * turned[mode];
            if part != Part::Damping {
                to.by_state[mode][entry] += factor * elastic;
            }
            if part != Part::Elastic {
                to.by_state[6 + mode][entry] += factor * damping;
            }
        }
    }
}

/// Adds the load of a link times `direction`.
fn add_load<const ROWS: usize>(to: &mut Linear<ROWS>, row: &LinkRow, part: Part, direction: [f64; ROWS]) {
    for (entry, &factor) in direction.iter().enumerate() {
        if part != Part::Damping {
            to.constant[entry] += factor * row.load;
        }
        for mode in 0..6 {
            if part != Part::Damping {
                to.by_state[mode][entry] += factor * row.elastic[mode];
            }
            if part != Part::Elastic {
                to.by_state[6 + mode][entry] += factor * row.damping[mode];
            }
        }
    }
}
