//! Derivatives of the states of a run of a linear system, or of one with contact changes: those of all columns side by side, from sample to
//! sample.

use super::contacts::ContactChanges;
use super::steps::{Recurring, by_series};
use super::system::VariedSystem;
use crate::equations::{EquationsDerivative, PowerSeries};
use crate::excitation::{Excitation, Forcing};
use crate::numeric::simd::dispatch_once;
use crate::numeric::watch::Watch;
use crate::system::State;

/// How often a length of interval must occur so that derivatives of its propagator are computed, which cost as much as some forty series.
pub(super) const MIN_OCCURRENCES: usize = 48;

/// What a run depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearRun<'a> {
    pub varied: &'a VariedSystem,
    /// With the factors on the motion.
    pub excitation: &'a Excitation<'a>,
    /// At the samples of the excitation.
    pub states: &'a [State],
    /// If some links have laws with several segments.
    pub contacts: Option<&'a ContactChanges>,
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

/// The derivatives of a run that all its samples share.
pub(super) struct Prepared {
    pub columns: Vec<EquationsDerivative>,
    pub intervals: Vec<Interval>,
    pub recurring: Vec<Recurring>,
    pub forcing: Forcing,
}

impl Prepared {
    /// For intervals, and the lengths that recur.
    pub(super) fn new(
        varied: &VariedSystem,
        excitation: &Excitation,
        (intervals, lengths): (Vec<Interval>, Vec<(usize, f64)>),
    ) -> Self {
        let (columns, forcing) = (EquationsDerivative::all(varied), forcing(varied, excitation));
        let of = |&(_, length): &(usize, f64)| Recurring::new(&varied.system, &columns, &forcing, length);
        let recurring = lengths.iter().map(of).collect();
        Self { columns, intervals, recurring, forcing }
    }

    /// For the tangents of all columns.
    fn forwards(varied: &VariedSystem, excitation: &Excitation) -> Self {
        Self::new(varied, excitation, intervals(lengths(excitation), MIN_OCCURRENCES))
    }

    /// For the adjoint state, if there are few enough lengths of interval.
    pub(super) fn backwards(varied: &VariedSystem, excitation: &Excitation) -> Option<Self> {
        let intervals = intervals(lengths(excitation), 1);
        (intervals.1.len() <= MOST_LENGTHS).then(|| Self::new(varied, excitation, intervals))
    }

    /// For the tangents of a run with contact changes.
    fn with_contacts(contacts: &ContactChanges, varied: &VariedSystem, excitation: &Excitation) -> Self {
        let forcing = forcing(varied, excitation);
        let pieces = (1..excitation.count()).map(|k| contacts.of_interval(k - 1));
        let lengths = pieces.zip(lengths(excitation)).map(|(piece, (_, length))| (piece, length));
        let (intervals, lengths) = intervals(lengths, MIN_OCCURRENCES);
        let recurring =
            lengths.iter().map(|&(piece, length)| contacts.pieces[piece].recurring(&forcing, length));
        Self { columns: Vec::new(), intervals, recurring: recurring.collect(), forcing }
    }
}

/// Most lengths of interval for which the adjoint state pays.
const MOST_LENGTHS: usize = 256;

/// Writes the derivatives of the states by each column to `out`, (column, sample). Returns false if the watch stopped it.
pub(super) fn tangent_states(run: LinearRun, watch: Watch, out: &mut [State]) -> bool {
    let prepared = &match run.contacts {
        Some(contacts) => Prepared::with_contacts(contacts, run.varied, run.excitation),
        None => Prepared::forwards(run.varied, run.excitation),
    };
    let mut tangents = vec![[0.0; 12]; run.varied.derivatives.len()];
    if run.quasi_static {
        let (varied, columns) = match run.contacts.map(|contacts| &contacts.pieces[contacts.at_samples[0]]) {
            Some(piece) => (&piece.varied, &piece.columns),
            None => (run.varied, &prepared.columns),
        };
        for (tangent, column) in tangents.iter_mut().zip(columns) {
            *tangent = column.quasi_static(varied, &run.states[0], &run.excitation.input(0));
        }
    }
    dispatch_once!(pass_all(run, prepared, tangents, watch, out))
}

/// The modal force of an excitation that contains the factors on the motion.
pub(super) fn forcing(varied: &VariedSystem, excitation: &Excitation) -> Forcing {
    Forcing::new(&varied.system, &excitation.peak(), [1.0; 2])
}

/// The intervals between the samples, under equations that hold throughout.
fn lengths(excitation: &Excitation) -> impl Iterator<Item = (Option<usize>, f64)> {
    (1..excitation.count()).map(|k| (Some(0), excitation.interval(k - 1)))
}

/// How intervals are passed, and the equations and lengths that occur so often that their propagators are computed.
///
/// `all`: of each interval the equations by an index, if the same hold throughout, and its length.
pub(super) fn intervals(
    all: impl Iterator<Item = (Option<usize>, f64)>,
    occurrences: usize,
) -> (Vec<Interval>, Vec<(usize, f64)>) {
    let all: Vec<_> = all.collect();
    let order = |a: &(usize, f64), b: &(usize, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
    let mut sorted: Vec<_> = all.iter().filter_map(|&(piece, length)| Some((piece?, length))).collect();
    sorted.sort_unstable_by(order);
    let equal = sorted.chunk_by(|a, b| a == b);
    let lengths: Vec<_> =
        equal.filter(|of| of[0].1 > 0.0 && of.len() >= occurrences).map(|of| of[0]).collect();
    let known = |piece, length| lengths.binary_search_by(|known| order(known, &(piece, length))).ok();
    let kind = |&(piece, length): &(Option<usize>, f64)| match piece.and_then(|piece| known(piece, length)) {
        Some(index) => Interval::Propagator(index),
        None if length > 0.0 => Interval::Series,
        None => Interval::Jump,
    };
    (all.iter().map(kind).collect(), lengths)
}

#[cfg_attr(feature = "std", inline(always))]
fn pass_all(
    run: LinearRun,
    prepared: &Prepared,
    mut tangents: Vec<State>,
    watch: Watch,
    out: &mut [State],
) -> bool {
    let Prepared { columns, intervals, recurring, forcing } = prepared;
    let count = intervals.len() + 1;
    let system = &run.varied.system;
    let series = PowerSeries::new(system);
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
            let of = (run.excitation.interval(k), &run.states[k], &ends);
            if let Some(contacts) = run.contacts {
                contacts.pass(run.varied, k, of, &mut tangents);
            } else {
                by_series(system, system.influence(), (columns, &series), of, &mut tangents);
            }
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
                    let mut ends = [[0.0; 9]; 2];
                    forcing.sample(run.excitation, at, &mut ends[0]);
                    forcing.sample(run.excitation, at + 1, &mut ends[1]);
                    *tangent = recurring[index].step(column, tangent, &run.states[at], &ends);
                }
                out[column * count + at + 1] = *tangent;
            }
        }
        k = end;
    }
    true
}

/// Samples that one column passes after the other.
const BLOCK: usize = 64;

/// Samples between two looks at the watch.
const BETWEEN: usize = 4096;
