//! The search of a step for its first contact change: by halves until the power series converges, then on the path of each link.

use super::block::LinkBlock;
use super::path::DeflectionPath;
use super::segments::{Change, Combination, Segments};
use crate::equations::{advance, work};
use crate::excitation::Ramp;
use crate::numeric::float::{add_scaled, fma};
use crate::numeric::simd::LANES;
use crate::system::State;

/// Most work of a call, in parts of a power series, a tenth of a second. The run then continues with the rest of the step.
const MAX_WORK: usize = 200_000;

/// Halvings of a step, after which any part is short enough for its series.
const MAX_HALVINGS: usize = 64;

/// Finds the first change in a step that may contain one, with the state there, and the work of the search.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn search(segments: &Segments, ramp: &Ramp, state: &State) -> (Option<(Change, State)>, usize) {
    let Combination { equations, series, .. } = &segments.current;
    // Ends of the parts still to be searched, the nearest last. The tests of the whole step have failed already.
    let mut ends = [1.0; MAX_HALVINGS];
    ends[1] = 0.5;
    let mut ahead = if series.parts(ramp.h) > 1.0 { 2 } else { 1 };
    let (mut from, mut state) = (0.0, *state);
    let mut searched = 0;
    while ahead > 0 {
        let to = ends[ahead - 1];
        if searched >= MAX_WORK {
            return (Some((Change { theta: from, crossing: None }, state)), searched);
        }
        let (start, end) = (ramp.values(from), ramp.values(to));
        let h = (to - from) * ramp.h;
        let part = Ramp { h, start: &start, end: &end, spans_interval: false, ..*ramp };
        searched += work(series.parts(part.h));
        if series.parts(part.h) <= 1.0 {
            let terms = series.terms(equations, &part, &state);
            let mut examined = 0;
            let found = first_exit(segments.blocks.as_slice(), &terms, &mut examined);
            searched += examined / EXAMINED_PER_WORK;
            if let Some(Change { theta, crossing }) = found {
                let change = Change { theta: fma(theta, to - from, from), crossing };
                return (Some((change, sum_at(&terms, theta))), searched);
            }
            for term in &terms[1..] {
                add_scaled(&mut state, term, 1.0);
            }
        } else {
            let next = advance(equations, series, &part, &state);
            let second = segments.second_derivative(&part, &state);
            if ahead < MAX_HALVINGS && !segments.cubics_clear(part.h, [&state, &next], &second) {
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

/// The state at a fraction of a part, from the terms of its power series.
#[cfg_attr(feature = "std", inline(always))]
fn sum_at<const N: usize>(terms: &[State; N], theta: f64) -> State {
    let mut sum = terms[N - 1];
    for term in terms[..N - 1].iter().rev() {
        for i in 0..12 {
            sum[i] = fma(sum[i], theta, term[i]);
        }
    }
    sum
}

/// Parts of the path of a link that cost as much as a part of a power series.
pub(super) const EXAMINED_PER_WORK: usize = 32;

/// The first change on the path of a state over a part of a step, a polynomial in the fraction of the part. Adds the parts of paths that
/// were looked at to `examined`.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn first_exit<const N: usize>(
    blocks: &[LinkBlock],
    terms: &[State; N],
    examined: &mut usize,
) -> Option<Change> {
    let mut first: Option<Change> = None;
    for (index, block) in blocks.iter().enumerate() {
        let mut paths = [[0.0; LANES]; N];
        let mut reached = [0.0; LANES];
        for k in 0..N {
            paths[k] = block.deflections(&terms[k]);
            for i in 0..LANES {
                reached[i] += if k > 0 { paths[k][i].abs() } else { 0.0 };
            }
        }
        for lane in 0..LANES {
            let tolerance = block.tolerance[lane];
            let (low, high) = (block.low[lane] - tolerance, block.high[lane] + tolerance);
            if paths[0][lane] + reached[lane] <= high && paths[0][lane] - reached[lane] >= low {
                continue;
            }
            let mut path = [0.0; N];
            for k in 0..N {
                path[k] = paths[k][lane];
            }
            let limit = if let Some(change) = first { change.theta } else { 1.0 };
            if let Some((theta, up)) = DeflectionPath::new(path).first_exit(low, high, limit, examined) {
                first = Some(Change { theta, crossing: Some((index * LANES + lane, up)) });
            }
        }
    }
    first
}
