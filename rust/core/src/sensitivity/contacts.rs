//! Derivatives of the states of a run with contact changes.
//!
//! Between two changes the equations are linear, and so are those of the derivatives. At a change the force of the springs does not jump,
//! so the derivatives of the state do not either, although the instant of the change moves by `dt = -(dδ - de) / δ'`, δ the deflection and e
//! the edge. A damper that acts only in contact jumps by `b δ'`. The derivative of η' then jumps by that times dt (the saltation): by
//! `-d·Φ b (dδ - de)` where it starts to act. The rate δ' cancels, so that no change is too slow to have a derivative.

use std::ops::Range;

use super::error::SensitivityError;
use super::steps::{Recurring, by_series};
use super::system::VariedSystem;
use crate::equations::{EquationsDerivative, PowerSeries, SegmentEquations};
use crate::error::RunError;
use crate::excitation::{Excitation, Forcing, between};
use crate::output::Record;
use crate::system::{Input, State, System};

/// Segments that the nonlinear links are on, and the equations there.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    segments: Vec<(usize, u8)>,
    pub varied: VariedSystem,
    equations: SegmentEquations,
    pub columns: Vec<EquationsDerivative>,
    series: PowerSeries,
}

/// A contact change.
#[derive(Debug, Clone)]
struct Change {
    /// The last sample before it, and the time since then, s.
    at: (usize, f64),
    state: State,
    /// Index of the piece from then on.
    piece: usize,
}

/// The contact changes of a run.
#[derive(Debug, Clone)]
pub(super) struct ContactChanges {
    pub pieces: Vec<Piece>,
    /// Index of the piece at each sample.
    pub at_samples: Vec<usize>,
    changes: Vec<Change>,
}

/// States at the samples, and the contact changes between them.
#[derive(Debug, Default)]
pub(super) struct Recorded {
    pub states: Vec<State>,
    changes: Vec<(Change, Vec<(usize, u8)>)>,
}

impl Record for Recorded {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        Record::reserve(&mut self.states, count)
    }

    fn needs_input(&self) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.states.push(*state);
    }

    fn contact_change(&mut self, at: (usize, f64), state: &State, segments: &[(usize, u8)]) {
        self.changes.push((Change { at, state: *state, piece: 0 }, segments.to_vec()));
    }
}

/// Time from a sample within which a change is at the sample, over the interval.
const AT_SAMPLE: f64 = 1e-9;

impl ContactChanges {
    /// The changes of a run.
    ///
    /// # Errors
    /// [`SensitivityError::AtSample`].
    pub(super) fn new(
        varied: &VariedSystem,
        excitation: &Excitation,
        recorded: Recorded,
    ) -> Result<(Self, Vec<State>), SensitivityError> {
        let Recorded { states, changes } = recorded;
        let mut out =
            Self { pieces: Vec::new(), at_samples: Vec::with_capacity(states.len()), changes: Vec::new() };
        let mut piece = out.index_of(varied, &start_of(&varied.system, &states[0]));
        for (mut change, segments) in changes {
            let next = out.index_of(varied, &segments);
            if next == piece {
                continue;
            }
            let ((first, since), length) = (change.at, excitation.interval(change.at.0));
            if f64::min(since, length - since) <= AT_SAMPLE * length {
                let sample = if since < 0.5 * length { first } else { first + 1 };
                let link = out.changed(piece, next).next().map_or(0, |(link, ..)| link);
                return Err(SensitivityError::AtSample { link, time: excitation.time(sample) });
            }
            out.at_samples.resize(first + 1, piece);
            change.piece = next;
            out.changes.push(change);
            piece = next;
        }
        out.at_samples.resize(states.len(), piece);
        Ok((out, states))
    }

    /// Index of the piece of these segments.
    fn index_of(&mut self, varied: &VariedSystem, segments: &[(usize, u8)]) -> usize {
        if let Some(known) = self.pieces.iter().position(|piece| piece.segments == segments) {
            return known;
        }
        let (varied, equations) = varied.on_segments(segments);
        let columns = EquationsDerivative::all(&varied);
        let series = PowerSeries::new(&equations);
        self.pieces.push(Piece { segments: segments.to_vec(), varied, equations, columns, series });
        self.pieces.len() - 1
    }

