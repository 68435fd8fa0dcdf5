//! Integrals over the interval between two samples: of `|v|`, and of `P^p |v|`, for loads that are linear and a speed that is quadratic.

use crate::real::Real;
use crate::rule::{COMPONENTS, Exponent, Rule};

/// Motion at both ends of an interval.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interval<T> {
    /// s.
    pub length: T,
    /// Velocity at both ends, m/s.
    pub velocity: [T; 2],
    /// Acceleration at both ends, m/s²; linear in between.
    pub acceleration: [T; 2],
}

/// Ascending fractions at which an interval is cut, 1 in free places: two turns of the velocity, or a zero of each component.
type Cuts<T, const N: usize> = [T; N];

/// An interval with its cuts at the turns of the velocity.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Travel<T> {
    length: T,
    /// `v = start + s (change + bend (s - 1))` at the fraction s.
    start: T,
    change: T,
    bend: T,
    turns: Cuts<T, 2>,
    /// `∫ |v| dt`, m.
    pub path: T,
}

/// Nodes from -1 to 1 and weights, of sum 1, of Gauss's rule that is exact to degree 9: for powers that are no polynomials.
const NODES: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.118_463_442_528_094_54],
    [-0.538_469_310_105_683_1, 0.239_314_335_249_683_24],
    [0.0, 0.284_444_444_444_444_44],
    [0.538_469_310_105_683_1, 0.239_314_335_249_683_24],
    [0.906_179_845_938_664, 0.118_463_442_528_094_54],
];

/// Puts a fraction within the interval in its place; any other, or NaN, is none.
fn cut<T: Real, const N: usize>(cuts: &mut Cuts<T, N>, fraction: T) {
    if fraction > T::ZERO && fraction < T::ONE {
        let mut inserted = fraction;
        for place in cuts {
            if inserted < *place {
                core::mem::swap(place, &mut inserted);
            }
        }
    }
}

/// Calls `piece(from, to)` for the pieces between the cuts.
fn for_each_piece<T: Real, const N: usize>(cuts: &Cuts<T, N>, mut piece: impl FnMut(T, T)) {
    let mut from = T::ZERO;
    for &to in cuts {
        if to > from {
            piece(from, to);
        }
        from = to;
    }
    if from < T::ONE {
        piece(from, T::ONE);
    }
}

impl<T: Real> Travel<T> {
    pub(crate) fn new(interval: &Interval<T>) -> Self {
        let ([start, end], [first, last]) = (interval.velocity, interval.acceleration);
        let bend = T::from_f64(0.5) * interval.length * (last - first);
        let change = end - start;
        let mut turns = [T::ONE; 2];
        // The velocity deviates from a straight line by at most a quarter of the bend.
        let nearest = if start.abs() < end.abs() { start.abs() } else { end.abs() };
        if !(start * end > T::ZERO && bend.abs() < T::from_f64(4.0) * nearest) {
            let linear = change - bend;
            let discriminant = linear * linear - T::from_f64(4.0) * bend * start;
            if discriminant >= T::ZERO {
                let root = discriminant.sqrt();
                let root = if linear < T::ZERO { -root } else { root };
                let large = T::from_f64(-0.5) * (linear + root);
                cut(&mut turns, large / bend);
                cut(&mut turns, start / large);
            }
        }
        let mut travel = Self { length: interval.length, start, change, bend, turns, path: T::ZERO };
        let mut path = T::ZERO;
        for_each_piece(&turns, |from, to| {
            let [even, _, bend] = travel.on_piece(from, to);
            path += (even + bend * T::from_f64(1.0 / 3.0)).abs() * (to - from);
        });
        travel.path = path * interval.length;
        travel
    }

    /// Coefficients of 1, x, x² of the velocity between two fractions, x from -1 to 1.
    fn on_piece(&self, from: T, to: T) -> [T; 3] {
        let half = T::from_f64(0.5);
        let (middle, half) = (half * (from + to), half * (to - from));
        let slope = self.change + self.bend * (middle + middle - T::ONE);
        let even = self.start + middle * (self.change + self.bend * (middle - T::ONE));
        [even, half * slope, half * half * self.bend]
    }

    /// `∫ P^p |v| dt` of one carriage, N^p m, from its loads at both ends.
    pub(crate) fn power(&self, rule: &Rule<T>, exponent: Exponent, loads: [&[T; COMPONENTS]; 2]) -> T {
        if self.path == T::ZERO {
            return T::ZERO;
        }
        let mut cuts = [T::ONE; COMPONENTS];
        let [before, after] = loads;
        for ((&first, &last), counted) in before.iter().zip(after).zip(rule.counted()) {
            if first * last < T::ZERO && counted {
                cut(&mut cuts, first / (first - last));
            }
        }
        let mut sum = T::ZERO;
        let mut first = rule.groups(before);
        for_each_piece(&cuts, |from, to| {
            let last = if to < T::ONE { rule.groups(&between(rule, loads, to)) } else { rule.groups(after) };
            sum += self.groups_linear(rule, exponent, [from, to], [first, last]);
            first = last;
        });
        sum * self.length
    }

