//! From the states of a run to the measures, a block of instants at a time: nothing is stored, and only what the measures ask for is computed.

use super::measure::{Measure, Quantity, Statistic, time_weights, travel_weights};
use super::power::Power;
use super::rows::{BLOCK, Block, Rows};
use crate::error::RunError;
use crate::excitation::Excitation;
use crate::float::{fma, sqrt};
use crate::record::Record;
use crate::simd::{Kernel, widest_of_all};
use crate::system::{Input, State};

/// A history that something is made of, by the rows of loads that it needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Track {
    Row(usize),
    /// Of two rows, `√(y² + z²)`.
    Resultant(usize, usize),
    /// Of two rows, `|y| + |z|`, to the power of the mean load.
    Load(usize, usize),
}

/// One load: a component of a group's, or the drive force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Row {
    Of(usize, usize),
    Drive,
}

/// Where the number of a measure comes from.
#[derive(Debug, Clone, Copy)]
enum Output {
    Statistic(usize, Statistic),
    Mean(usize),
    Contact(usize),
    Nothing,
}

/// What the measures ask for, each thing once.
#[derive(Debug, Clone)]
pub(super) struct Needs {
    pub rows: Vec<Row>,
    /// Groups whose contact is watched.
    pub contacts: Vec<usize>,
    pub tracks: Vec<Wanted>,
    outputs: Vec<Output>,
    /// Weights of the samples in time and in travel; no travel for a motion that never moves, or says nothing of it.
    pub time: Vec<f64>,
    pub travel: Vec<f64>,
    pub power: Power,
}

/// A track, and what is asked of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    pub track: Track,
    pub extremes: bool,
    /// And when they were.
    pub times: bool,
    pub squares: bool,
}

impl Needs {
    pub(super) fn new(
        measures: &[Measure],
        drive_is_held: bool,
        excitation: &Excitation,
        speed: Option<&[f64]>,
        exponent: f64,
    ) -> Self {
        let travel = speed.and_then(|speed| travel_weights(excitation, speed));
        let mut needs = Self {
            rows: Vec::new(),
            contacts: Vec::new(),
            tracks: Vec::new(),
            outputs: Vec::new(),
            time: time_weights(excitation),
            travel: travel.unwrap_or_default(),
            power: Power::new(exponent),
        };
        for &measure in measures {
            let output = match measure {
                Measure::Load(group, quantity, statistic) => {
                    let track = match quantity {
                        Quantity::Resultant => {
                            Track::Resultant(needs.row(Row::Of(group, 1)), needs.row(Row::Of(group, 2)))
                        }
                        component => Track::Row(needs.row(Row::Of(group, component as usize))),
                    };
                    Output::Statistic(needs.track(track, Some(statistic)), statistic)
                }
                Measure::Drive(statistic) if drive_is_held => {
                    let track = Track::Row(needs.row(Row::Drive));
                    Output::Statistic(needs.track(track, Some(statistic)), statistic)
                }
                Measure::MeanLoad(group) if !needs.travel.is_empty() => {
                    let track = Track::Load(needs.row(Row::Of(group, 1)), needs.row(Row::Of(group, 2)));
                    Output::Mean(needs.track(track, None))
                }
                Measure::Drive(_) | Measure::MeanLoad(_) => Output::Nothing,
                Measure::ContactLost(group) => Output::Contact(place(&mut needs.contacts, group)),
            };
            needs.outputs.push(output);
        }
        needs
    }

    fn row(&mut self, row: Row) -> usize {
        place(&mut self.rows, row)
    }

