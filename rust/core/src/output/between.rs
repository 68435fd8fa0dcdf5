//! The largest values of loads between two recorded instants, on the solution there.
//!
//! Between instants a load bows away from the chord. Where the chord and the bow may pass the largest value so far, the piece of the
//! interval waits, and is searched once all are known, or no more may wait: those that are likely largest first, so that most of the
//! others need no search.

use super::extremes::{Extremes, Goal};
use super::loads::Wrench;
use super::search::{Search, moved};
use crate::equations::{PowerSeries, Riders, SegmentEquations, SmoothEquations};
use crate::excitation::{Excitation, Forcing, Instant, Ramp, ScaledExcitation};
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::{add_scaled, scale};
use crate::numeric::simd::dispatch;
use crate::system::{Force, LinkRow, ModelLevel, NO_INPUT, State, System};

/// Pieces that may wait; with few, more of them are searched in vain.
const WAITING: usize = if cfg!(feature = "std") { 96 } else { 24 };

/// Fraction of a piece inside of its end at which the one-sided limit of a load that jumps there is evaluated.
const BESIDE: f64 = 1e-8;

/// The place of a recorded instant: a sample of the excitation, and the time since it, s. None if it is not known.
pub(super) type Place = Option<(usize, f64)>;

/// A piece of an interval between samples, without a contact change within it, in which a value may pass its extreme.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub goal: Goal,
    pub sample: usize,
    /// From the sample to the start of the piece, s.
    pub since: f64,
    /// Length of the piece, s.
    pub h: f64,
    pub ends: [State; 2],
    /// Estimate of the largest value in it, of the negative value if the smallest is sought.
    pub most: f64,
}

/// The pieces that wait, and what their search needs.
#[derive(Debug)]
pub(super) struct Between<'a> {
    system: &'a System,
    excitation: &'a Excitation<'a>,
    forcing: Forcing,
    /// The equations of the linear links alone.
    linear: SegmentEquations,
    /// The segments of the nonlinear links in the last piece, and the equations on them with their series.
    segments: BoundedVec<u8>,
    on_segments: (SegmentEquations, PowerSeries),
    waiting: [Option<Piece>; WAITING],
    count: usize,
    /// Whether loads jump at contact changes, because a damper acts in contact only.
    jumps: bool,
}

impl<'a> Between<'a> {
    pub(super) fn new(system: &'a System, scaled: &ScaledExcitation<'a>) -> Self {
        let ScaledExcitation { excitation, peak, factors } = *scaled;
        let linear = SegmentEquations::of_linear_links(system);
        Self {
            system,
            excitation,
            forcing: Forcing::new(system, &peak, factors).with_riders(excitation),
            linear,
            segments: BoundedVec::filled(u8::MAX, system.nonlinear().count()),
            on_segments: (linear, PowerSeries::new(&linear)),
            waiting: [None; WAITING],
            count: 0,
            jumps: system.rows().iter().any(|row| row.link.is_damped_in_contact()),
        }
    }

    pub(super) fn excitation(&self) -> &'a Excitation<'a> {
        self.excitation
    }

    /// The length of the piece from one place to a later one, s; zero if there is none, or if they are not next to each other.
    pub(super) fn length(&self, [from, to]: [Place; 2]) -> f64 {
        let (Some((sample, since)), Some((next, later))) = (from, to) else { return 0.0 };
        if next == sample {
            later - since
        } else if next == sample + 1 && later == 0.0 {
            self.excitation.interval(sample) - since
        } else {
            0.0
        }
    }

    /// The components of the excitation, with the modal force of a unit of each.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn influences(&self) -> impl Iterator<Item = (usize, &Force)> {
        self.forcing.influences()
    }

    /// The inverses of the intervals before and after a sample, `known` where the lengths agree; 0 at the first and the last sample.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn inverses(&self, sample: usize, lengths: [f64; 2], known: [f64; 2]) -> [f64; 2] {
        if sample == 0 || sample + 1 >= self.excitation.count() {
            return [0.0; 2];
        }
        let mut inverses = known;
        for i in 0..2 {
            let interval = self.excitation.interval(sample - 1 + i);
            if interval != lengths[i] {
                inverses[i] = 1.0 / interval;
            }
        }
        inverses
    }

    /// The change of the rate of a component at a sample, by the inverses of the intervals beside it.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn change_of_rate(&self, sample: usize, component: usize, [before, after]: [f64; 2]) -> f64 {
        if before == 0.0 {
            return 0.0;
        }
        let at = |k: usize| self.excitation.component(k, component);
        let here = at(sample);
        (at(sample + 1) - here) * after - (here - at(sample - 1)) * before
    }

    /// Whether a load may jump at one of these places.
    pub(super) fn jumps_at(&self, places: [Place; 2]) -> bool {
        self.jumps && places.into_iter().flatten().any(|(_, since)| since > 0.0)
    }

    /// Queues a piece. Searches the queue if it is full.
    pub(super) fn wait(&mut self, piece: Piece, loads: &[Wrench], extremes: &mut [Extremes]) {
        self.waiting[self.count] = Some(piece);
        self.count += 1;
        if self.count == WAITING {
            self.prune(extremes);
            if self.count > WAITING / 2 {
                self.search(loads, extremes);
            }
        }
    }

    /// Removes the pieces whose bound is below the present extreme.
    fn prune(&mut self, extremes: &[Extremes]) {
        let mut left = 0;
        for index in 0..self.count {
            if self.waiting[index].is_some_and(|piece| piece.most > extremes[piece.goal.load].of(piece.goal))
            {
                self.waiting.swap(left, index);
                left += 1;
            }
        }
        self.count = left;
    }

    /// Searches the pieces that wait.
    pub(super) fn search(&mut self, loads: &[Wrench], extremes: &mut [Extremes]) {
        self.prune(extremes);
        let Self { waiting, count, .. } = self;
        let waiting = &mut waiting[..*count];
        waiting.sort_unstable_by(|a, b| {
            let most = |piece: &Option<Piece>| piece.map_or(f64::NEG_INFINITY, |piece| piece.most);
            most(b).total_cmp(&most(a))
        });
        for index in 0..self.count {
            if let Some(piece) = self.waiting[index].take() {
                let Goal { load, .. } = piece.goal;
                dispatch!(search_piece(self, &piece, &loads[load], &mut extremes[load]));
            }
        }
        self.count = 0;
    }
}

