//! Load rows: the loads of a sample at the instants of a block.

use super::requirements::{LoadRow, Requirements};
use crate::excitation::Excitation;
use crate::model::Law;
use crate::output::{Part, Wrench, evaluate_block, reaction, transpose};
use crate::system::{LinkRow, State, System};
use crate::variation::{Group, Instance};

/// Number of instants of a block, so small that their states stay in the first-level cache.
pub(super) const BLOCK: usize = 64;

/// One number at each instant of a block.
pub(super) type Values = [f64; BLOCK];

/// States and excitation at the instants of a block.
#[derive(Debug)]
pub(super) struct StateBlock {
    pub states: [State; BLOCK],
    /// The same, entry by entry.
    pub entries: [Values; 12],
    /// Set if they are needed.
    pub inputs: [Values; 9],
}

impl StateBlock {
    pub(super) fn new() -> Self {
        Self { states: [[0.0; 12]; BLOCK], entries: [[0.0; BLOCK]; 12], inputs: [[0.0; BLOCK]; 9] }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn set(&mut self, at: usize, state: &State) {
        self.states[at] = *state;
    }

    /// Fills the rest of the block with its last instant, and sets the entries.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn complete(&mut self, filled: usize) {
        let last = self.states[filled - 1];
        self.states[filled..].fill(last);
        transpose(&self.states, &mut self.entries);
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

/// The loads of one system that the measures need.
#[derive(Debug)]
pub(super) struct LoadRows<'a> {
    /// With the row of each component that is needed.
    loads: Vec<(Wrench<'a>, [Option<usize>; 6])>,
    /// Nonlinear links that are monitored for contact, with the index of their group.
    monitored: Vec<(&'a LinkRow, usize)>,
}

impl<'a> LoadRows<'a> {
    /// The loads of the system of a sample.
    pub(super) fn new(
        system: &'a System,
        requirements: &Requirements,
        sample: &Instance,
        groups: &[Group],
    ) -> Self {
        let row_of = |row: LoadRow| requirements.rows.iter().position(|known| *known == row);
        let mut loads = Vec::new();
        for (group, of) in groups.iter().enumerate() {
            let rows = core::array::from_fn(|component| row_of(LoadRow::Group { component, group }));
            if rows != [None; 6] {
                loads.push((of.load(system, sample.centers()[group], Part::Total), rows));
            }
        }
        if let Some(row) = row_of(LoadRow::Drive) {
            let load = reaction(system).scaled(sample.factors());
            loads.push((load, [Some(row), None, None, None, None, None]));
        }
        let mut monitored = Vec::new();
        for (index, &group) in requirements.contacts.iter().enumerate() {
            let rows = groups[group].links.iter().map(|&link| &system.rows()[link]);
            monitored.extend(rows.filter(|row| !row.link.law().is_linear()).map(|row| (row, index)));
        }
        Self { loads, monitored }
    }

    /// Evaluates all rows at a block, and marks in `lost` the groups that lose contact in it.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn evaluate(&self, block: &StateBlock, values: &mut [Values], lost: &mut [bool]) {
        for &(row, group) in &self.monitored {
            if !lost[group] {
                lost[group] = is_lost(row.link.law(), &row.deflections(&block.entries));
            }
        }
        self.set_rows(block, values);
    }

    /// Evaluates all rows at a block.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn set_rows(&self, block: &StateBlock, values: &mut [Values]) {
        let StateBlock { states, entries, inputs } = block;
        let mut components = [[0.0; BLOCK]; 8];
        for (load, rows) in &self.loads {
            let mut needed = [false; 6];
            for component in 0..6 {
                needed[component] = rows[component].is_some();
            }
            evaluate_block(load, &needed, (entries, inputs), states, &mut components);
            for component in 0..6 {
                if let Some(row) = rows[component] {
                    values[row] = components[component];
                }
            }
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