    fn track(&mut self, track: Track, statistic: Option<Statistic>) -> usize {
        let index = match self.tracks.iter().position(|wanted| wanted.track == track) {
            Some(index) => index,
            None => {
                self.tracks.push(Wanted { track, extremes: false, times: false, squares: false });
                self.tracks.len() - 1
            }
        };
        let wanted = &mut self.tracks[index];
        match statistic {
            Some(Statistic::Start) | None => {}
            Some(Statistic::Rms) => wanted.squares = true,
            Some(Statistic::Min | Statistic::Max) => wanted.extremes = true,
            Some(Statistic::TimeOfMin | Statistic::TimeOfMax) => {
                (wanted.extremes, wanted.times) = (true, true);
            }
        }
        index
    }

    /// One number per measure to `out`, of what is known of each track and of whether each watched group lost contact.
    pub(super) fn put(&self, excitation: &Excitation, tallies: &[Tally], lost: &[bool], out: &mut [f64]) {
        for (to, output) in out.iter_mut().zip(&self.outputs) {
            *to = match *output {
                Output::Statistic(track, statistic) => {
                    let tally = &tallies[track];
                    match statistic {
                        Statistic::Min => tally.smallest,
                        Statistic::TimeOfMin => excitation.time(tally.at_smallest),
                        Statistic::Max => tally.largest,
                        Statistic::TimeOfMax => excitation.time(tally.at_largest),
                        Statistic::Rms => sqrt(tally.sum),
                        Statistic::Start => tally.start,
                    }
                }
                Output::Mean(track) => self.power.root(tallies[track].sum),
                Output::Contact(index) => f64::from(u8::from(lost[index])),
                Output::Nothing => f64::NAN,
            };
        }
    }

    /// Whether the excitation reaches a row other than through the state.
    pub(super) fn drive(&self) -> bool {
        self.rows.contains(&Row::Drive)
    }
}

/// The place of an item, which it gets at the end if it has none.
fn place<T: PartialEq + Copy>(items: &mut Vec<T>, item: T) -> usize {
    items.iter().position(|known| *known == item).unwrap_or_else(|| {
        items.push(item);
        items.len() - 1
    })
}

/// What is known of a track so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tally {
    pub smallest: f64,
    pub largest: f64,
    /// At which instants.
    pub at_smallest: usize,
    pub at_largest: usize,
    /// Weighted sum of squares, or of powers.
    pub sum: f64,
    pub start: f64,
}

const NONE: Tally = Tally {
    smallest: f64::INFINITY,
    largest: f64::NEG_INFINITY,
    at_smallest: 0,
    at_largest: 0,
    sum: 0.0,
    start: 0.0,
};

/// Memory of a worker.
#[derive(Debug)]
pub(super) struct Memory {
    pub rows: Rows,
    block: Block,
    tallies: Vec<Tally>,
    lost: Vec<bool>,
}

impl Memory {
    pub(super) fn new() -> Self {
        Self { rows: Rows::new(), block: Block::new(), tallies: Vec::new(), lost: Vec::new() }
    }
}

/// Reduces one run.
#[derive(Debug)]
pub(super) struct Reduce<'a> {
    needs: &'a Needs,
    excitation: &'a Excitation<'a>,
    memory: &'a mut Memory,
    /// Instants before the present block, and in it.
    before: usize,
    filled: usize,
}

impl<'a> Reduce<'a> {
    /// A reduction by the rows that stand in `memory`.
    pub(super) fn new(needs: &'a Needs, excitation: &'a Excitation<'a>, memory: &'a mut Memory) -> Self {
        memory.tallies.clear();
        memory.tallies.resize(needs.tracks.len(), NONE);
        memory.lost.clear();
        memory.lost.resize(needs.contacts.len(), false);
        Self { needs, excitation, memory, before: 0, filled: 0 }
    }

    /// Ends the reduction: one number per measure to `out`.
    pub(super) fn finish(mut self, out: &mut [f64]) {
        self.flush();
        self.needs.put(self.excitation, &self.memory.tallies, &self.memory.lost, out);
    }

    #[inline(never)]
    fn flush(&mut self) {
        if self.filled > 0 {
            widest_of_all(Flush(self));
            self.before += self.filled;
            self.filled = 0;
        }
    }
}

