//! The lines that load rows follow between the instants of a block: with the rise from one instant to the next, and the mean of the load there.

use nalgebra::{Matrix6, Vector6};

use super::load_rows::{BLOCK, LoadRows, StateBlock, Values};
use crate::excitation::Excitation;
use crate::numeric::float::add_scaled;
use crate::output::{
    INSIDE, Wrench, acceleration, between, contacts, evaluate_block, finer_bow, mark_changes, simpson_bow,
};
use crate::system::{LinkRow, State, System};

/// What gives the accelerations of the modes of a sample.
#[derive(Debug)]
pub(super) struct ModalAcceleration<'a> {
    acceleration: Wrench<'a>,
    momenta: Matrix6<f64>,
    frequency: [f64; 6],
    contacts: Vec<&'a LinkRow>,
}

impl<'a> ModalAcceleration<'a> {
    /// `factors`: of the sample, on accelerations and external loads.
    pub(super) fn new(system: &'a System, factors: [f64; 2]) -> Self {
        Self {
            acceleration: acceleration(system).scaled(factors),
            momenta: system.shapes().transpose() * system.matrices().mass,
            frequency: *system.frequencies(),
            contacts: contacts(system),
        }
    }

    /// Whether a link changes its segment in an interval that ends in the block, by the states at the ends and in the middles.
    #[cfg_attr(feature = "std", inline(always))]
    fn contact_changes(&self, before: &State, block: &StateBlock, middles: &StateBlock) -> [bool; BLOCK] {
        let mut changes = [false; BLOCK];
        for row in &self.contacts {
            let (now, middle) = (row.deflections(&block.entries), row.deflections(&middles.entries));
            let mut then = [row.deflection_at(before); BLOCK];
            then[1..].copy_from_slice(&now[..BLOCK - 1]);
            mark_changes(row.link.law(), [&then, &middle, &now], &mut changes);
        }
        changes
    }
}

/// Lines of one run, block by block.
#[derive(Debug)]
pub(super) struct Lines {
    /// Values of each row at the starts and ends of the intervals that end in the block.
    pub ends: Vec<[Values; 2]>,
    middles: StateBlock,
    /// Rows in the middle of the intervals.
    rows: Vec<Values>,
    /// States and the rows at the same place of all intervals, and the weighted sums of the rows at all places of [`INSIDE`].
    inside: StateBlock,
    rows_inside: Vec<Values>,
    sums: Vec<Values>,
    /// State, accelerations of the modes and rows at the last instant before the block.
    state: State,
    acceleration: [f64; 6],
    last: Vec<f64>,
}

impl Lines {
    pub(super) fn new() -> Self {
        Self {
            ends: Vec::new(),
            middles: StateBlock::new(),
            rows: Vec::new(),
            inside: StateBlock::new(),
            rows_inside: Vec::new(),
            sums: Vec::new(),
            state: [0.0; 12],
            acceleration: [0.0; 6],
            last: Vec::new(),
        }
    }

    pub(super) fn resize(&mut self, rows: usize) {
        self.ends.resize(rows, [[0.0; BLOCK]; 2]);
        for values in [&mut self.rows, &mut self.rows_inside, &mut self.sums] {
            values.resize(rows, [0.0; BLOCK]);
        }
        self.last.resize(rows, 0.0);
    }

    /// Goes on to a block whose first instant has the index `before`; `rows`: the values of the rows at its instants. At standstill no line
    /// is needed; what the next block begins with is.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn set(
        &mut self,
        (loads, modes): (&LoadRows, &ModalAcceleration),
        (block, rows): (&StateBlock, &[Values]),
        excitation: &Excitation,
        before: usize,
        is_moving: bool,
    ) {
        let mut accelerations = [[0.0; BLOCK]; 8];
        evaluate_block(
            &modes.acceleration,
            &[true; 6],
            (&block.entries, &block.inputs),
            &block.states,
            &mut accelerations,
        );
        let of_modes = |i: usize| -> [f64; 6] {
            (modes.momenta * Vector6::from_fn(|row, _| accelerations[row][i])).into()
        };
        if !is_moving {
            (self.state, self.acceleration) = (block.states[BLOCK - 1], of_modes(BLOCK - 1));
            self.last.iter_mut().zip(rows).for_each(|(last, now)| *last = now[BLOCK - 1]);
            return;
        }
        let mut of_instants = [self.acceleration; BLOCK + 1];
        for i in 0..BLOCK {
            of_instants[i + 1] = of_modes(i);
        }
        let states = |i: usize| [if i == 0 { &self.state } else { &block.states[i - 1] }, &block.states[i]];
        let rates = |i: usize| [&of_instants[i], &of_instants[i + 1]];
        // Copies past the end of the motion have no length.
        let length = |i: usize| {
            let interval = (before + i).checked_sub(1).filter(|interval| interval + 1 < excitation.count());
            interval.map(|interval| excitation.interval(interval))
        };
        for i in 0..BLOCK {
            let at = match length(i) {
                Some(length) => between(&modes.frequency, length, states(i), rates(i), 0.5),
                None => block.states[i],
            };
            self.middles.set(i, &at);
        }
        self.middles.complete(BLOCK);
        loads.set_rows(&self.middles, &mut self.rows);
        let changes = modes.contact_changes(&self.state, block, &self.middles);
        if changes != [false; BLOCK] {
            self.sums.fill([0.0; BLOCK]);
            for (at, weight) in INSIDE {
                for i in 0..BLOCK {
                    if changes[i] {
                        let length = length(i).unwrap_or_default();
                        let state = between(&modes.frequency, length, states(i), rates(i), at);
                        self.inside.set(i, &state);
                    }
                }
                self.inside.complete(BLOCK);
                loads.set_rows(&self.inside, &mut self.rows_inside);
                for (sums, rows) in self.sums.iter_mut().zip(&self.rows_inside) {
                    add_scaled(sums, rows, weight);
                }
            }
        }
        (self.state, self.acceleration) = (block.states[BLOCK - 1], of_instants[BLOCK]);
        let lines = self.ends.iter_mut().zip(&mut self.last).zip(rows.iter().zip(&self.rows));
        for (row, ((ends, last), (now, middle))) in lines.enumerate() {
            let mut then = [if before == 0 { now[0] } else { *last }; BLOCK];
            then[1..].copy_from_slice(&now[..BLOCK - 1]);
            for i in 0..BLOCK {
                let mut bow = simpson_bow(middle[i], [then[i], now[i]]);
                if changes[i] {
                    bow = finer_bow(bow, self.sums[row][i], [then[i], now[i]]);
                }
                (ends[0][i], ends[1][i]) = (then[i] + bow, now[i] + bow);
            }
            *last = now[BLOCK - 1];
        }
    }
}