    /// The links that are on different segments of two pieces, with both segments.
    fn changed(&self, before: usize, after: usize) -> impl Iterator<Item = (usize, usize, usize)> {
        let pairs = self.pieces[before].segments.iter().zip(&self.pieces[after].segments);
        pairs.filter(|(a, b)| a != b).map(|(a, b)| (a.0, usize::from(a.1), usize::from(b.1)))
    }

    /// Changes in the interval after a sample.
    fn within(&self, sample: usize) -> &[Change] {
        let start = self.changes.partition_point(|change| change.at.0 < sample);
        let end = self.changes.partition_point(|change| change.at.0 <= sample);
        &self.changes[start..end]
    }

    /// The piece of the whole interval after a sample, if nothing changes in it.
    pub(super) fn of_interval(&self, sample: usize) -> Option<usize> {
        self.within(sample).is_empty().then(|| self.at_samples[sample])
    }

    /// The systems that hold during a run, and the samples at which they do, as far as these are wanted; the `linear` one without contact
    /// changes.
    pub(super) fn samples<'a>(
        contacts: Option<&'a Self>,
        linear: &'a VariedSystem,
        count: usize,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<(&'a VariedSystem, Vec<Range<usize>>)> {
        let mut out: Vec<(&VariedSystem, Vec<Range<usize>>)> = match contacts {
            None => vec![(linear, Vec::new())],
            Some(contacts) => contacts.pieces.iter().map(|piece| (&piece.varied, Vec::new())).collect(),
        };
        for sample in (0..count).filter(|&sample| wanted(sample)) {
            let ranges = &mut out[contacts.map_or(0, |of| of.at_samples[sample])].1;
            match ranges.last_mut() {
                Some(last) if last.end == sample => last.end += 1,
                _ => ranges.push(sample..sample + 1),
            }
        }
        out.retain(|(_, ranges)| !ranges.is_empty());
        out
    }

    /// Passes the interval after a sample with its changes.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn pass(
        &self,
        varied: &VariedSystem,
        sample: usize,
        (length, state, ends): (f64, &State, &[Input; 2]),
        tangents: &mut [State],
    ) {
        let (mut from, mut state, mut index) = (0.0, state, self.at_samples[sample]);
        let mut start = ends[0];
        for change in self.within(sample) {
            let (until, end) = (change.at.1, between(ends, change.at.1 / length));
            self.pieces[index].pass((until - from, state, &[start, end]), tangents);
            self.jump(varied, index, change, tangents);
            (from, state, index, start) = (until, &change.state, change.piece, end);
        }
        self.pieces[index].pass((length - from, state, &[start, ends[1]]), tangents);
    }

    /// The jump of the tangents at a change.
    fn jump(&self, varied: &VariedSystem, before: usize, change: &Change, tangents: &mut [State]) {
        for (link, from, to) in self.changed(before, change.piece) {
            let row = &varied.system.rows()[link];
            let [was, is] = [from, to].map(|segment| row.on_segment(segment).2);
            if was == is {
                continue;
            }
            let impulse = if is { -row.link.damping() } else { row.link.damping() };
            for (tangent, by) in tangents.iter_mut().zip(&varied.derivatives) {
                let of = &by.links[link];
                let turned = of.rate(&varied.system);
                let mut past = of.rest - row.link.law().edge_derivative(usize::min(from, to), &of.law);
                for mode in 0..varied.system.mode_count() {
                    past += turned[mode] / varied.system.frequencies()[mode] * change.state[mode];
                    past += row.deflection[mode] * tangent[mode];
                }
                for mode in 0..6 {
                    tangent[6 + mode] += impulse * row.rate[mode] * past;
                }
            }
        }
    }
}

impl Piece {
    /// The propagator over a length of interval, and its derivatives.
    pub(super) fn recurring(&self, forcing: &Forcing, length: f64) -> Recurring {
        Recurring::new(&self.equations, &self.columns, forcing, length)
    }

    /// Passes a part of an interval.
    #[cfg_attr(feature = "std", inline(always))]
    fn pass(&self, of: (f64, &State, &[Input; 2]), tangents: &mut [State]) {
        let influence = self.varied.system.influence();
        by_series(&self.equations, influence, (&self.columns, &self.series), of, tangents);
    }
}

/// The segments in the state in which a run starts.
fn start_of(system: &System, state: &State) -> Vec<(usize, u8)> {
    system.nonlinear().map(|(link, row)| (link, row.segment_at(state) as u8)).collect()
}
