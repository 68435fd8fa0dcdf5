//! Values and derivatives of a linear run at any instants: by a part of an interval from the sample before each of them.
//!
//! A data logger has its own clock, so that its stamps lie anywhere between the samples of the motion. Between these the excitation is
//! linear, so that a part of an interval is passed as exactly as a whole one.

use std::slice;

use super::equations::ModalDerivative;
use super::error::SensitivityError;
use super::histories::{History, Tangents};
use super::rows::{Operands, Quantity, apply, combined};
use super::steps::{by_series, modal};
use super::system::VariedSystem;
use super::tangents::{Interval, MIN_OCCURRENCES, Prepared, components, intervals};
use crate::equations::{Equations, PowerSeries, Propagator};
use crate::error::Stopped;
use crate::excitation::Excitation;
use crate::integrate::{Output, check_output};
use crate::numeric::simd::{Kernel, dispatch};
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
    /// [`SensitivityError::BetweenSamples`]; [`SensitivityError::Run`] for an instant that is not in order or not within the excitation, and [`SensitivityError::Stopped`].
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
        let (samples, system) = (self.states(), &varied.system);
        let prepared =
            &Prepared::new(varied, intervals(places.iter().map(|at| (Some(0), at.since)), MIN_OCCURRENCES));
        let slopes: Vec<Input> = places.iter().map(|at| slope(excitation, at.sample)).collect();
        let at_start = places.iter().map(|at| excitation.input(at.sample));
        let inputs: Vec<Input> = at_start
            .zip(&slopes)
            .zip(&places)
            .map(|((start, slope), at)| core::array::from_fn(|i| start[i] + at.since * slope[i]))
            .collect();
        let components = components(excitation);
        let parts = Parts {
            varied,
            prepared,
            excitation,
            places: &places,
            inputs: &inputs,
            components: &components,
            samples,
            tangents,
            watch,
        };
        let (states, tangents) = dispatch(parts).ok_or(Stopped::Interrupted)?;
        let force = |input| modal(system.influence(), input);
        let rates =
            states.iter().zip(&inputs).map(|(state, input)| system.linear(state, &force(input))).collect();
        Ok(Instants { states, rates, tangents, inputs, slopes, components })
    }
}

/// Where instants lie. Those at the same distance from their samples but for the rounding of stamps share their propagator.
fn places(excitation: &Excitation, times: &[f64]) -> Vec<Place> {
    let last = excitation.count() - 1;
    let largest = f64::max(excitation.time(0).abs(), excitation.time(last).abs());
    let quantum = STAMP_ROUNDINGS * f64::EPSILON * largest;
    let place = |&time: &f64| {
        let sample = excitation.sample_before(time);
        let since = time - excitation.time(sample);
        Place { sample, since: if quantum > 0.0 { (since / quantum).round() * quantum } else { since } }
    };
    times.iter().map(place).collect()
}

/// Roundings of a stamp that a difference of stamps of two clocks may contain.
const STAMP_ROUNDINGS: f64 = 4.0;

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
    inputs: &'a [Input],
    components: &'a [usize],
    samples: &'a [State],
    tangents: &'a [State],
    watch: Watch<'a>,
}

/// Instants between two looks at the watch.
const BETWEEN: usize = 1024;

impl Kernel for Parts<'_> {
    /// States and tangents; None if the watch stopped it.
    type Output = Option<(Vec<State>, Vec<State>)>;

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> Self::Output {
        let Self { varied, prepared, excitation, places, inputs, components, samples, tangents, watch } =
            self;
        let (system, columns) = (&varied.system, &prepared.columns);
        let series = PowerSeries::new(system);
        let mut propagators = Vec::with_capacity(prepared.recurring.len());
        for of in &prepared.recurring {
            propagators.push(Propagator::new(system, system.influence(), of.length));
        }
        let mut states = Vec::with_capacity(places.len());
        let mut out = vec![[0.0; 12]; columns.len() * places.len()];
        for (i, (at, input)) in places.iter().zip(inputs).enumerate() {
            if i % BETWEEN == 0 && watch.stops() {
                return None;
            }
            let (start, ends) = (&samples[at.sample], [excitation.input(at.sample), *input]);
            states.push(match prepared.intervals[i] {
                Interval::Jump => *start,
                Interval::Propagator(index) => propagators[index].apply(start, &ends[0], &ends[1]),
                Interval::Series => {
                    let mut there: Vec<State> = before(tangents, columns, samples.len(), at.sample);
                    let end = by_series(
                        system,
                        system.influence(),
                        (columns, &series),
                        (at.since, start, &ends),
                        &mut there,
                    );
                    for (column, tangent) in there.iter().enumerate() {
                        out[column * places.len() + i] = *tangent;
                    }
                    end
                }
            });
        }
        // Column by column, so that its matrices stay in the nearest cache.
        for column in 0..columns.len() {
            let tangents = &tangents[column * samples.len()..(column + 1) * samples.len()];
            let out = &mut out[column * places.len()..(column + 1) * places.len()];
            for (i, at) in places.iter().enumerate() {
                let tangent = &tangents[at.sample];
                match prepared.intervals[i] {
                    Interval::Jump => out[i] = *tangent,
                    Interval::Propagator(index) => {
                        let ends = [&excitation.input(at.sample), &inputs[i]];
                        let of = &prepared.recurring[index];
                        out[i] = of.step(column, tangent, &samples[at.sample], ends, components);
                    }
                    Interval::Series => {}
                }
            }
        }
        Some((states, out))
    }
}

/// The tangents of all columns at a sample.
#[cfg_attr(feature = "std", inline(always))]
fn before(tangents: &[State], columns: &[ModalDerivative], count: usize, sample: usize) -> Vec<State> {
    let mut out = Vec::with_capacity(columns.len());
    for column in 0..columns.len() {
        out.push(tangents[column * count + sample]);
    }
    out
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
