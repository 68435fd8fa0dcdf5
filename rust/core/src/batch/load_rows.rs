//! Load rows: loads at a block of instants, as linear combinations of the entries of the states and of the forces of nonlinear links.

use super::requirements::{LoadRow, Requirements};
use crate::excitation::Excitation;
use crate::model::{Law, forces};
use crate::numeric::float::fma;
use crate::numeric::simd::LANES;
use crate::output::{Part, Wrench, group_load_along, reaction};
use crate::system::{LinkRow, State, System};
use crate::variation::Group;
use nalgebra::Vector3;

/// Number of instants of a block, so small that their states stay in the first-level cache.
pub(super) const BLOCK: usize = 64;

/// One number at each instant of a block.
type Values = [f64; BLOCK];

/// States and excitation at the instants of a block.
#[derive(Debug)]
pub(super) struct StateBlock {
    states: [State; BLOCK],
    /// The same, entry by entry; set when they are needed.
    entries: [Values; 12],
    inputs: [Values; 9],
}

impl StateBlock {
    pub(super) fn new() -> Self {
        Self { states: [[0.0; 12]; BLOCK], entries: [[0.0; BLOCK]; 12], inputs: [[0.0; BLOCK]; 9] }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn set(&mut self, at: usize, state: &State) {
        self.states[at] = *state;
    }

    /// Fills the rest of the block with its last instant.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn pad(&mut self, filled: usize) {
        let last = self.states[filled - 1];
        self.states[filled..].fill(last);
    }

    /// Sets the entries of the states.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn set_entries(&mut self) {
        for (at, state) in self.states.iter().enumerate() {
            for j in 0..12 {
                self.entries[j][at] = state[j];
            }
        }
    }

    /// Sets the excitation from sample `from` on.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn set_inputs(&mut self, excitation: &Excitation, from: usize, filled: usize) {
        for (component, entry) in self.inputs.iter_mut().enumerate() {
            for at in 0..BLOCK {
                entry[at] = excitation.component(from + usize::min(at, filled - 1), component);
            }
        }
    }
}

/// `constant + Σ factor * values[index]`, without terms that are zero.
#[derive(Debug, Clone, Default)]
struct LinearCombination {
    constant: f64,
    /// Terms of the states, the excitation, the forces of links, and the forces of dampers that act in contact only.
    terms: [Vec<(usize, f64)>; 4],
}

impl LinearCombination {
    fn clear(&mut self) {
        self.constant = 0.0;
        for terms in &mut self.terms {
            terms.clear();
        }
    }

