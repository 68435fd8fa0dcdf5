//! Values and derivatives of a linear run at any instants: by a part of an interval from the sample before each of them.
//!
//! A data logger has its own clock, so that its stamps lie anywhere between the samples of the motion. Between these the excitation is
//! linear, so that a part of an interval is passed as exactly as a whole one.

use std::slice;

use super::error::SensitivityError;
use super::histories::{History, Tangents};
use super::rows::{Operands, Quantity, apply, combined};
use super::steps::by_series;
use super::system::VariedSystem;
use super::tangents::{Interval, MIN_OCCURRENCES, Prepared};
use crate::equations::{Equations, PowerSeries};
use crate::error::Stopped;
use crate::excitation::Excitation;
use crate::integrate::{Output, check_output};
use crate::numeric::float::times;
use crate::numeric::simd::dispatch_once;
use crate::numeric::watch::{Watch, check_memory};
use crate::system::{Input, State};
use crate::variation::Group;

/// What the quantities of a run depend on at some instants, and its derivatives.
#[derive(Debug, Clone)]
pub struct Instants {
    states: Vec<State>,
    /// By time.
    rates: Vec<State>,
    /// By each column, (column, instant).
    tangents: Vec<State>,
    inputs: Vec<Input>,
    /// By time; of the interval that starts there, where two meet.
    slopes: Vec<Input>,
    components: Vec<usize>,
}

/// Where an instant lies: the sample before it, and the time since then, s.
#[derive(Debug, Clone, Copy)]
struct Place {
    sample: usize,
    since: f64,
}

impl History {
    /// The run at instants, in ascending order.
    ///
    /// # Errors
    /// [`SensitivityError::BetweenSamples`]; [`SensitivityError::Run`] for an instant that is not in order or not within the excitation, and
    /// [`SensitivityError::Stopped`].
    pub fn at(
        &self,
        Tangents(tangents): &Tangents,
        (varied, excitation): (&VariedSystem, &Excitation),
        times: &[f64],
        watch: Watch,
    ) -> Result<Instants, SensitivityError> {
        if !self.is_linear() {
            return Err(SensitivityError::BetweenSamples);
        }
        check_output(Output::Times(times), excitation)?;
        let count = times.len().saturating_mul(varied.derivatives.len() + 4);
        check_memory(count.saturating_mul(size_of::<State>()))?;
        let places = places(excitation, times);
        let legs = Legs::new(excitation, &places);
        let prepared = &Prepared::new(varied, excitation, (legs.intervals, legs.lengths));
        let slopes: Vec<Input> = places.iter().map(|at| slope(excitation, at.sample)).collect();
        let inputs: Vec<Input> =
            places.iter().zip(&slopes).map(|(at, slope)| input(excitation, at, slope, at.since)).collect();
        let components = prepared.forcing.components().to_vec();
        let parts = Parts {
            varied,
            prepared,
            excitation,
            places: &places,
            slopes: &slopes,
            samples: self.states(),
            tangents,
            watch,
        };
        let [states, rates, tangents] = dispatch_once!(parts.pass()).ok_or(Stopped::Interrupted)?;
        Ok(Instants { states, rates, tangents, inputs, slopes, components })
    }
}

fn places(excitation: &Excitation, times: &[f64]) -> Vec<Place> {
    let place = |&time: &f64| {
        let sample = excitation.sample_before(time);
        Place { sample, since: time - excitation.time(sample) }
    };
    times.iter().map(place).collect()
}

/// How instants are reached from their samples: by the propagator of a length that many of them nearly have, and on by a series, which is
/// short then. Stamps of two clocks whose rates have a common multiple have few such lengths, but for rounding.
struct Legs {
    intervals: Vec<Interval>,
    lengths: Vec<(usize, f64)>,
}

/// Parts of the longest interval whose instants share a propagator.
const BINS: f64 = 64.0;

impl Legs {
    fn new(excitation: &Excitation, places: &[Place]) -> Self {
        let longest = (1..excitation.count()).map(|k| excitation.interval(k - 1)).fold(0.0, f64::max);
        let bin = |at: &Place| (at.since / longest * BINS) as usize;
        let mut counts = vec![0; BINS as usize + 1];
        let last = counts.len() - 1;
        places.iter().for_each(|at| counts[usize::min(bin(at), last)] += 1);
        let (mut index, mut lengths) = (vec![None; counts.len()], Vec::new());
        let interval = |at: &Place| {
            let bin = usize::min(bin(at), last);
            if at.since == 0.0 {
                return Interval::Jump;
            }
            if counts[bin] < MIN_OCCURRENCES {
                return Interval::Series;
            }
            Interval::Propagator(*index[bin].get_or_insert_with(|| {
                lengths.push((0, at.since));
                lengths.len() - 1
            }))
        };
        let intervals = places.iter().map(interval).collect();
        Self { intervals, lengths }
    }
}

/// The input some time after a sample, from its slope there.
fn input(excitation: &Excitation, at: &Place, slope: &Input, since: f64) -> Input {
    let start = excitation.input(at.sample);
    core::array::from_fn(|i| start[i] + since * slope[i])
}

/// Slope of the excitation after a sample; at the last one, before it.
fn slope(excitation: &Excitation, sample: usize) -> Input {
    let from = usize::min(sample, excitation.count().saturating_sub(2));
    let length = if from + 1 < excitation.count() { excitation.interval(from) } else { 0.0 };
    if length == 0.0 {
        return [0.0; 9];
    }
    let (start, end) = (excitation.input(from), excitation.input(from + 1));
    core::array::from_fn(|i| (end[i] - start[i]) / length)
}