/// Searches a piece on the equations that hold in it.
#[cfg_attr(feature = "std", inline(always))]
fn search_piece(between: &mut Between, piece: &Piece, load: &Wrench, extremes: &mut Extremes) {
    if piece.most <= extremes.of(piece.goal) {
        return;
    }
    let (system, excitation, forcing) = (between.system, between.excitation, between.forcing);
    let (mut start, mut end) = ([0.0; 9], [0.0; 9]);
    forcing.sample(excitation, piece.sample, &mut start);
    forcing.sample(excitation, piece.sample + 1, &mut end);
    let length = excitation.interval(piece.sample);
    let begin = Instant { first: piece.sample, until: piece.sample + 1, since: 0.0 };
    let whole = Ramp::whole(length, [&start, &end], &forcing, begin);
    let shares = [piece.since / length, (piece.since + piece.h) / length];
    let (start, end) = (whole.values(shares[0]), whole.values(shares[1]));
    let ramp =
        Ramp { h: piece.h, start: &start, end: &end, spans_interval: false, ..whole.later(piece.since) };
    let mut input = [NO_INPUT; 2];
    if load.linear.by_input_at_all {
        input = shares.map(|share| excitation.input_between(piece.sample, share));
        let first = input[0];
        add_scaled(&mut input[1], &first, -1.0);
    }
    let time = excitation.time(piece.sample) + piece.since;
    let inside = inside(system, piece);
    let load = load.on_segments(&inside);
    let beside = if between.jumps { BESIDE } else { 0.0 };
    let ends = [time, f64::min(time + piece.h, excitation.time(piece.sample + 1))];
    let mut search = Search {
        goal: piece.goal,
        ends: &piece.ends,
        load,
        ramp: &ramp,
        beside,
        times: ends,
        input,
        extremes,
    };
    between.find_equations(&inside);
    let (equations, series) = &between.on_segments;
    if system.model_level() == ModelLevel::SmoothNonlinear || !excitation.riders().is_empty() {
        let norm = series.norm(piece.h);
        search.integrate(&SmoothEquations::new(system, *equations, Riders::new(system, excitation)), norm);
    } else {
        search.follow(equations, series);
    }
}

/// A state in which every link is on the segment of its law that it is on in the piece: between the mean of the states at the ends and the
/// middle of the cubics through them. The mean lies on an edge where a link enters and leaves a segment across this edge, and the middle of
/// the cubic may lie beyond an edge that the link just does not reach.
#[cfg_attr(feature = "std", inline(always))]
fn inside(system: &System, piece: &Piece) -> State {
    let [start, end] = &piece.ends;
    let mut inside = moved(start, end, 1.0);
    scale(&mut inside, 0.5);
    for mode in 0..6 {
        let bow = 0.125 * piece.h * system.frequencies()[mode] * (start[6 + mode] - end[6 + mode]);
        inside[mode] += 0.5 * bow;
    }
    inside
}

impl Between<'_> {
    /// Finds the equations that hold in a piece, by a state inside of the segments of all links.
    #[cfg_attr(feature = "std", inline(always))]
    fn find_equations(&mut self, inside: &State) {
        let mut same = true;
        for (known, (_, row)) in self.segments.as_mut_slice().iter_mut().zip(self.system.nonlinear()) {
            let segment = row.segment_at(inside) as u8;
            same &= *known == segment;
            *known = segment;
        }
        if !same {
            let mut segments = self.segments.as_slice().iter();
            let segment = |_: &LinkRow| segments.next().map_or(0, |segment| *segment as usize);
            let equations = self.linear.with_links(self.system, segment);
            self.on_segments = (equations, PowerSeries::new(&equations));
        }
    }
}
