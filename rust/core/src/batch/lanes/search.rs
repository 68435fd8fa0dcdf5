//! The search of the intervals that wait, in an interval of each scene at a time.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::curve::{Curve, Scenes};
use super::dense::MAX_MODES;
use super::memory::{HIGH, HIGH_AT, LOW, LOW_AT, STATISTICS};
use super::modal::{ModalScenes, width};
use super::vector::{Complex, Real, vectorize};
use super::waiting::{Piece, Waiting};
use crate::batch::equivalent::EquivalentRows;
use crate::batch::requirements::Signal;
use crate::numeric::simd::MAX_LANES;

/// Searches the pieces that wait, and notes the extremes found.
pub(super) struct Search<'a> {
    pub scenes: Scenes<'a>,
    /// Index of the first sample of the window in the motion.
    pub first: usize,
    pub waiting: &'a mut Waiting,
    pub found: &'a mut AlignedBuffer,
}

impl Search<'_> {
    /// Runs the search. (A call of its own: within the loop over the blocks it would take the stack of a thread many times over.)
    #[inline(never)]
    pub(super) fn run<S: Simd>(mut self, simd: S) {
        vectorize!(simd, self.search(simd));
    }

    #[inline(always)]
    fn search<S: Simd>(&mut self, simd: S) {
        for lane in 0..S::F64_LANES {
            let mut pieces = core::mem::take(&mut self.waiting.pieces[lane]);
            pieces.retain(|piece| piece.most > self.extreme::<S>(piece, lane));
            // Those that are likely highest first, so that most of the others need no search.
            pieces.sort_unstable_by(|a, b| {
                (a.signal, a.largest).cmp(&(b.signal, b.largest)).then(b.most.total_cmp(&a.most))
            });
            self.waiting.pieces[lane] = pieces;
        }
        let mut next = [0; MAX_LANES];
        loop {
            let mut some: [Option<Piece>; MAX_LANES] = [None; MAX_LANES];
            for lane in 0..S::F64_LANES {
                while let Some(piece) = self.waiting.pieces[lane].get(next[lane]) {
                    next[lane] += 1;
                    if piece.most > self.extreme::<S>(piece, lane) {
                        some[lane] = Some(*piece);
                        break;
                    }
                }
            }
            if some.iter().all(Option::is_none) {
                break;
            }
            let known = Real::gather(simd, |lane| match &some[lane] {
                Some(piece) => self.extreme::<S>(piece, lane),
                None => f64::INFINITY,
            });
            let curve = Curve::new(simd, &self.scenes, self.waiting, &some);
            let [tops, times] = curve.top(simd, known);
            let is_equivalent = |piece: &Piece| self.equivalent_of(piece).is_some();
            let states = some.iter().flatten().any(is_equivalent).then(|| curve.state(simd, times));
            for (lane, piece) in some.iter().enumerate() {
                let Some(piece) = piece else { continue };
                let share = times.lane(lane) / self.scenes.timeline.intervals[piece.end];
                self.note::<S>(piece, lane, (tops.lane(lane), share));
                if let Some(states) = &states {
                    self.search_again(simd, piece, (lane, next[lane]), (tops.lane(lane), share), states);
                }
            }
        }
        self.waiting.clear();
    }

    /// The extreme so far that a piece may pass; the negative one if it is the smallest.
    fn extreme<S: Simd>(&self, piece: &Piece, lane: usize) -> f64 {
        let at = piece.signal * STATISTICS;
        if piece.largest {
            self.found.lane(at + HIGH, lane, S::F64_LANES)
        } else {
            -self.found.lane(at + LOW, lane, S::F64_LANES)
        }
    }

    /// The equivalent load that a piece is of.
    fn equivalent_of(&self, piece: &Piece) -> Option<&EquivalentRows> {
        match self.scenes.requirements.signals[piece.signal].signal {
            Signal::Equivalent(index) => Some(&self.scenes.requirements.equivalents[index]),
            _ => None,
        }
    }

    /// If a piece is of an equivalent load that is another linear combination at the top found, or without one in the middle, because a
    /// component changes its sign and back, notes this load, and lets the piece with that combination wait at a place in its lane. With each
    /// top the load is larger, so this ends.
    fn search_again<S: Simd>(
        &mut self,
        simd: S,
        piece: &Piece,
        (lane, place): (usize, usize),
        (top, share): (f64, f64),
        states: &[Complex<S>; MAX_MODES],
    ) {
        let Some(equivalent) = self.equivalent_of(piece) else { return };
        let components =
            equivalent.components(|row| self.value::<S>(simd, row, (piece.end, lane), share, states));
        let slopes = equivalent.rule.gradient(&components);
        let load = slopes.iter().zip(components).map(|(slope, component)| slope * component).sum();
        let is_higher = load > self.extreme::<S>(piece, lane);
        if slopes != self.waiting.slopes[piece.slopes] && (is_higher || top == f64::NEG_INFINITY) {
            self.note::<S>(piece, lane, (load, share));
            self.waiting.slopes.push(slopes);
            let again = Piece { slopes: self.waiting.slopes.len() - 1, ..*piece };
            self.waiting.pieces[lane].insert(place, again);
        }
    }

    /// The value of a row in one lane, at a share of the interval before a sample, with v there.
    fn value<S: Simd>(
        &self,
        simd: S,
        row: usize,
        (end, lane): (usize, usize),
        share: f64,
        states: &[Complex<S>; MAX_MODES],
    ) -> f64 {
        let (components, modes) =
            (self.scenes.timeline.components.len(), self.scenes.modal.eigenvalues.vectors::<S>().len() / 2);
        let width = width(modes, components);
        let number = |index: usize| {
            self.scenes.modal.tiles.lane(ModalScenes::place(row, index, width), lane, S::F64_LANES)
        };
        let mut value = number(0);
        for component in 0..components {
            let [last, now] = [1, 0].map(|back| self.scenes.input(simd, end - back, component, lane));
            value += number(1 + component) * (last + share * (now - last));
        }
        for (mode, v) in states[..modes].iter().enumerate() {
            let at = 1 + components + 2 * mode;
            value += number(at) * v.re.lane(lane) + number(at + 1) * v.im.lane(lane);
        }
        value
    }

    /// Notes the top of a piece, at a share of its interval.
    fn note<S: Simd>(&mut self, piece: &Piece, lane: usize, (top, share): (f64, f64)) {
        if top > self.extreme::<S>(piece, lane) {
            let at = piece.signal * STATISTICS;
            let (value, place) = if piece.largest { (HIGH, HIGH_AT) } else { (LOW, LOW_AT) };
            *self.found.lane_mut(at + value, lane, S::F64_LANES) = if piece.largest { top } else { -top };
            *self.found.lane_mut(at + place, lane, S::F64_LANES) =
                (self.first + piece.end - 1) as f64 + share;
        }
    }
}
