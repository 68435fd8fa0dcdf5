//! Extremes of loads over the time of a run, in memory of the caller.
//!
//! Instants are gathered in blocks. Of each block, the ranges of the entries of the state bound every load (`bounds`); a load whose bounds
//! lie within its extremes so far is not evaluated at all. Of the others, the components that may pass their extremes are evaluated, at all
//! instants of the block side by side (`block_values`), and where they may pass them between two instants (`bows`), this piece of the run is
//! searched (`between`). Instants that a run may leave out are judged by the same bounds.

use super::between::{Between, Place};
use super::block_values::{BLOCK, Values, add_magnitudes, evaluate_block, needed_for, transpose};
use super::bows::{Bows, Pieces};
use super::extremes::Extremes;
use super::loads::Wrench;
use super::record::Record;
use crate::error::RunError;
use crate::excitation::{Excitation, ScaledExcitation};
use crate::numeric::float::fma;
use crate::numeric::simd::{dispatch, dispatch_wide};
use crate::system::{Bounded, Input, NO_INPUT, SUM_ROUNDING, State, StateBox, System, range_of};

/// Stores only the extremes of loads, in between the recorded samples too; the smallest magnitudes at the samples. It takes 42 kB, and
/// without `std` 24 kB.
///
/// For this the fastest vibration should have six samples per period or more. Instants other than samples are only instants to it.
#[derive(Debug)]
pub struct Peaks<'a> {
    between: Between<'a>,
    loads: &'a [Wrench<'a>],
    extremes: &'a mut [Extremes],
    /// Whether a load depends on the excitation directly.
    needs_input: bool,
    times: Values,
    places: [Place; BLOCK],
    states: [State; BLOCK],
    inputs: [Input; BLOCK],
    filled: usize,
    /// Within it no load passes its extremes.
    safe: StateBox,
    scratch: Scratch,
}

/// Of an entry that is zero.
const NO_RANGE: Bounded = [0.0; 2];

/// Memory for the evaluation of a block, kept so that it need not be zeroed for each.
#[derive(Debug)]
struct Scratch {
    /// The entries of the states, and those of the excitation, each at all instants.
    entries: [Values; 12],
    inputs: [Values; 9],
    /// Components of a load, y-z resultant of its force, and magnitude of its moment.
    values: [Values; 8],
    bows: Bows,
}

impl Scratch {
    /// Evaluates the wanted values of a load in a block, and updates its extremes: the smallest and largest of each wanted value.
    #[cfg_attr(feature = "std", inline(always))]
    fn update(
        &mut self,
        load: &Wrench,
        wanted: &[bool; 8],
        (states, times): (&[State; BLOCK], &Values),
        extremes: &mut Extremes,
    ) -> [[f64; 2]; 8] {
        let Self { entries, inputs, values, .. } = self;
        evaluate_block(load, &needed_for(wanted), (entries, inputs), states, values);
        add_magnitudes(wanted, values);
        extremes.update(times, wanted, values)
    }
}

