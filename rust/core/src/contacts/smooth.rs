//! Contact changes where some laws are smooth: the path of a step is then known from the dense output of the method alone.
//!
//! Between two changes every law is smooth, as a link with straight segments follows the line of its segment beyond the edges, too. The
//! dense output is a polynomial, on which the first edge is found with certainty; the step is then made again up to there. So an excursion
//! beyond an edge is missed only if the dense output does not show it, and that is as accurate as the steps.

use super::search::first_exit;
use super::segments::{Change, Segments};
use crate::equations::SmoothEquations;
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{Kernel, dispatch};
use crate::system::{State, System};

/// Points that determine the dense output of a step, a polynomial of degree five or less: the ends, and four between them.
pub(crate) const DENSE_POINTS: usize = 6;

/// Part of the tolerance by which a load may be wrong because its link has passed an edge that does not count as passed yet. A link
/// that trembles about an edge by less than the error of the steps would change at each of them.
const SLACK: f64 = 1e-4;

/// Contacts of one run.
#[derive(Debug)]
pub(crate) struct SmoothContacts<'a> {
    segments: Segments<'a>,
    equations: SmoothEquations<'a>,
    /// The change that ends the present step.
    change: Option<Change>,
    /// Links that have changed their segment so far.
    pub changes: usize,
}

impl<'a> SmoothContacts<'a> {
    /// The contacts at rest. `load_scale`: size of the loads, N; `rtol`: tolerance of the run relative to it.
    pub(crate) fn new(system: &'a System, load_scale: f64, rtol: f64) -> Self {
        let mut segments = Segments::new(system, load_scale, SLACK * rtol);
        segments.update();
        let equations = SmoothEquations::new(system, segments.current.equations);
        Self { segments, equations, change: None, changes: 0 }
    }

    /// The equations until the next change.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn equations(&self) -> &SmoothEquations<'a> {
        &self.equations
    }

    /// Whether the ends of a step of length `h` show that no link passes an edge.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn far_from_edges(&self, h: f64, state: &State, next: &State) -> bool {
        self.segments.far_from_edges(h, state, next)
    }

    /// The fraction at which the first link passes an edge in a step through these states at equal distances, if one does.
    #[inline(never)]
    pub(crate) fn first_change(&mut self, path: &[State; DENSE_POINTS]) -> Option<f64> {
        self.change = dispatch(ChangeKernel { segments: &self.segments, path });
        self.change.map(|change| change.theta)
    }

    /// How much later than in `state` the link of the change that was found is where it counts as past its edge, s; none if it is there
    /// within the tolerance of the edge.
    #[inline(never)]
    pub(crate) fn missed_by(&self, state: &State) -> Option<f64> {
        self.segments.missed_by(state, self.change?.crossing?)
    }

    /// Takes up the equations after the change that was found; the step ended with it, in `state`.
    #[inline(never)]
    pub(crate) fn cross(&mut self, state: &State) {
        if let Some(Change { crossing: Some(crossing), .. }) = self.change.take() {
            self.changes += self.segments.cross(state, crossing);
        }
        self.segments.update();
        self.equations.set_linear(&self.segments.current.equations);
    }
}

/// [`SmoothContacts::first_change`] as a kernel.
struct ChangeKernel<'a> {
    segments: &'a Segments<'a>,
    path: &'a [State; DENSE_POINTS],
}

impl Kernel for ChangeKernel<'_> {
    type Output = Option<Change>;

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> Option<Change> {
        first_exit(self.segments, &power_terms(self.path))
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
            for i in 0..12 {
                differences[k][i] = (differences[k][i] - before[i]) / order as f64;
            }
        }
    }
    // p <- (s - k) p + difference k, with s = LAST * fraction.
    let mut terms = [[0.0; 12]; DENSE_POINTS];
    terms[0] = differences[LAST];
    for k in (0..LAST).rev() {
        for power in (1..DENSE_POINTS - k).rev() {
            let lower = terms[power - 1];
            for i in 0..12 {
                terms[power][i] *= -(k as f64);
            }
            add_scaled(&mut terms[power], &lower, LAST as f64);
        }
        for i in 0..12 {
            terms[0][i] = differences[k][i] - k as f64 * terms[0][i];
        }
    }
    terms
}
