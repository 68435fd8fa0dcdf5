//! Measures from the states of a run, block by block: no history is stored, and only the loads that the measures need are computed.

use super::load_rows::{BLOCK, LoadRows, StateBlock, extremes};
use super::power_integral::{Ends, equivalent_loads, power_integral};
use super::requirements::{Requirements, Signal, SignalRequest};
use super::time_statistics::RunningStatistics;
use super::windows::Window;
use crate::error::RunError;
use crate::excitation::Excitation;
use crate::life::Rule;
use crate::numeric::float::{fma, sqrt};
use crate::numeric::simd::{Kernel, LANES, dispatch_wide};
use crate::output::Record;
use crate::system::{Bounded, Input, ROUNDING, State, StateBox};
use crate::variation::{Group, Instance};

/// Memory of one thread.
#[derive(Debug)]
pub(super) struct Memory {
    pub rows: LoadRows,
    block: StateBlock,
    statistics: Vec<RunningStatistics>,
    /// The last instant before the block, of each equivalent load.
    ends: Vec<Ends>,
    lost: Vec<bool>,
    /// Rule of each equivalent load.
    rules: Vec<Rule<f64>>,
}

impl Memory {
    pub(super) fn new() -> Self {
        Self {
            rows: LoadRows::new(),
            block: StateBlock::new(),
            statistics: Vec::new(),
            ends: Vec::new(),
            lost: Vec::new(),
            rules: Vec::new(),
        }
    }

    /// Begins the statistics of a sample.
    pub(super) fn begin(&mut self, requirements: &Requirements, sample: &Instance, groups: &[Group]) {
        self.statistics.clear();
        self.statistics.resize(requirements.signals.len(), RunningStatistics::NONE);
        self.ends.clear();
        self.ends.resize(requirements.equivalents.len(), Ends::default());
        self.lost.clear();
        self.lost.resize(requirements.contacts.len(), false);
        self.rules.clear();
        self.rules.extend(requirements.equivalents.iter().map(|one| one.rule_of(sample, groups)));
    }

    /// Writes one number per measure to `out`; excitation: of the whole motion.
    pub(super) fn write(
        &self,
        requirements: &Requirements,
        excitation: &Excitation,
        out: &mut [f64],
    ) -> Result<(), RunError> {
        let mut statistics = self.statistics.clone();
        for (wanted, found) in requirements.signals.iter().zip(&mut statistics) {
            if let Signal::Equivalent(index) = wanted.signal {
                *found = found.raised(&self.rules[index]);
            }
        }
        requirements.write_measures(excitation, &statistics, &self.lost, out)
    }
}

/// Reduction of the run of one window.
#[derive(Debug)]
pub(super) struct Reduce<'a> {
    window: &'a Window<'a>,
    excitation: &'a Excitation<'a>,
    memory: &'a mut Memory,
    /// Samples of the window at the instants of the present block, and the number of these instants.
    samples: [usize; BLOCK],
    filled: usize,
    /// Sample of the next instant.
    next: usize,
    /// Whether nothing but extremes of loads is wanted, so that a block without new ones need not be evaluated.
    only_extremes: bool,
    /// Within it no load passes its extremes.
    safe: StateBox,
}

impl<'a> Reduce<'a> {
    /// A reduction with the load rows in `memory`, which adds to its statistics.
    pub(super) fn new(
        window: &'a Window<'a>,
        excitation: &'a Excitation<'a>,
        memory: &'a mut Memory,
    ) -> Self {
        let of_rows = |wanted: &SignalRequest| {
            !wanted.squares && matches!(wanted.signal, Signal::Row(_) | Signal::Resultant(..))
        };
        let requirements = &window.requirements;
        let only_extremes = requirements.contacts.is_empty() && requirements.signals.iter().all(of_rows);
        let (samples, filled, next, safe) = ([0; BLOCK], 0, 0, StateBox::NOTHING);
        Self { window, excitation, memory, samples, filled, next, only_extremes, safe }
    }

    /// Reduces what is left in the block.
    #[inline(never)]
    pub(super) fn flush(&mut self) {
        if self.filled > 0 {
            dispatch_wide(FlushKernel(self));
            self.filled = 0;
        }
    }
}

impl Record for Reduce<'_> {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        Ok(())
    }

    fn needs_input(&self) -> bool {
        false
    }

    fn needs_all(&self) -> bool {
        !self.only_extremes || self.window.requirements.needs_drive()
    }

    fn leave_out(&mut self, count: usize, states: &StateBox) -> bool {
        let left_out = dispatch_wide(LeaveOutKernel { reduce: self, states });
        if left_out {
            self.next += count;
        }
        left_out
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.memory.block.set(self.filled, state);
        self.samples[self.filled] = self.next;
        self.filled += 1;
        self.next += 1;
        if self.filled == BLOCK {
            self.flush();
        }
    }
}

/// Updates the statistics with a block.
struct FlushKernel<'a, 'b>(&'a mut Reduce<'b>);

