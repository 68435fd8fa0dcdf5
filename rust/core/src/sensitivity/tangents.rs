//! Derivatives of the states of a run of a linear system: those of all columns side by side, from sample to sample.

use super::equations::ModalDerivative;
use super::system::VariedSystem;
use crate::equations::{Equations, EquationsDerivative, PowerSeries, PropagatorDerivative, PropagatorStages};
use crate::excitation::Excitation;
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{Kernel, dispatch};
use crate::numeric::watch::Watch;
use crate::system::{Force, Input, NO_FORCE, State};

/// How often a length of interval must occur so that derivatives of its propagator are computed, which cost as much as some forty series.
pub(super) const MIN_OCCURRENCES: usize = 48;

/// What a run of a linear system depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearRun<'a> {
    pub varied: &'a VariedSystem,
    /// With the factors on the motion.
    pub excitation: &'a Excitation<'a>,
    /// At the samples of the excitation.
    pub states: &'a [State],
    /// Whether it starts in the quasi-static state of the first sample, instead of at rest.
    pub quasi_static: bool,
}

/// How the states pass an interval.
#[derive(Debug, Clone, Copy)]
pub(super) enum Interval {
    /// A jump of the excitation.
    Jump,
    /// By the propagator with this index.
    Propagator(usize),
    Series,
}

/// A length of interval that recurs: E, and the derivatives of the propagator by each column.
pub(super) struct Recurring {
    /// s.
    pub length: f64,
    pub change: [[f64; 12]; 12],
    pub derivatives: Vec<PropagatorDerivative>,
}

impl Recurring {
    /// The tangent of a column at the end of the interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn step(
        &self,
        column: usize,
        tangent: &State,
        state: &State,
        ends: [&Input; 2],
        components: &[usize],
    ) -> State {
        let (mut sum, mut second) = (*tangent, [0.0; 12]);
        self.derivatives[column].add_to(&mut sum, state, ends, components);
        for j in (0..12).step_by(2) {
            add_scaled(&mut sum, &self.change[j], tangent[j]);
            add_scaled(&mut second, &self.change[j + 1], tangent[j + 1]);
        }
        for i in 0..12 {
            sum[i] += second[i];
        }
        sum
    }
}

/// The derivatives of a run that all its samples share.
pub(super) struct Prepared {
    pub columns: Vec<ModalDerivative>,
    pub intervals: Vec<Interval>,
    pub recurring: Vec<Recurring>,
}

impl Prepared {
    /// For intervals, and the lengths that recur.
    pub(super) fn new(varied: &VariedSystem, (intervals, lengths): (Vec<Interval>, Vec<f64>)) -> Self {
        let columns: Vec<ModalDerivative> =
            (0..varied.derivatives.len()).map(|column| ModalDerivative::new(varied, column)).collect();
        let recurring = lengths
            .iter()
            .map(|&length| dispatch(Derivatives { varied, columns: &columns, length }))
            .collect();
        Self { columns, intervals, recurring }
    }

    /// For the tangents of all columns.
    fn forwards(varied: &VariedSystem, excitation: &Excitation) -> Self {
        Self::new(varied, intervals(lengths(excitation), MIN_OCCURRENCES))
    }

    /// For the adjoint state, if there are few enough lengths of interval.
    pub(super) fn backwards(varied: &VariedSystem, excitation: &Excitation) -> Option<Self> {
        let intervals = intervals(lengths(excitation), 1);
        (intervals.1.len() <= MOST_LENGTHS).then(|| Self::new(varied, intervals))
    }
}

/// The propagator of a length of interval, and its derivatives by all columns.
struct Derivatives<'a> {
    varied: &'a VariedSystem,
    columns: &'a [ModalDerivative],
    length: f64,
}

impl Kernel for Derivatives<'_> {
    type Output = Recurring;

    #[inline(always)]
    fn run(self) -> Recurring {
        let system = &self.varied.system;
        let stages = PropagatorStages::new(system, self.length);
        let mut derivatives = Vec::with_capacity(self.columns.len());
        for column in self.columns {
            derivatives.push(stages.derivative(&column.equations, system.influence(), &NO_FORCE));
        }
        Recurring { length: self.length, change: *stages.change(), derivatives }
    }
}

/// Most lengths of interval for which the adjoint state pays.
const MOST_LENGTHS: usize = 256;

/// Writes the derivatives of the states by each column to `out`, (column, sample). Returns false if the watch stopped it.
pub(super) fn tangent_states(run: LinearRun, watch: Watch, out: &mut [State]) -> bool {
    let prepared = &Prepared::forwards(run.varied, run.excitation);
    let components = &components(run.excitation)[..];
    let mut tangents = vec![[0.0; 12]; prepared.columns.len()];
    if run.quasi_static {
        for (tangent, column) in tangents.iter_mut().zip(&prepared.columns) {
            *tangent = column.quasi_static(run.varied, &run.states[0], &run.excitation.input(0));
        }
    }
    dispatch(Tangents { run, prepared, components, tangents, watch, out })
}

/// The components of the input that are not zero throughout.
pub(super) fn components(excitation: &Excitation) -> Vec<usize> {
    let peak = excitation.peak();
    (0..9).filter(|&component| peak[component] > 0.0).collect()
}

fn lengths(excitation: &Excitation) -> impl Iterator<Item = f64> {
    (1..excitation.count()).map(|k| excitation.interval(k - 1))
}

