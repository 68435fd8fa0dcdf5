//! Contact changes where some laws are smooth: the path of a step is then known from the dense output of the method alone.
//!
//! Between two changes every law is smooth, as a link with straight segments follows the line of its segment beyond the edges, too. The
//! dense output is a polynomial, on which the first edge is found with certainty; the step is then made again up to there. So an excursion
//! beyond an edge is missed only if the dense output does not show it, and that is as accurate as the steps.

use super::search::{EXAMINED_PER_WORK, first_exit};
use super::segments::{Change, Segments};
use super::switched::SwitchedEquations;
use crate::equations::{Riders, SmoothEquations};
use crate::excitation::{Excitation, Ramp};
use crate::numeric::float::{add_scaled, scale};
use crate::numeric::simd::dispatch;
use crate::system::{State, System};

/// Points that determine the dense output of a step, a polynomial of degree five or less: the ends, and four between them.
const DENSE_POINTS: usize = 6;

/// Part of the tolerance by which a load may be wrong because its link has passed an edge that does not count as passed yet. A link
/// that trembles about an edge by less than the error of the steps would change at each of them.
const SLACK: f64 = 1e-4;

/// Part of a step within which a preloaded row must be about to open for the step to count as one that ends at that edge.
const NEAR: f64 = 0.25;

/// Combinations of segments whose equations are cached. They are cheap to make; those that come again keep the tangents of a method.
const CACHED_COMBINATIONS: usize = 4;

/// Contacts of one run.
#[derive(Debug)]
pub(crate) struct SmoothContacts<'a> {
    segments: Segments<'a, CACHED_COMBINATIONS>,
    equations: SmoothEquations<'a>,
    /// The change that ends the present step.
    change: Option<Change>,
    /// Links that have changed their segment so far.
    changes: usize,
    /// Parts of the paths of links that searches have looked at so far.
    examined: usize,
}

impl<'a> SmoothContacts<'a> {
    /// The contacts in `state`, in which a run starts. `load_scale`: size of the loads, N; `rtol`: tolerance of the run relative to it.
    pub(crate) fn new(
        system: &'a System,
        excitation: &'a Excitation<'a>,
        state: &State,
        load_scale: f64,
        rtol: f64,
    ) -> Self {
        let mut segments = Segments::new(system, state, load_scale, SLACK * rtol);
        segments.update();
        let equations =
            SmoothEquations::new(system, segments.current.equations, Riders::new(system, excitation));
        let mut contacts = Self { segments, equations, change: None, changes: 0, examined: 0 };
        contacts.cross(state);
        contacts
    }

    /// The fraction at which the first link passes an edge in a step of length `h` through these states at equal distances, if one does;
    /// the whole step if its end is so near the edge of a preloaded law that its error must be judged as at the edge.
    #[inline(never)]
    fn search(&mut self, h: f64, path: &[State; DENSE_POINTS]) -> Option<f64> {
        let blocks = self.segments.blocks.as_slice();
        self.change = dispatch!(first_exit(blocks, &power_terms(path), &mut self.examined));
        if self.change.is_none() && self.segments.nears_smooth_edge(NEAR * h, &path[DENSE_POINTS - 1]) {
            self.change = Some(Change { theta: 1.0, crossing: None });
        }
        self.change.map(|change| change.theta)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn switch(&mut self, state: &State) {
        if let Some(Change { crossing: Some(crossing), .. }) = self.change.take() {
            self.changes += self.segments.cross(state, crossing);
        }
        self.segments.update();
        self.equations.set_linear(&self.segments.current.equations);
    }
}

impl<'a> SwitchedEquations for SmoothContacts<'a> {
    type Equations = SmoothEquations<'a>;

    #[cfg_attr(feature = "std", inline(always))]
    fn equations(&self) -> &SmoothEquations<'a> {
        &self.equations
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn first_change(
        &mut self,
        ramp: &Ramp,
        [state, next]: [&State; 2],
        mut between: impl FnMut(&SmoothEquations<'a>, f64) -> State,
    ) -> Option<f64> {
        let mut far = true;
        for block in self.segments.blocks.as_slice() {
            far = far && block.cubics_far_from_edges(ramp.h, state, next);
        }
        if far {
            return None;
        }
        let mut path = [*state; DENSE_POINTS];
        path[DENSE_POINTS - 1] = *next;
        for point in 1..DENSE_POINTS - 1 {
            path[point] = between(&self.equations, point as f64 / (DENSE_POINTS - 1) as f64);
        }
        self.search(ramp.h, &path)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn stays(&mut self, _: &Ramp, _: &State, _: &State) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn missed_by(&self, state: &State) -> Option<f64> {
        self.segments.missed_by(state, self.change?.crossing?)
    }

    #[inline(never)]
    fn cross(&mut self, state: &State) {
        dispatch!(self.switch(state));
    }

    fn segments(&self) -> &[(usize, u8)] {
        self.segments.present()
    }

    fn changes(&self) -> usize {
        self.changes
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn searched(&self) -> usize {
        self.examined / EXAMINED_PER_WORK
    }
}

/// Terms of the polynomial in the fraction of a step that takes these values at equal distances: Newton's forward differences, expanded.
#[cfg_attr(feature = "std", inline(always))]
fn power_terms(path: &[State; DENSE_POINTS]) -> [State; DENSE_POINTS] {
    const LAST: usize = DENSE_POINTS - 1;
    let mut differences = *path;
    for order in 1..DENSE_POINTS {
        for k in (order..DENSE_POINTS).rev() {
            let before = differences[k - 1];
            add_scaled(&mut differences[k], &before, -1.0);
        }
    }
    // p <- (s - k) / (k + 1) p + difference k, with s = LAST * fraction.
    let mut terms = [[0.0; 12]; DENSE_POINTS];
    terms[0] = differences[LAST];
    for k in (0..LAST).rev() {
        let (shift, stretch) = (-(k as f64) / (k + 1) as f64, LAST as f64 / (k + 1) as f64);
        for power in (0..LAST - k).rev() {
            let lower = terms[power];
            add_scaled(&mut terms[power + 1], &lower, stretch);
            scale(&mut terms[power], shift);
        }
        add_scaled(&mut terms[0], &differences[k], 1.0);
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::{DENSE_POINTS, power_terms};

    /// A polynomial of degree five is found from its values.
    #[test]
    fn power_terms_are_those_of_the_polynomial() {
        let terms = [3.0, -1.0, 4.0, -1.5, 9.0, -2.6];
        let mut path = [[0.0; 12]; DENSE_POINTS];
        for (point, state) in path.iter_mut().enumerate() {
            let theta = point as f64 / 5.0;
            state[7] = terms.iter().rev().fold(0.0, |sum, term| sum * theta + term);
        }
        for (found, expected) in power_terms(&path).iter().zip(terms) {
            assert!((found[7] - expected).abs() < 1e-12, "{} {expected}", found[7]);
            assert_eq!(found[0], 0.0);
        }
    }
}