    fn add(&mut self, kind: usize, factors: impl Iterator<Item = (usize, f64)>) {
        self.terms[kind].extend(factors.filter(|(_, factor)| *factor != 0.0));
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn at(&self, sources: [&[Values]; 4], out: &mut Values) {
        for quarter in 0..BLOCK / (4 * LANES) {
            let from = quarter * 4 * LANES;
            let mut sums = [[self.constant; LANES]; 4];
            for (terms, source) in self.terms.iter().zip(sources) {
                for &(index, factor) in terms {
                    let column = &source[index].as_chunks::<LANES>().0[from / LANES..from / LANES + 4];
                    for part in 0..4 {
                        for i in 0..LANES {
                            sums[part][i] = fma(column[part][i], factor, sums[part][i]);
                        }
                    }
                }
            }
            for (part, sum) in sums.iter().enumerate() {
                out[from + part * LANES..from + (part + 1) * LANES].copy_from_slice(sum);
            }
        }
    }
}

/// A nonlinear link.
#[derive(Debug, Clone)]
struct NonlinearLink {
    link: usize,
    law: Law,
    deflection: LinearCombination,
    /// Its damper, if that acts in contact only.
    damper: Option<LinearCombination>,
}

/// The loads of one system that the measures need.
#[derive(Debug)]
pub(super) struct LoadRows {
    sums: Vec<LinearCombination>,
    nonlinear: Vec<NonlinearLink>,
    /// Nonlinear links that are monitored for contact, with the index of their group.
    monitored: Vec<(usize, usize)>,
    deflections: Vec<Values>,
    forces: Vec<Values>,
    dampers: Vec<Values>,
    /// The loads at the block.
    pub values: Vec<Values>,
}

impl LoadRows {
    pub(super) fn new() -> Self {
        Self {
            sums: Vec::new(),
            nonlinear: Vec::new(),
            monitored: Vec::new(),
            deflections: Vec::new(),
            forces: Vec::new(),
            dampers: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Sets the rows to those of a system. `factors`: on the accelerations and external loads of the excitation.
    pub(super) fn set_system(
        &mut self,
        system: &System,
        requirements: &Requirements,
        groups: &[Group],
        centers: &[Vector3<f64>],
        factors: [f64; 2],
    ) {
        self.nonlinear.clear();
        self.monitored.clear();
        self.sums.resize_with(requirements.rows.len(), LinearCombination::default);
        self.values.resize(requirements.rows.len(), [0.0; BLOCK]);
        let rows = &requirements.rows;
        // By group, so that the load of each is made once.
        for (group, center) in centers.iter().enumerate() {
            let mut load: Option<Wrench> = None;
            for (index, row) in rows.iter().enumerate() {
                let LoadRow::Group { component, group: of } = *row else { continue };
                if of == group {
                    let links = groups[group].links.iter().copied();
                    let load = load.get_or_insert_with(|| {
                        group_load_along(system, links, *center, groups[group].axes, Part::Total)
                    });
                    self.set(index, system, load, component, factors);
                }
            }
        }
        if let Some(index) = rows.iter().position(|row| *row == LoadRow::Drive) {
            self.set(index, system, &reaction(system), 0, factors);
        }
        for (index, &group) in requirements.contacts.iter().enumerate() {
            for &link in &groups[group].links {
                if !system.rows()[link].link.law().is_linear() {
                    let place = self.nonlinear_place(&system.rows()[link], link);
                    self.monitored.push((place, index));
                }
            }
        }
        for values in [&mut self.deflections, &mut self.forces, &mut self.dampers] {
            values.resize(self.nonlinear.len(), [0.0; BLOCK]);
        }
    }

    /// Sets one row from a load.
    fn set(&mut self, index: usize, system: &System, load: &Wrench, row: usize, factors: [f64; 2]) {
        let mut sum = core::mem::take(&mut self.sums[index]);
        sum.clear();
        sum.constant = load.linear.constant[row];
        sum.add(0, load.linear.by_state.iter().map(|column| column[row]).enumerate());
        if load.linear.by_input_at_all {
            let factor = |component: usize| factors[usize::from(component >= 3)];
            let columns = load.linear.by_input.iter().enumerate();
            sum.add(1, columns.map(|(component, column)| (component, factor(component) * column[row])));
        }
        for known in load.nonlinear.as_slice() {
            let link = system.rows().iter().position(|row| core::ptr::eq(row, known.row)).unwrap_or(0);
            let (elastic, damping) = (known.elastic[row], known.damping[row]);
            if elastic != 0.0 || damping != 0.0 {
                let place = self.nonlinear_place(known.row, link);
                sum.add(2, [(place, elastic)].into_iter());
                sum.add(3, [(place, damping)].into_iter());
            }
        }
        self.sums[index] = sum;
    }

    /// The index of a nonlinear link, which is appended if it is new.
    fn nonlinear_place(&mut self, row: &LinkRow, link: usize) -> usize {
        if let Some(place) = self.nonlinear.iter().position(|known| known.link == link) {
            return place;
        }
        let mut deflection = LinearCombination { constant: row.rest, ..LinearCombination::default() };
        deflection.add(0, row.deflection.iter().copied().enumerate());
        let damper = row.link.is_damped_in_contact().then(|| {
            let mut damper = LinearCombination::default();
            damper.add(0, row.damping.iter().enumerate().map(|(j, load)| (6 + j, *load)));
            damper
        });
        self.nonlinear.push(NonlinearLink { link, law: *row.link.law(), deflection, damper });
        self.nonlinear.len() - 1
    }

    /// Evaluates all rows at a block, and marks in `lost` the groups that lose contact in it.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn evaluate(&mut self, block: &StateBlock, lost: &mut [bool]) {
        let Self { sums, nonlinear, monitored, deflections, forces: elastic, dampers, values, .. } = self;
        let (states, inputs): (&[Values], &[Values]) = (&block.entries, &block.inputs);
        for (place, link) in nonlinear.iter().enumerate() {
            let at = &mut deflections[place];
            link.deflection.at([states, inputs, &[], &[]], at);
            elastic[place] = forces(&link.law, at);
            if let Some(damper) = &link.damper {
                damper.at([states, inputs, &[], &[]], &mut dampers[place]);
                for i in 0..BLOCK {
                    if link.law.tangent(at[i]) == 0.0 {
                        dampers[place][i] = 0.0;
                    }
                }
            }
        }
        for &(link, group) in monitored.iter() {
            if !lost[group] {
                lost[group] = is_lost(&nonlinear[link].law, &deflections[link]);
            }
        }
        for (sum, out) in sums.iter().zip(values) {
            sum.at([states, inputs, elastic, dampers], out);
        }
    }
}

/// Whether a link has no force at one of these deflections or, if preloaded, an open row.
#[cfg_attr(feature = "std", inline(always))]
fn is_lost(law: &Law, at: &Values) -> bool {
    let [from, to, inside] = lost_between(law);
    let mut lost = false;
    for i in 0..BLOCK {
        lost |= (at[i] >= from && at[i] < to) == (inside == 1.0);
    }
    lost
}

/// (from, to, inside): contact is lost at deflections from `from` to below `to` if `inside` is 1, otherwise at all others.
#[cfg_attr(feature = "std", inline(always))]
fn lost_between(law: &Law) -> [f64; 3] {
    let edges = law.edges();
    if !law.is_piecewise_linear() {
        // At an edge itself a row is open.
        return [f64::from_bits(edges[0].to_bits() - 1), edges[1], 0.0];
    }
    for segment in 0..=edges.len() {
        if law.segment(segment) == (0.0, 0.0) {
            let from = if segment == 0 { f64::NEG_INFINITY } else { edges[segment - 1] };
            return [from, edges.get(segment).copied().unwrap_or(f64::INFINITY), 1.0];
        }
    }
    [f64::INFINITY, f64::INFINITY, 1.0]
}
