//! Measures from the states of a run: the extremes of loads, and block by block what needs their values at all samples. No history is stored.

use super::lines::{Lines, ModalAcceleration};
use super::load_rows::{BLOCK, LoadRows, StateBlock, Values};
use super::power_integral::power_integral;
use super::requirements::{Requirements, Signal};
use super::time_statistics::RunningStatistics;
use super::windows::Window;
use crate::error::RunError;
use crate::excitation::{Excitation, ScaledExcitation};
use crate::life::Rule;
use crate::numeric::float::{fma, sqrt};
use crate::numeric::simd::{LANES, dispatch_wide};
use crate::output::{Extremes, Peaks, Record, Wrench};
use crate::system::{Input, NO_INPUT, State, StateBox, System};
use crate::variation::{Group, Instance};

/// Memory of one thread.
#[derive(Debug)]
pub(super) struct Memory {
    /// Of the loads in [`Requirements::extremes`].
    extremes: Vec<Extremes>,
    /// The load rows at the block.
    rows: Vec<Values>,
    block: StateBlock,
    statistics: Vec<RunningStatistics>,
    lines: Lines,
    lost: Vec<bool>,
    /// Rule of each equivalent load.
    rules: Vec<Rule<f64>>,
}

impl Memory {
    pub(super) fn new() -> Self {
        Self {
            extremes: Vec::new(),
            rows: Vec::new(),
            block: StateBlock::new(),
            statistics: Vec::new(),
            lines: Lines::new(),
            lost: Vec::new(),
            rules: Vec::new(),
        }
    }

    /// Begins the statistics of a sample.
    pub(super) fn begin(&mut self, requirements: &Requirements, sample: &Instance, groups: &[Group]) {
        self.extremes.clear();
        self.extremes.extend_from_slice(requirements.extremes.begin());
        self.statistics.clear();
        self.statistics.resize(requirements.signals.len(), RunningStatistics::NONE);
        self.lost.clear();
        self.lost.resize(requirements.contacts.len(), false);
        self.rules.clear();
        self.rules.extend(requirements.equivalents.iter().map(|one| one.rule_of(sample, groups)));
    }

    /// Writes one number per measure to `out`.
    pub(super) fn write(&self, requirements: &Requirements, out: &mut [f64]) -> Result<(), RunError> {
        let mut statistics = self.statistics.clone();
        requirements.extremes.write(&self.extremes, &mut statistics);
        for (wanted, found) in requirements.signals.iter().zip(&mut statistics) {
            if let Signal::Equivalent(index) = wanted.signal {
                *found = found.with_preload(&self.rules[index]);
            }
        }
        requirements.write_measures(&statistics, &self.lost, out)
    }
}

/// Reduction of the run of one window.
#[derive(Debug)]
pub(super) struct Reduce<'a> {
    window: &'a Window<'a>,
    excitation: &'a Excitation<'a>,
    peaks: Peaks<'a>,
    /// Where the measures need more than extremes.
    loads: Option<LoadRows<'a>>,
    /// If mean loads are needed.
    modes: Option<ModalAcceleration<'a>>,
    rows: &'a mut [Values],
    block: &'a mut StateBlock,
    statistics: &'a mut [RunningStatistics],
    lines: &'a mut Lines,
    lost: &'a mut [bool],
    rules: &'a [Rule<f64>],
    /// Samples of the window before the block, and in it.
    before: usize,
    filled: usize,
}