    /// Over a piece on which both groups are linear: cut where they are equal.
    fn groups_linear(
        &self,
        rule: &Rule<T>,
        exponent: Exponent,
        [from, to]: [T; 2],
        [first, last]: [[T; 2]; 2],
    ) -> T {
        let (before, after) = (first[0] - first[1], last[0] - last[1]);
        let ends = [rule.combined(first), rule.combined(last)];
        if rule.plain != 0 || before * after >= T::ZERO {
            return self.load_linear(rule, exponent, [from, to], ends);
        }
        let share = before / (before - after);
        let even = first[0] + share * (last[0] - first[0]);
        let (at, middle) = (from + share * (to - from), rule.combined([even, even]));
        self.load_linear(rule, exponent, [from, at], [ends[0], middle])
            + self.load_linear(rule, exponent, [at, to], [middle, ends[1]])
    }

    /// Over a piece on which P without preload is linear: cut where the preload begins to act.
    fn load_linear(
        &self,
        rule: &Rule<T>,
        exponent: Exponent,
        [from, to]: [T; 2],
        [first, last]: [T; 2],
    ) -> T {
        let (before, after) = (first - rule.opening, last - rule.opening);
        if before * after >= T::ZERO {
            return self.one_branch(rule, exponent, [from, to], [first, last]);
        }
        let at = from + before / (before - after) * (to - from);
        self.one_branch(rule, exponent, [from, at], [first, rule.opening])
            + self.one_branch(rule, exponent, [at, to], [rule.opening, last])
    }

    /// Over a piece on which the preload acts everywhere or nowhere.
    fn one_branch(&self, rule: &Rule<T>, exponent: Exponent, [from, to]: [T; 2], [first, last]: [T; 2]) -> T {
        if exponent == Exponent::Ball && rule.opening == T::ZERO {
            return self.by_turns([from, to], [first, last], mean_of_cube);
        }
        let raise = first + last < rule.opening + rule.opening;
        self.by_turns([from, to], [first, last], |ends, speed| {
            mean_by_nodes(ends, speed, |load| exponent.power(if raise { rule.raised(load) } else { load }))
        })
    }

    /// Over a piece on which the load is linear, cut where the velocity turns. `mean`: of the power times a velocity, from the loads at both
    /// ends and the coefficients of 1, x, x² of the velocity.
    fn by_turns(&self, [from, to]: [T; 2], [first, last]: [T; 2], mean: impl Fn([T; 2], [T; 3]) -> T) -> T {
        let (mut sum, mut start, mut load) = (T::ZERO, from, first);
        for &turn in &self.turns {
            if turn > from && turn < to {
                let there = first + (turn - from) / (to - from) * (last - first);
                sum += mean([load, there], self.on_piece(start, turn)).abs() * (turn - start);
                (start, load) = (turn, there);
            }
        }
        sum + mean([load, last], self.on_piece(start, to)).abs() * (to - start)
    }
}

/// Mean of `P³ v` over x from -1 to 1, P linear.
fn mean_of_cube<T: Real>([first, last]: [T; 2], [even, odd, bend]: [T; 3]) -> T {
    let half = T::from_f64(0.5);
    let (middle, half) = (half * (first + last), half * (last - first));
    let (of_middle, of_half) = (middle * middle, half * half);
    even * middle * (of_middle + of_half)
        + odd * half * (of_middle + T::from_f64(0.2) * of_half)
        + bend * middle * (T::from_f64(1.0 / 3.0) * of_middle + T::from_f64(0.6) * of_half)
}

/// Mean of `power(P) v` over x from -1 to 1, P linear.
fn mean_by_nodes<T: Real>([first, last]: [T; 2], [even, odd, bend]: [T; 3], power: impl Fn(T) -> T) -> T {
    let half = T::from_f64(0.5);
    let (middle, half) = (half * (first + last), half * (last - first));
    let mut sum = T::ZERO;
    for [node, weight] in NODES {
        let (node, weight) = (T::from_f64(node), T::from_f64(weight));
        sum += weight * power(middle + half * node) * (even + node * (odd + node * bend));
    }
    sum
}

/// Counted components of the load at a fraction of the interval, and zeros.
fn between<T: Real>(rule: &Rule<T>, [first, last]: [&[T; COMPONENTS]; 2], s: T) -> [T; COMPONENTS] {
    let mut out = [T::ZERO; COMPONENTS];
    for (((value, &first), &last), counted) in out.iter_mut().zip(first).zip(last).zip(rule.counted()) {
        if counted {
            *value = first + s * (last - first);
        }
    }
    out
}