/// How intervals of these lengths are passed, and the lengths that occur so often that their propagators are computed.
pub(super) fn intervals(lengths: impl Iterator<Item = f64>, occurrences: usize) -> (Vec<Interval>, Vec<f64>) {
    let all: Vec<f64> = lengths.collect();
    let mut sorted = all.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let equal = sorted.chunk_by(|a, b| a == b);
    let lengths: Vec<f64> =
        equal.filter(|of| of[0] > 0.0 && of.len() >= occurrences).map(|of| of[0]).collect();
    let kind = |length: &f64| match lengths.binary_search_by(|known| known.total_cmp(length)) {
        Ok(index) => Interval::Propagator(index),
        Err(_) if *length > 0.0 => Interval::Series,
        Err(_) => Interval::Jump,
    };
    (all.iter().map(kind).collect(), lengths)
}

struct Tangents<'a> {
    run: LinearRun<'a>,
    prepared: &'a Prepared,
    components: &'a [usize],
    tangents: Vec<State>,
    watch: Watch<'a>,
    out: &'a mut [State],
}

/// Samples that one column passes after the other.
const BLOCK: usize = 64;

/// Samples between two looks at the watch.
const BETWEEN: usize = 4096;

impl Kernel for Tangents<'_> {
    type Output = bool;

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> bool {
        let Self { run, prepared, components, mut tangents, watch, out } = self;
        let Prepared { columns, intervals, recurring } = prepared;
        let count = intervals.len() + 1;
        let series = PowerSeries::new(&run.varied.system);
        for (column, tangent) in tangents.iter().enumerate() {
            out[column * count] = *tangent;
        }
        let mut k = 0;
        while k < intervals.len() {
            if k % BETWEEN < BLOCK && watch.stops() {
                return false;
            }
            let mut end = k;
            while end < intervals.len() && end < k + BLOCK && !matches!(intervals[end], Interval::Series) {
                end += 1;
            }
            if end == k {
                let ends = [run.excitation.input(k), run.excitation.input(k + 1)];
                let length = run.excitation.interval(k);
                by_series(run.varied, columns, &series, (length, &run.states[k], &ends), &mut tangents);
                for (column, tangent) in tangents.iter().enumerate() {
                    out[column * count + k + 1] = *tangent;
                }
                k += 1;
                continue;
            }
            // Column by column, so that its matrices stay in the nearest cache.
            for (column, tangent) in tangents.iter_mut().enumerate() {
                for at in k..end {
                    if let Interval::Propagator(index) = intervals[at] {
                        let ends = [&run.excitation.input(at), &run.excitation.input(at + 1)];
                        let state = &run.states[at];
                        *tangent = recurring[index].step(column, tangent, state, ends, components);
                    }
                    out[column * count + at + 1] = *tangent;
                }
            }
            k = end;
        }
        true
    }
}

/// Largest number of terms of the series over a part of an interval whose norm is at most one, and the smallest term: 1/24!, for derivatives
/// of high order relative to the state.
const TERMS: usize = 24;
const SMALLEST: f64 = 1.6e-24;

/// Number of terms of the series over a part of this norm.
fn terms_for(norm: f64) -> usize {
    let (mut terms, mut size) = (1, norm);
    while size > SMALLEST && terms < TERMS {
        terms += 1;
        size *= norm / terms as f64;
    }
    usize::max(terms, 2)
}

/// Passes an interval, which may be negative, by power series of the state and its derivatives. Returns the state at its end.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn by_series(
    varied: &VariedSystem,
    columns: &[ModalDerivative],
    series: &PowerSeries,
    (length, state, ends): (f64, &State, &[Input; 2]),
    tangents: &mut [State],
) -> State {
    let system = &varied.system;
    let parts = series.parts(length.abs());
    let tau = length / parts;
    let count = terms_for(series.norm(tau));
    let mut start = *state;
    let mut part = 0.0;
    while part < parts {
        let theta = part / parts;
        let input: Input = core::array::from_fn(|i| ends[0][i] + theta * (ends[1][i] - ends[0][i]));
        let rise: Input = core::array::from_fn(|i| (ends[1][i] - ends[0][i]) / parts);
        let forces = [modal(system.influence(), &input), modal(system.influence(), &rise)];
        let mut terms = [start; TERMS + 1];
        for k in 0..count {
            let force = if k < 2 { &forces[k] } else { &NO_FORCE };
            terms[k + 1] = scaled(system.linear(&terms[k], force), tau / (k + 1) as f64);
        }
        for (tangent, column) in tangents.iter_mut().zip(columns) {
            let by = &column.equations;
            let forces = [modal(&by.influence, &input), modal(&by.influence, &rise)];
            let mut term = *tangent;
            for k in 0..count {
                let force = if k < 2 { &forces[k] } else { &NO_FORCE };
                let mut rate = system.linear(&term, force);
                add_matrix(&mut rate, by, &terms[k]);
                term = scaled(rate, tau / (k + 1) as f64);
                add_scaled(tangent, &term, 1.0);
            }
        }
        for term in &terms[1..=count] {
            add_scaled(&mut start, term, 1.0);
        }
        part += 1.0;
    }
    start
}

/// Modal force of an input.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn modal(influence: &[Force; 9], input: &Input) -> Force {
    let mut force = NO_FORCE;
    for (column, &value) in influence.iter().zip(input) {
        add_scaled(&mut force, column, value);
    }
    force
}

#[cfg_attr(feature = "std", inline(always))]
fn add_matrix(to: &mut State, by: &EquationsDerivative, state: &State) {
    for (column, &factor) in by.matrix.iter().zip(state) {
        add_scaled(to, column, factor);
    }
}

#[cfg_attr(feature = "std", inline(always))]
fn scaled(mut state: State, factor: f64) -> State {
    for entry in &mut state {
        *entry *= factor;
    }
    state
}