impl<'a> Peaks<'a> {
    /// Updates the extremes of each of `loads` of a system, in the entry of `extremes` at the same index, by the end of a run through the
    /// excitation. Before it they are [`Extremes::NONE`], [`Extremes::ONLY_MAGNITUDES`], or those of earlier runs.
    pub fn new(
        system: &'a System,
        excitation: &'a Excitation<'a>,
        loads: &'a [Wrench<'a>],
        extremes: &'a mut [Extremes],
    ) -> Self {
        Self::after(system, &ScaledExcitation::unscaled(excitation), loads, extremes)
    }

    /// The same for an excitation with factors; those on its direct effect are in the loads.
    pub(crate) fn after(
        system: &'a System,
        excitation: &ScaledExcitation<'a>,
        loads: &'a [Wrench<'a>],
        extremes: &'a mut [Extremes],
    ) -> Self {
        Self {
            between: Between::new(system, excitation),
            loads,
            extremes,
            needs_input: loads.iter().any(|load| load.linear.by_input_at_all),
            times: [0.0; BLOCK],
            places: [None; BLOCK],
            states: [[0.0; 12]; BLOCK],
            inputs: [NO_INPUT; BLOCK],
            filled: 0,
            safe: StateBox::NOTHING,
            scratch: Scratch {
                entries: [[0.0; BLOCK]; 12],
                inputs: [[0.0; BLOCK]; 9],
                values: [[0.0; BLOCK]; 8],
                bows: Bows::NONE,
            },
        }
    }

    /// Adds an instant.
    #[cfg_attr(feature = "std", inline(always))]
    fn add(&mut self, time: f64, place: Place, state: &State, input: &Input) {
        (self.times[self.filled], self.places[self.filled], self.states[self.filled]) = (time, place, *state);
        if self.needs_input {
            self.inputs[self.filled] = *input;
        }
        self.filled += 1;
        if self.filled == BLOCK {
            self.judge();
        }
    }

    /// Updates the extremes with the block.
    #[inline(never)]
    fn judge(&mut self) {
        if self.filled > 0 {
            dispatch!(self.update());
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn update(&mut self) {
        let Peaks {
            between,
            loads,
            extremes,
            needs_input,
            times,
            places,
            states,
            inputs,
            filled,
            safe,
            scratch,
        } = self;
        // The last instant is repeated past the end; its copies come later, and so are no first occurrence of an extreme.
        let last = *filled - 1;
        for k in *filled..BLOCK {
            (times[k], places[k], states[k], inputs[k]) =
                (times[last], places[last], states[last], inputs[last]);
        }
        let here = StateBox::of(states);
        if !here.is_within(safe) || *needs_input {
            let mut evaluated = false;
            let of_input = if *needs_input { ranges_of(inputs) } else { [NO_RANGE; 9] };
            for index in 0..loads.len() {
                let load = &loads[index];
                let wanted = here.may_pass(load, &of_input, &extremes[index]);
                if wanted == [false; 8] {
                    continue;
                }
                if !evaluated {
                    transpose(states, &mut scratch.entries);
                    if *needs_input {
                        transpose(inputs, &mut scratch.inputs);
                    }
                    scratch.bows.measure(between, places);
                    evaluated = true;
                }
                let ranges =
                    dispatch_wide!(scratch.update(load, &wanted, (states, times), &mut extremes[index]));
                let hidden = scratch.bows.hidden(between, load);
                for (value, _) in wanted.iter().enumerate().filter(|(_, wanted)| **wanted) {
                    let (bows, values) = (&scratch.bows, &scratch.values[value]);
                    let (range, hidden) = (ranges[value], hidden[value]);
                    let pieces = Pieces { places, states, bows, values, range, hidden };
                    pieces.wait(between, (index, value), loads, extremes);
                }
            }
            if !evaluated && !*needs_input {
                *safe = safe_box(&here, loads, extremes);
            }
        }
        // The last instant is also the first of the next block, for the piece between them.
        *filled = 1;
        (times[0], places[0], states[0], inputs[0]) = (times[last], places[last], states[last], inputs[last]);
    }
}

#[cfg(feature = "std")]
impl Peaks<'_> {
    /// Whether no load passes its extremes in a box.
    #[inline(always)]
    fn passes_none(&mut self, states: &StateBox) -> bool {
        let Self { loads, extremes, safe, .. } = self;
        if states.is_within(safe) {
            return true;
        }
        if any_may_pass(states, loads, extremes) {
            return false;
        }
        *safe = safe_box(states, loads, extremes);
        true
    }
}

