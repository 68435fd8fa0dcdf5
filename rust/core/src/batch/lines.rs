//! The lines that load rows follow between the instants of a block: with the rise from one instant to the next, and the mean of the load there.

use nalgebra::{Matrix6, Vector6};

use super::load_rows::{BLOCK, LoadRows, StateBlock, Values};
use crate::excitation::Excitation;
use crate::output::{Wrench, acceleration, evaluate_block, middle, simpson_bow};
use crate::system::{Input, State, System};

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

    /// Accelerations of L at a block.
    #[cfg_attr(feature = "std", inline(always))]
    fn at_block(&self, block: &StateBlock) -> [Values; 8] {
        let mut accelerations = [[0.0; BLOCK]; 8];
        let StateBlock { states, entries, inputs } = block;
        evaluate_block(&self.acceleration, &[true; 6], (entries, inputs), states, &mut accelerations);
        accelerations
    }

    /// Those of the modes at one instant of the block.
    #[cfg_attr(feature = "std", inline(always))]
    fn of_modes(&self, accelerations: &[Values; 8], i: usize) -> [f64; 6] {
        (self.momenta * Vector6::from_fn(|row, _| accelerations[row][i])).into()
    }
}

/// A contact change between two samples, at which loads have a corner or jump.
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactChange {
    pub interval: usize,
    /// From the start of the interval, s.
    pub since: f64,
    pub state: State,
}

/// Lines of one run, block by block.
#[derive(Debug)]
pub(super) struct Lines {
    /// Values of each row at the starts and ends of the intervals that end in the block.
    pub ends: Vec<[Values; 2]>,
    middles: StateBlock,
    /// Rows in the middle of the intervals.
    rows: Vec<Values>,
    /// Of the next block.
    pub changes: Vec<ContactChange>,
    pieces: Vec<Piece>,
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
            changes: Vec::new(),
            pieces: Vec::new(),
            state: [0.0; 12],
            acceleration: [0.0; 6],
            last: Vec::new(),
        }
    }

    /// Begins a run.
    pub(super) fn begin(&mut self, rows: usize) {
        self.changes.clear();
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
        let accelerations = modes.at_block(block);
        if !is_moving {
            self.changes.clear();
            (self.state, self.acceleration) =
                (block.states[BLOCK - 1], modes.of_modes(&accelerations, BLOCK - 1));
            self.last.iter_mut().zip(rows).for_each(|(last, now)| *last = now[BLOCK - 1]);
            return;
        }
        let start = self.state;
        for i in 0..BLOCK {
            let (state, acceleration) = (&block.states[i], modes.of_modes(&accelerations, i));
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
        self.set_with_changes((loads, modes), &block.states, &start, excitation, before);
    }

    /// Sets the lines of the intervals with contact changes: the mean of each piece from one change to the next, by its middle. `states`: at the
    /// instants of the block, `start`: at the last one before it.
    #[cfg_attr(feature = "std", inline(always))]
    fn set_with_changes(
        &mut self,
        (loads, modes): (&LoadRows, &ModalAcceleration),
        states: &[State; BLOCK],
        start: &State,
        excitation: &Excitation,
        before: usize,
    ) {
        let Self { pieces, changes, ends, rows, middles, .. } = self;
        for of_interval in changes.chunk_by(|one, next| one.interval == next.interval) {
            let interval = of_interval[0].interval;
            let Some(i) = (interval + 1).checked_sub(before).filter(|i| *i < BLOCK) else { continue };
            let (mut since, mut state) = (0.0, if i == 0 { start } else { &states[i - 1] });
            let length = excitation.interval(interval);
            for change in of_interval {
                pieces.push(Piece {
                    i,
                    interval,
                    since: [since, change.since],
                    ends: [*state, change.state],
                });
                (since, state) = (change.since, &change.state);
            }
            pieces.push(Piece { i, interval, since: [since, length], ends: [*state, states[i]] });
            for [then, now] in ends.iter_mut() {
                let half = 0.5 * (now[i] - then[i]);
                (then[i], now[i]) = (-half, half);
            }
        }
        changes.clear();
        for some in pieces.chunks(BLOCK / 3) {
            let count = some.len();
            for (k, piece) in some.iter().enumerate() {
                let [first, last] = piece.inner_ends();
                middles.set(k, &first);
                middles.set(count + k, &last);
                for (end, since) in piece.since.into_iter().enumerate() {
                    middles.set_input(end * count + k, &piece.input(excitation, since));
                }
            }
            middles.complete(2 * count);
            let accelerations = modes.at_block(middles);
            for (k, piece) in some.iter().enumerate() {
                let [first, last] =
                    [k, count + k].map(|at| (middles.states[at], modes.of_modes(&accelerations, at)));
                let h = piece.since[1] - piece.since[0];
                let state = middle(&modes.frequency, h, [&first.0, &last.0], [&first.1, &last.1]);
                middles.set(2 * count + k, &state);
                middles.set_input(2 * count + k, &piece.input(excitation, piece.since[0] + 0.5 * h));
            }
            middles.complete(3 * count);
            loads.set_rows(middles, rows);
            for (values, ends) in rows.iter().zip(ends.iter_mut()) {
                for (k, piece) in some.iter().enumerate() {
                    let bounds = [values[k], values[count + k]];
                    let share = (piece.since[1] - piece.since[0]) / excitation.interval(piece.interval);
                    let mean =
                        share * (0.5 * (bounds[0] + bounds[1]) + simpson_bow(values[2 * count + k], bounds));
                    for end in ends.iter_mut() {
                        end[piece.i] += mean;
                    }
                }
            }
        }
        pieces.clear();
    }
}

/// A part of an interval between contact changes or samples. The interval ends at instant `i` of the block.
#[derive(Debug, Clone, Copy)]
struct Piece {
    i: usize,
    interval: usize,
    /// Its ends, from the start of the interval, s, and the states there.
    since: [f64; 2],
    ends: [State; 2],
}

/// Share of a piece by which its ends are moved inwards, because loads may jump at a contact change.
const INWARDS: f64 = 1e-9;

impl Piece {
    #[cfg_attr(feature = "std", inline(always))]
    fn inner_ends(&self) -> [State; 2] {
        let ([mut first, mut last], [from, to]) = (self.ends, &self.ends);
        for j in 0..12 {
            first[j] += INWARDS * (to[j] - from[j]);
            last[j] -= INWARDS * (to[j] - from[j]);
        }
        [first, last]
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn input(&self, excitation: &Excitation, since: f64) -> Input {
        excitation.input_between(self.interval, since / excitation.interval(self.interval))
    }
}