/// Passes the parts of intervals up to all instants.
struct Parts<'a> {
    varied: &'a VariedSystem,
    prepared: &'a Prepared,
    excitation: &'a Excitation<'a>,
    places: &'a [Place],
    slopes: &'a [Input],
    samples: &'a [State],
    tangents: &'a [State],
    watch: Watch<'a>,
}

impl Parts<'_> {
    /// States, their derivatives by time, and tangents; None if the watch stopped it.
    #[inline(always)]
    fn pass(self) -> Option<[Vec<State>; 3]> {
        let Self { varied, prepared, excitation, places, slopes, samples, tangents, watch } = self;
        let (system, columns, count) = (&varied.system, prepared.columns.len(), places.len());
        let Prepared { intervals, recurring, forcing, .. } = prepared;
        let (mut states, mut out) = (Vec::with_capacity(count), vec![[0.0; 12]; columns * count]);
        // Inputs at the ends of the propagators.
        let mut ends = Vec::with_capacity(count);
        for (i, at) in places.iter().enumerate() {
            let (start, state) = (excitation.input(at.sample), &samples[at.sample]);
            if let Interval::Propagator(index) = intervals[i] {
                ends.push([start, input(excitation, at, &slopes[i], recurring[index].length)]);
                let [start, end] = ends[i].map(|input| forcing.values_of(&input));
                states.push(recurring[index].propagator.apply(state, &start, &end));
            } else {
                ends.push([start; 2]);
                states.push(*state);
            }
        }
        // Column by column, so that its matrices stay in the nearest cache.
        for column in 0..columns {
            for (i, at) in places.iter().enumerate() {
                let tangent = &tangents[column * samples.len() + at.sample];
                out[column * count + i] = match intervals[i] {
                    Interval::Propagator(index) => {
                        let ends = ends[i].map(|input| forcing.values_of(&input));
                        recurring[index].step(column, tangent, &samples[at.sample], &ends)
                    }
                    _ => *tangent,
                };
            }
        }
        let series = PowerSeries::new(system);
        let mut there = vec![[0.0; 12]; columns];
        for (i, at) in places.iter().enumerate() {
            if watch.stops_at(i) {
                return None;
            }
            let passed =
                if let Interval::Propagator(index) = intervals[i] { recurring[index].length } else { 0.0 };
            if at.since == passed {
                continue;
            }
            for column in 0..columns {
                there[column] = out[column * count + i];
            }
            let ends = [ends[i][1], input(excitation, at, &slopes[i], at.since)];
            let rest = (at.since - passed, &states[i], &ends);
            let columns_by = (&prepared.columns[..], &series);
            states[i] = by_series(system, system.influence(), columns_by, rest, &mut there);
            for column in 0..columns {
                out[column * count + i] = there[column];
            }
        }
        let mut rates = Vec::with_capacity(count);
        for (i, at) in places.iter().enumerate() {
            let force = times(system.influence(), &input(excitation, at, &slopes[i], at.since));
            rates.push(system.linear(&states[i], &force));
        }
        Some([states, rates, out])
    }
}

/// Where [`Instants::write`] writes, (instant, number), the derivatives by columns (column, instant, number).
#[derive(Debug)]
pub struct Outputs<'a> {
    /// The values.
    pub values: &'a mut [f64],
    /// Their derivatives by time.
    pub slopes: &'a mut [f64],
    /// Their derivatives by each column.
    pub derivatives: &'a mut [f64],
}

impl Instants {
    /// Number of instants.
    pub fn count(&self) -> usize {
        self.states.len()
    }

    /// The inputs, and their derivatives by time.
    pub fn inputs(&self) -> [&[Input]; 2] {
        [&self.inputs, &self.slopes]
    }

    /// Writes sums of the numbers of a quantity with factors `along` (number, width of the quantity). Returns whether all are finite.
    ///
    /// # Panics
    /// If a length is not as stated.
    pub fn write(
        &self,
        (varied, groups): (&VariedSystem, &[Group]),
        (quantity, along): (Quantity, &[f64]),
        out: Outputs,
    ) -> bool {
        let width = quantity.width(varied, groups);
        let (count, numbers) = (self.count(), along.len().checked_div(width).unwrap_or(0));
        let per_column = count * numbers;
        assert_eq!(out.values.len(), per_column, "room for every value");
        assert_eq!(out.slopes.len(), per_column, "room for every slope");
        assert_eq!(out.derivatives.len(), varied.derivatives.len() * per_column, "room for every derivative");
        let at = Operands {
            states: &self.states,
            tangents: &self.states,
            inputs: &self.inputs,
            components: &self.components,
        };
        let mut own = combined(&quantity.rows(varied, groups, None), along, width);
        let all = 0..count;
        let all = slice::from_ref(&all);
        let mut finite = apply(&own, at, all, out.values);
        own.iter_mut().for_each(|row| row.constant = 0.0);
        finite &=
            apply(&own, Operands { tangents: &self.rates, inputs: &self.slopes, ..at }, all, out.slopes);
        for column in 0..varied.derivatives.len() {
            let rows = combined(&quantity.rows(varied, groups, Some(column)), along, width);
            let tangents = &self.tangents[column * count..(column + 1) * count];
            let out = &mut out.derivatives[column * per_column..(column + 1) * per_column];
            finite &= apply(&rows, Operands { tangents, ..at }, all, out);
        }
        finite
    }
}
