//! The lines that load rows follow between the instants of a block: with the rise from one instant to the next, and the mean of the load there.

use nalgebra::{Matrix6, Vector6};

use super::load_rows::{BLOCK, LoadRows, StateBlock, Values};
use crate::excitation::Excitation;
use crate::output::{Wrench, acceleration, evaluate_block, middle, simpson_bow};
use crate::system::{State, System};

/// What gives the accelerations of the modes of a sample.
#[derive(Debug)]
pub(super) struct ModalAcceleration<'a> {
    acceleration: Wrench<'a>,
    momenta: Matrix6<f64>,
    frequency: [f64; 6],
}

impl<'a> ModalAcceleration<'a> {
    /// `factors`: of the sample, on accelerations and external loads.
    pub(super) fn new(system: &'a System, factors: [f64; 2]) -> Self {
        Self {
            acceleration: acceleration(system).scaled(factors),
            momenta: system.shapes().transpose() * system.matrices().mass,
            frequency: *system.frequencies(),
        }
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
            state: [0.0; 12],
            acceleration: [0.0; 6],
            last: Vec::new(),
        }
    }

    pub(super) fn resize(&mut self, rows: usize) {
        self.ends.resize(rows, [[0.0; BLOCK]; 2]);
        self.rows.resize(rows, [0.0; BLOCK]);
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
        for i in 0..BLOCK {
            let (state, acceleration) = (&block.states[i], of_modes(i));
            // Copies past the end of the motion have no length.
            let interval = (before + i).checked_sub(1).filter(|interval| interval + 1 < excitation.count());
            let at = match interval {
                Some(interval) => {
                    let (length, ends) = (excitation.interval(interval), [&self.state, state]);
                    middle(&modes.frequency, length, ends, [&self.acceleration, &acceleration])
                }
                None => *state,
            };
            self.middles.set(i, &at);
            (self.state, self.acceleration) = (*state, acceleration);
        }
        self.middles.complete(BLOCK);
        loads.set_rows(&self.middles, &mut self.rows);
        for ((ends, last), (now, middle)) in
            self.ends.iter_mut().zip(&mut self.last).zip(rows.iter().zip(&self.rows))
        {
            let mut then = [if before == 0 { now[0] } else { *last }; BLOCK];
            then[1..].copy_from_slice(&now[..BLOCK - 1]);
            for i in 0..BLOCK {
                let bow = simpson_bow(middle[i], [then[i], now[i]]);
                (ends[0][i], ends[1][i]) = (then[i] + bow, now[i] + bow);
            }
            *last = now[BLOCK - 1];
        }
    }
}