impl Record for Reduce<'_> {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        Ok(())
    }

    fn looks_at_input(&self) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.memory.block.set(self.filled, state);
        self.filled += 1;
        if self.filled == BLOCK {
            self.flush();
        }
    }
}

/// Takes up a block.
struct Flush<'a, 'b>(&'a mut Reduce<'b>);

impl Kernel for Flush<'_, '_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Reduce { needs, excitation, memory, before, filled } = self.0;
        let Memory { rows, block, tallies, lost } = &mut **memory;
        let (before, filled) = (*before, *filled);
        // What is past the end is as the last instant, and counts nowhere.
        block.pad(filled);
        if needs.drive() {
            block.set_inputs(excitation, before, filled);
        }
        rows.evaluate(block, lost);
        for (wanted, tally) in needs.tracks.iter().zip(tallies) {
            let mut values = [0.0; BLOCK];
            match wanted.track {
                Track::Row(row) => values = rows.values[row],
                Track::Resultant(y, z) => {
                    let (y, z) = (&rows.values[y], &rows.values[z]);
                    for i in 0..BLOCK {
                        values[i] = sqrt(fma(y[i], y[i], z[i] * z[i]));
                    }
                }
                Track::Load(y, z) => {
                    let (y, z) = (&rows.values[y], &rows.values[z]);
                    for i in 0..BLOCK {
                        values[i] = y[i].abs() + z[i].abs();
                    }
                }
            }
            if before == 0 {
                tally.start = values[0];
            }
            if let Track::Load(..) = wanted.track {
                needs.power.raise(&mut values);
                tally.sum += weighted(&values, &needs.travel[before..before + filled]);
                continue;
            }
            if wanted.extremes {
                let (smallest, largest) = extremes(&values);
                if smallest < tally.smallest {
                    tally.smallest = smallest;
                    tally.at_smallest = before + first(&values, smallest);
                }
                if largest > tally.largest {
                    tally.largest = largest;
                    tally.at_largest = before + first(&values, largest);
                }
            }
            if wanted.squares {
                for value in &mut values {
                    *value *= *value;
                }
                tally.sum += weighted(&values, &needs.time[before..before + filled]);
            }
        }
    }
}

/// Side by side in the loops over a block: two AVX2 registers.
const LANES: usize = 8;

#[cfg_attr(feature = "std", inline(always))]
fn extremes(values: &[f64; BLOCK]) -> (f64, f64) {
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    for chunk in values.as_chunks::<LANES>().0 {
        for i in 0..LANES {
            low[i] = if chunk[i] < low[i] { chunk[i] } else { low[i] };
            high[i] = if chunk[i] > high[i] { chunk[i] } else { high[i] };
        }
    }
    let (mut smallest, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..LANES {
        smallest = if low[i] < smallest { low[i] } else { smallest };
        largest = if high[i] > largest { high[i] } else { largest };
    }
    (smallest, largest)
}

/// The first place of a value that is there.
#[cfg_attr(feature = "std", inline(always))]
fn first(values: &[f64; BLOCK], value: f64) -> usize {
    let mut found = BLOCK - 1;
    for i in (0..BLOCK).rev() {
        found = if values[i] == value { i } else { found };
    }
    found
}

/// `Σ weight * value` over as many as there are weights.
#[cfg_attr(feature = "std", inline(always))]
fn weighted(values: &[f64; BLOCK], weights: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (chunks, rest) = weights.as_chunks::<LANES>();
    for (values, weights) in values.as_chunks::<LANES>().0.iter().zip(chunks) {
        for i in 0..LANES {
            sums[i] = fma(values[i], weights[i], sums[i]);
        }
    }
    for (i, weight) in rest.iter().enumerate() {
        sums[i] = fma(values[weights.len() - rest.len() + i], *weight, sums[i]);
    }
    let mut sum = 0.0;
    for part in sums {
        sum += part;
    }
    sum
}