impl<'a> Reduce<'a> {
    /// A reduction that adds to the statistics in `memory`. `loads`: those in [`Requirements::extremes`], of the system.
    pub(super) fn new(
        window: &'a Window<'a>,
        scaled: &ScaledExcitation<'a>,
        (system, loads): (&'a System, &'a [Wrench<'a>]),
        (sample, groups): (&Instance, &[Group]),
        memory: &'a mut Memory,
    ) -> Self {
        let (requirements, excitation) = (&window.requirements, scaled.excitation);
        let Memory { extremes, rows, block, statistics, lines, lost, rules } = memory;
        rows.resize(requirements.rows.len(), [0.0; BLOCK]);
        lines.resize(requirements.rows.len());
        let peaks = Peaks::after(system, scaled, loads, extremes);
        let loads = requirements.needs_blocks.then(|| LoadRows::new(system, requirements, sample, groups));
        let modes = requirements.travel.is_some().then(|| ModalAcceleration::new(system, sample.factors()));
        let (before, filled) = (0, 0);
        Self {
            window,
            excitation,
            peaks,
            loads,
            modes,
            rows,
            block,
            statistics,
            lines,
            lost,
            rules,
            before,
            filled,
        }
    }

    /// Adds a sample to the block.
    #[cfg_attr(feature = "std", inline(always))]
    fn add(&mut self, state: &State) {
        self.block.set(self.filled, state);
        self.filled += 1;
        if self.filled == BLOCK {
            self.flush();
        }
    }

    /// Reduces what is left in the block.
    #[inline(never)]
    fn flush(&mut self) {
        if self.filled > 0 {
            dispatch_wide!(self.update());
            self.before += self.filled;
            self.filled = 0;
        }
    }

    /// Updates the statistics with the block.
    #[cfg_attr(feature = "std", inline(always))]
    fn update(&mut self) {
        let Self { window, excitation, loads, modes, rows, block, statistics, lines, lost, rules, .. } = self;
        let (before, filled) = (self.before, self.filled);
        let Window { requirements, first: offset, .. } = *window;
        // The last instant is repeated past the end; these copies do not count.
        block.complete(filled);
        if requirements.needs_drive() || requirements.travel.is_some() {
            block.set_inputs(excitation, before, filled);
        }
        if let Some(loads) = loads {
            loads.evaluate(block, rows, lost);
            if let (Some(modes), Some(travel)) = (modes, &requirements.travel) {
                let is_moving = travel.moves(before, BLOCK);
                lines.set((loads, modes), (block, rows), excitation, before, is_moving);
            }
        }
        for (wanted, statistics) in requirements.signals.iter().zip(statistics.iter_mut()) {
            let mut values = [0.0; BLOCK];
            match wanted.signal {
                Signal::Row(row) => values = rows[row],
                Signal::Resultant(y, z) => {
                    let (y, z) = (&rows[y], &rows[z]);
                    for i in 0..BLOCK {
                        values[i] = sqrt(fma(y[i], y[i], z[i] * z[i]));
                    }
                }
                Signal::Equivalent(_) => continue,
                Signal::Power(index) => {
                    if let Some(travel) = &requirements.travel {
                        let equivalent = &requirements.equivalents[index];
                        statistics.add(power_integral(
                            equivalent,
                            &rules[index],
                            travel,
                            &lines.ends,
                            before,
                        ));
                    }
                    continue;
                }
            }
            if offset + before == 0 {
                statistics.start = values[0];
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

impl Record for Reduce<'_> {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        self.peaks.reserve(count)
    }

    fn needs_input(&self) -> bool {
        self.peaks.needs_input()
    }

    fn needs_all(&self) -> bool {
        self.window.requirements.needs_blocks || self.peaks.needs_all()
    }

    fn leave_out(&mut self, count: usize, states: &StateBox) -> bool {
        self.peaks.leave_out(count, states)
    }

    fn instant(&mut self, time: f64, state: &State, input: &Input) {
        self.peaks.instant(time, state, input);
        if self.window.requirements.needs_blocks {
            self.add(state);
        }
    }

    fn samples(&mut self, excitation: &Excitation, first: usize, states: &[State]) {
        let Requirements { at_samples, needs_blocks, .. } = self.window.requirements;
        if at_samples {
            let needs_input = self.peaks.needs_input();
            for (k, state) in (first..).zip(states) {
                let input = if needs_input { excitation.input(k) } else { NO_INPUT };
                self.peaks.instant(excitation.time(k), state, &input);
            }
        } else {
            self.peaks.samples(excitation, first, states);
        }
        if needs_blocks {
            for state in states {
                self.add(state);
            }
        }
    }

    fn contact_change(&mut self, at: (usize, f64), state: &State, segments: &[(usize, u8)]) {
        if !self.window.requirements.at_samples {
            self.peaks.contact_change(at, state, segments);
        }
    }

    fn end(&mut self) {
        self.flush();
        self.peaks.end();
    }
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