impl Kernel for FlushKernel<'_, '_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Reduce { window, excitation, memory, samples, filled, only_extremes, safe, .. } = self.0;
        let Window { requirements, first: offset, .. } = *window;
        let Memory { rows, block, statistics, ends, lost, rules } = &mut **memory;
        // Where more than extremes are wanted, no sample is left out.
        let (before, filled) = (samples[0], *filled);
        // The last instant is repeated past the end; these copies do not count.
        block.pad(filled);
        if *only_extremes
            && offset + before > 0
            && holds_no_new_extreme(&block.ranges(), safe, requirements, rows, statistics)
        {
            return;
        }
        if requirements.needs_drive() {
            block.set_inputs(excitation, before, filled);
        }
        block.set_entries();
        rows.evaluate(block, lost);
        for (wanted, statistics) in requirements.signals.iter().zip(statistics) {
            let mut values = [0.0; BLOCK];
            match wanted.signal {
                Signal::Row(row) => values = rows.values[row],
                Signal::Resultant(y, z) => {
                    let (y, z) = (&rows.values[y], &rows.values[z]);
                    for i in 0..BLOCK {
                        values[i] = sqrt(fma(y[i], y[i], z[i] * z[i]));
                    }
                }
                Signal::Equivalent(index) => {
                    values = equivalent_loads(&requirements.equivalents[index], &rows.values);
                }
                Signal::Power(index) => {
                    if let Some(travel) = &requirements.travel {
                        let equivalent = &requirements.equivalents[index];
                        statistics.add(power_integral(
                            equivalent,
                            &rules[index],
                            travel,
                            &rows.values,
                            before,
                            &mut ends[index],
                        ));
                    }
                    continue;
                }
            }
            if offset + before == 0 {
                statistics.start = values[0];
            }
            if wanted.extremes {
                let (smallest, largest) = extremes(&values);
                if smallest < statistics.smallest {
                    statistics.smallest = smallest;
                    statistics.at_smallest = offset + samples[first(&values, smallest)];
                }
                if largest > statistics.largest {
                    statistics.largest = largest;
                    statistics.at_largest = offset + samples[first(&values, largest)];
                }
            }
            if wanted.squares {
                for value in &mut values {
                    *value *= *value;
                }
                statistics.sum += weighted(&values, &requirements.time[before..before + filled]);
            }
        }
    }
}

/// Decides whether instants in a box may be left out.
struct LeaveOutKernel<'a, 'b, 'c> {
    reduce: &'a mut Reduce<'b>,
    states: &'c StateBox,
}

impl Kernel for LeaveOutKernel<'_, '_, '_> {
    type Output = bool;

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> bool {
        let Reduce { window, memory, safe, .. } = self.reduce;
        let Memory { rows, statistics, .. } = &mut **memory;
        holds_no_new_extreme(self.states, safe, &window.requirements, rows, statistics)
    }
}

/// Whether no load passes its extremes in a box. If so, `safe` becomes this box or a wider one.
#[cfg_attr(feature = "std", inline(always))]
fn holds_no_new_extreme(
    states: &StateBox,
    safe: &mut StateBox,
    requirements: &Requirements,
    rows: &mut LoadRows,
    statistics: &[RunningStatistics],
) -> bool {
    if states.is_within(safe) {
        return true;
    }
    rows.bound(states);
    if !all_within(&requirements.signals, &rows.bounds, statistics) {
        return false;
    }
    // A larger box holds more of the states to come.
    *safe = states.widened();
    rows.bound(safe);
    if !all_within(&requirements.signals, &rows.bounds, statistics) {
        *safe = *states;
    }
    true
}

/// Whether all signals are within their extremes, by the bounds on the rows. False for NaN.
#[cfg_attr(feature = "std", inline(always))]
fn all_within(signals: &[SignalRequest], rows: &[Bounded], statistics: &[RunningStatistics]) -> bool {
    let mut within = true;
    for (wanted, statistics) in signals.iter().zip(statistics) {
        let (low, high) = match wanted.signal {
            Signal::Row(row) => (rows[row][0] - rows[row][1], rows[row][0] + rows[row][1]),
            Signal::Resultant(y, z) => {
                let (mut least, mut most) = (0.0, 0.0);
                for [middle, radius] in [rows[y], rows[z]] {
                    let (inner, outer) = (middle.abs() - radius, middle.abs() + radius);
                    least = if inner > 0.0 { fma(inner, inner, least) } else { least };
                    most = fma(outer, outer, most);
                }
                (sqrt(least) * (1.0 - ROUNDING), sqrt(most) * (1.0 + ROUNDING))
            }
            Signal::Equivalent(_) | Signal::Power(_) => return false,
        };
        within &= !wanted.extremes | ((low >= statistics.smallest) & (high <= statistics.largest));
    }
    within
}

/// The first index of a value that occurs.
#[cfg_attr(feature = "std", inline(always))]
fn first(values: &[f64; BLOCK], value: f64) -> usize {
    let mut found = BLOCK - 1;
    for i in (0..BLOCK).rev() {
        found = if values[i] == value { i } else { found };
    }
    found
}

/// `Σ weight * value`, over the number of weights.
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