impl Record for Peaks<'_> {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        let (expected, got) = (self.loads.len(), self.extremes.len());
        if got < expected { Err(RunError::Capacity { expected, got }) } else { Ok(()) }
    }

    fn needs_input(&self) -> bool {
        self.needs_input
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, time: f64, state: &State, input: &Input) {
        self.add(time, None, state, input);
    }

    fn samples(&mut self, excitation: &Excitation, first: usize, states: &[State]) {
        // Preloaded runs record one at a time; a copy of known length is quicker.
        if let [state] = states {
            let input = if self.needs_input { excitation.input(first) } else { NO_INPUT };
            self.add(excitation.time(first), Some((first, 0.0)), state, &input);
            return;
        }
        let (mut first, mut rest) = (first, states);
        while !rest.is_empty() {
            let place = self.filled..usize::min(self.filled + rest.len(), BLOCK);
            let (these, later) = rest.split_at(place.len());
            self.states[place.clone()].copy_from_slice(these);
            for (k, at) in (first..).zip(place) {
                (self.times[at], self.places[at]) = (excitation.time(k), Some((k, 0.0)));
                if self.needs_input {
                    self.inputs[at] = excitation.input(k);
                }
            }
            (first, rest) = (first + these.len(), later);
            self.filled += these.len();
            if self.filled == BLOCK {
                self.judge();
            }
        }
    }

    #[cfg(feature = "std")]
    fn needs_all(&self) -> bool {
        self.needs_input
    }

    #[cfg(feature = "std")]
    fn leave_out(&mut self, _: usize, states: &StateBox) -> bool {
        dispatch!(self.passes_none(states))
    }

    /// The load has a corner there.
    fn contact_change(&mut self, (mut sample, mut since): (usize, f64), state: &State, _: &[(usize, u8)]) {
        let excitation = self.between.excitation();
        // At a sample but for rounding: there is no piece in between.
        if !self.between.jumps_at([Some((sample, since)), None]) {
            let interval = excitation.interval(sample);
            let rounding = 4.0 * f64::EPSILON * interval;
            if since <= rounding {
                since = 0.0;
            } else if interval - since <= rounding {
                (sample, since) = (sample + 1, 0.0);
            }
        }
        let time = excitation.time(sample) + since;
        let input = if self.needs_input { excitation.input_at(time) } else { NO_INPUT };
        self.add(time, Some((sample, since)), state, &input);
    }

    fn end(&mut self) {
        self.judge();
        self.between.search(self.loads, self.extremes);
    }
}

/// The ranges of the entries of the excitation.
#[cfg_attr(feature = "std", inline(always))]
fn ranges_of(inputs: &[Input; BLOCK]) -> [Bounded; 9] {
    let [low, high] = range_of(inputs);
    core::array::from_fn(|i| {
        let (middle, half) = (0.5 * (low[i] + high[i]), 0.5 * (high[i] - low[i]));
        [middle, fma(SUM_ROUNDING, middle.abs(), half)]
    })
}

/// Whether one of the loads, which do not depend on the excitation, may pass its extremes in a box.
#[cfg_attr(feature = "std", inline(always))]
fn any_may_pass(states: &StateBox, loads: &[Wrench], extremes: &[Extremes]) -> bool {
    for (load, extremes) in loads.iter().zip(extremes) {
        if states.may_pass(load, &[NO_RANGE; 9], extremes) != [false; 8] {
            return true;
        }
    }
    false
}

/// A box in which no load passes its extremes: if possible larger than this one, so that it holds more of the states to come.
#[cfg_attr(feature = "std", inline(always))]
fn safe_box(states: &StateBox, loads: &[Wrench], extremes: &[Extremes]) -> StateBox {
    let wide = states.widened();
    if any_may_pass(&wide, loads, extremes) { *states } else { wide }
}

impl Extremes {
    /// Updates with the wanted values of a block, whose ranges it returns; the time is that of the first occurrence.
    #[cfg_attr(feature = "std", inline(always))]
    fn update(&mut self, times: &Values, wanted: &[bool; 8], values: &[Values; 8]) -> [[f64; 2]; 8] {
        let mut ranges = [[0.0; 2]; 8];
        for (i, values) in values.iter().enumerate() {
            if !wanted[i] {
                continue;
            }
            let (low, high) = least_and_largest(values);
            ranges[i] = [low, high];
            if low < self.smallest[i] {
                (self.smallest[i], self.time_of_smallest[i]) = (low, times[first(values, low)]);
            }
            if high > self.largest[i] {
                (self.largest[i], self.time_of_largest[i]) = (high, times[first(values, high)]);
            }
        }
        ranges
    }
}

/// Smallest and largest value; numbers that are NaN do not count.
#[cfg_attr(feature = "std", inline(always))]
fn least_and_largest(values: &Values) -> (f64, f64) {
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for some in values.as_chunks::<4>().0 {
        for i in 0..4 {
            low[i] = if some[i] < low[i] { some[i] } else { low[i] };
            high[i] = if some[i] > high[i] { some[i] } else { high[i] };
        }
    }
    for i in 1..4 {
        low[0] = if low[i] < low[0] { low[i] } else { low[0] };
        high[0] = if high[i] > high[0] { high[i] } else { high[0] };
    }
    (low[0], high[0])
}

/// The first index of a value that occurs.
#[cfg_attr(feature = "std", inline(always))]
fn first(values: &Values, value: f64) -> usize {
    values.iter().position(|other| *other == value).unwrap_or(0)
}
