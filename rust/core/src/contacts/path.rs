//! The time at which a deflection leaves its segment, on a polynomial in time.

use crate::numeric::float::fma;

/// A deflection over a step: a polynomial in the fraction of the step, of N terms.
pub(super) struct DeflectionPath<const N: usize> {
    terms: [f64; N],
    /// Bound on the fourth derivative.
    fourth: f64,
}

/// Largest number of halvings of a step: in a shorter part a path can turn back only within rounding.
const HALVINGS: usize = 30;

/// Largest number of parts of a step that are examined. A path that touches an edge needs some sixty, one that runs along an edge would need
/// all.
const MAX_EXAMINED: usize = 1000;

/// Largest number of steps of the root search; each gains a digit or more.
const ROOT_STEPS: usize = 60;

impl<const N: usize> DeflectionPath<N> {
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn new(terms: [f64; N]) -> Self {
        let mut fourth = 0.0;
        for k in 4..N {
            fourth = fma((k * (k - 1) * (k - 2) * (k - 3)) as f64, terms[k].abs(), fourth);
        }
        Self { terms, fourth }
    }

    /// Value and slope at a fraction of the step.
    #[cfg_attr(feature = "std", inline(always))]
    fn at(&self, theta: f64) -> [f64; 2] {
        let (mut value, mut slope) = (0.0, 0.0);
        for term in self.terms.iter().rev() {
            slope = fma(slope, theta, value);
            value = fma(value, theta, *term);
        }
        [value, slope]
    }

    /// The first fraction up to `limit` at which the path leaves `low..=high`, and whether upwards. A path that starts outside leaves
    /// once it moves farther out. Adds the number of parts looked at to `examined`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn first_exit(
        &self,
        low: f64,
        high: f64,
        limit: f64,
        examined: &mut usize,
    ) -> Option<(f64, bool)> {
        let mut start = [self.terms[0], self.terms[1]];
        if start[0] > high && start[1] > 0.0 || start[0] < low && start[1] < 0.0 {
            return Some((0.0, start[0] > high));
        }
        let (low, high) = (f64::min(low, start[0]), f64::max(high, start[0]));
        // Ends of the parts still to be examined, the nearest last.
        let mut ends = [(0.0, [0.0; 2]); HALVINGS + 1];
        ends[0] = (limit, self.at(limit));
        let (mut ahead, mut a, most) = (1, 0.0, *examined + MAX_EXAMINED);
        while ahead > 0 {
            let (b, end) = ends[ahead - 1];
            *examined += 1;
            match self.test_part(a, start, b, end, low, high) {
                PartTest::Inside => {}
                PartTest::Exit(theta, up) => return Some((theta, up)),
                PartTest::Undecided if ahead <= HALVINGS && *examined < most => {
                    let middle = 0.5 * (a + b);
                    ends[ahead] = (middle, self.at(middle));
                    ahead += 1;
                    continue;
                }
                PartTest::Undecided if end[0] < low || end[0] > high => return Some((b, end[0] > high)),
                PartTest::Undecided => {}
            }
            (a, start) = (b, end);
            ahead -= 1;
        }
        None
    }

    /// Whether the path leaves within a part, from the values and slopes at both ends of the part.
    #[cfg_attr(feature = "std", inline(always))]
    fn test_part(&self, a: f64, start: [f64; 2], b: f64, end: [f64; 2], low: f64, high: f64) -> PartTest {
        let h = b - a;
        // Control points of the cubic, and its error; then control points and error of its slope.
        let margin = self.fourth * h * h * h * h / 384.0;
        let (after, before) = (start[0] + h / 3.0 * start[1], end[0] - h / 3.0 * end[1]);
        let (top, bottom) =
            (f64::max(f64::max(after, before), end[0]), f64::min(f64::min(after, before), end[0]));
        if bottom - margin >= low && top + margin <= high {
            return PartTest::Inside;
        }
        let up = end[0] > high;
        if up || end[0] < low {
            let (bow, margin) =
                (3.0 * (end[0] - start[0]) / h - start[1] - end[1], self.fourth * h * h * h / 100.0);
            let sign = if up { 1.0 } else { -1.0 };
            if f64::min(f64::min(sign * start[1], sign * end[1]), sign * bow) > margin {
                return PartTest::Exit(self.root([a, b], [start, end], if up { high } else { low }, up), up);
            }
        }
        PartTest::Undecided
    }

    /// The fraction at which a path that only rises (`up`) or only falls passes `edge`: Newton within a bracket, from the cubic in the
    /// deflection through both ends, where the path has these values and slopes.
    #[cfg_attr(feature = "std", inline(always))]
    fn root(&self, [mut a, mut b]: [f64; 2], [start, end]: [[f64; 2]; 2], edge: f64, up: bool) -> f64 {
        let rise = end[0] - start[0];
        let (part, left) = ((edge - start[0]) / rise, (end[0] - edge) / rise);
        let bend = rise * (left / start[1] - part / end[1]) + (b - a) * (part - left);
        let mut theta = fma(part, fma(left, bend, b - a), a);
        if !(theta > a && theta < b) {
            theta = 0.5 * (a + b);
        }
        for _ in 0..ROOT_STEPS {
            let [value, slope] = self.at(theta);
            if (value > edge) == up {
                b = theta
            } else {
                a = theta
            }
            let next = theta - (value - edge) / slope;
            if (next - theta).abs() <= 4.0 * f64::EPSILON * theta || b - a <= 2.0 * f64::EPSILON * b {
                break;
            }
            theta = if next > a && next < b { next } else { 0.5 * (a + b) };
        }
        theta
    }
}

/// Result of the test of a part of a path.
enum PartTest {
    /// It stays inside.
    Inside,
    /// It leaves at this fraction, and whether upwards.
    Exit(f64, bool),
    /// Undecided: examine its halves.
    Undecided,
}
