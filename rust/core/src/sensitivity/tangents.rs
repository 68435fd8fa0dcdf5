//! Derivatives of the states of a run of a linear system, or of one with contact changes: those of all columns side by side, from sample to sample.

use super::contacts::ContactChanges;
use super::equations::ModalDerivative;
use super::steps::{Derivatives, Recurring, by_series};
use super::system::VariedSystem;
use crate::equations::PowerSeries;
use crate::excitation::Excitation;
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{Kernel, dispatch};
use crate::numeric::watch::Watch;
use crate::system::State;

/// How often a length of interval must occur so that derivatives of its propagator are computed, which cost as much as some forty series.
const MIN_OCCURRENCES: usize = 48;

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
    pub columns: Vec<ModalDerivative>,
    pub intervals: Vec<Interval>,
    pub recurring: Vec<Recurring>,
}

impl Prepared {
    fn new(varied: &VariedSystem, (intervals, lengths): (Vec<Interval>, Vec<(usize, f64)>)) -> Self {
        let columns: Vec<ModalDerivative> =
            (0..varied.derivatives.len()).map(|column| ModalDerivative::new(varied, column)).collect();
        let of = |length| Derivatives { equations: &varied.system, varied, columns: &columns, length };
        let recurring = lengths.iter().map(|&(_, length)| dispatch(of(length))).collect();
        Self { columns, intervals, recurring }
    }

    /// For the tangents of all columns.
    fn forwards(varied: &VariedSystem, excitation: &Excitation) -> Self {
        Self::new(varied, intervals(excitation, MIN_OCCURRENCES, |_| Some(0)))
    }

    /// For the adjoint state, if there are few enough lengths of interval.
    pub(super) fn backwards(varied: &VariedSystem, excitation: &Excitation) -> Option<Self> {
        let intervals = intervals(excitation, 1, |_| Some(0));
        (intervals.1.len() <= MOST_LENGTHS).then(|| Self::new(varied, intervals))
    }

    /// For the tangents of a run with contact changes.
    fn with_contacts(contacts: &ContactChanges, excitation: &Excitation) -> Self {
        let (intervals, lengths) = intervals(excitation, MIN_OCCURRENCES, |k| contacts.of_interval(k));
        let recurring = lengths.iter().map(|&(piece, length)| contacts.pieces[piece].recurring(length));
        Self { columns: Vec::new(), intervals, recurring: recurring.collect() }
    }
}

/// Most lengths of interval for which the adjoint state pays.
const MOST_LENGTHS: usize = 256;

/// Writes the derivatives of the states by each column to `out`, (column, sample). Returns false if the watch stopped it.
pub(super) fn tangent_states(run: LinearRun, watch: Watch, out: &mut [State]) -> bool {
    let prepared = &match run.contacts {
        Some(contacts) => Prepared::with_contacts(contacts, run.excitation),
        None => Prepared::forwards(run.varied, run.excitation),
    };
    let peak = run.excitation.peak();
    let components: &[usize] = &(0..9).filter(|&component| peak[component] > 0.0).collect::<Vec<_>>();
    let mut tangents = vec![[0.0; 12]; run.varied.derivatives.len()];
    if run.quasi_static {
        for (column, tangent) in tangents.iter_mut().enumerate() {
            *tangent = match run.contacts {
                Some(contacts) => contacts.quasi_static(&run.excitation.input(0), &run.states[0], column),
                None => prepared.columns[column].quasi_static(
                    run.varied,
                    &run.states[0],
                    &run.excitation.input(0),
                ),
            };
        }
    }
    dispatch(Tangents { run, prepared, components, tangents, watch, out })
}

/// How each interval is passed, and the pieces and lengths that occur so often that their propagators are computed. `piece`: the equations
/// of an interval by an index, if the same hold throughout.
fn intervals(
    excitation: &Excitation,
    occurrences: usize,
    piece: impl Fn(usize) -> Option<usize>,
) -> (Vec<Interval>, Vec<(usize, f64)>) {
    let all: Vec<_> = (1..excitation.count()).map(|k| (piece(k - 1), excitation.interval(k - 1))).collect();
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
                match run.contacts {
                    Some(contacts) => contacts.pass(run.varied, k, of, &mut tangents),
                    None => by_series(system, system.influence(), (columns, &series), of, &mut tangents),
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
                        let Recurring { change, derivatives } = &recurring[index];
                        let ends = [run.excitation.input(at), run.excitation.input(at + 1)];
                        let (mut sum, mut second) = (*tangent, [0.0; 12]);
                        derivatives[column].add_to(
                            &mut sum,
                            &run.states[at],
                            [&ends[0], &ends[1]],
                            components,
                        );
                        for j in (0..12).step_by(2) {
                            add_scaled(&mut sum, &change[j], tangent[j]);
                            add_scaled(&mut second, &change[j + 1], tangent[j + 1]);
                        }
                        for i in 0..12 {
                            tangent[i] = sum[i] + second[i];
                        }
                    }
                    out[column * count + at + 1] = *tangent;
                }
            }
            k = end;
        }
        true
    }
}
