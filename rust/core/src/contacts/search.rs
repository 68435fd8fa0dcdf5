//! The search of a step for its first contact change: by halves until the power series holds, then on the path of each link.

use super::block::LANES;
use super::path::Path;
use super::{Change, Contacts, Made};
use crate::float::{add_scaled, fma};
use crate::integrate::Ramp;
use crate::propagator::{TERMS, advance};
use crate::simd::{Kernel, widest};
use crate::system::State;

impl Contacts<'_> {
    /// The first change in a step that may contain one.
    #[inline(never)]
    pub(super) fn search(&mut self, ramp: &Ramp, state: &State) -> Option<Change> {
        let (change, searched) = widest(Search { contacts: self, ramp, state });
        self.searched += searched;
        change
    }

    /// The first change on the power series of a state over a part of a step.
    #[cfg_attr(feature = "std", inline(always))]
    fn search_series(&self, terms: &[State; TERMS + 1]) -> Option<Change> {
        let mut first: Option<Change> = None;
        for (index, block) in self.blocks.all().iter().enumerate() {
            let mut paths = [[0.0; LANES]; TERMS + 1];
            let mut reached = [0.0; LANES];
            for k in 0..=TERMS {
                paths[k] = block.deflections(&terms[k]);
                for i in 0..LANES {
                    reached[i] += if k > 0 { paths[k][i].abs() } else { 0.0 };
                }
            }
            for lane in 0..LANES {
                let (low, high) = (block.low[lane] - block.slack[lane], block.high[lane] + block.slack[lane]);
                if paths[0][lane] + reached[lane] <= high && paths[0][lane] - reached[lane] >= low {
                    continue;
                }
                let mut path = [0.0; TERMS + 1];
                for k in 0..=TERMS {
                    path[k] = paths[k][lane];
                }
                let limit = if let Some(change) = first { change.theta } else { 1.0 };
                if let Some((theta, up)) = Path::new(path).first_exit(low, high, limit) {
                    first = Some(Change { theta, crossing: Some((index * LANES + lane, up)) });
                }
            }
        }
        first
    }
}

/// Parts of one step that are looked into at a time, about a second's work: then the run may count them.
const MOST_PARTS: usize = 1_000_000;

/// Halvings of a step, after which any is short.
const MOST_HALVINGS: usize = 64;

/// [`Contacts::search`] for the processor at hand; also how many parts it looked into.
struct Search<'a> {
    contacts: &'a Contacts<'a>,
    ramp: &'a Ramp<'a>,
    state: &'a State,
}

impl Kernel for Search<'_> {
    type Output = (Option<Change>, usize);

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> Self::Output {
        let Self { contacts, ramp, state } = self;
        let Made { piece, series, .. } = &contacts.made;
        // Parts that lie ahead, the nearest last: where they end. The whole is known not to be clear.
        let mut ends = [1.0; MOST_HALVINGS];
        ends[1] = 0.5;
        let mut ahead = if series.parts(ramp.h) > 1.0 { 2 } else { 1 };
        let (mut from, mut state) = (0.0, *state);
        let mut searched = 0;
        while ahead > 0 {
            let to = ends[ahead - 1];
            if searched == MOST_PARTS {
                return (Some(Change { theta: from, crossing: None }), searched);
            }
            searched += 1;
            let (start, end) = (ramp.values(from), ramp.values(to));
            let part =
                Ramp { h: (to - from) * ramp.h, start: &start, end: &end, drive: ramp.drive, whole: false };
            if series.parts(part.h) <= 1.0 {
                let terms = series.terms(piece, &part, &state);
                if let Some(Change { theta, crossing }) = contacts.search_series(&terms) {
                    return (Some(Change { theta: fma(theta, to - from, from), crossing }), searched);
                }
                for term in &terms[1..] {
                    add_scaled(&mut state, term, 1.0);
                }
            } else {
                let next = advance(piece, series, &part, &state);
                if ahead < MOST_HALVINGS && !contacts.cubics_clear(&part, &state, &next) {
                    ends[ahead] = 0.5 * (from + to);
                    ahead += 1;
                    continue;
                }
                state = next;
            }
            from = to;
            ahead -= 1;
        }
        (None, searched)
    }
}
