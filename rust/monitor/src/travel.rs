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

/// Instants at which an interval is cut: two turns of the velocity, one zero of each component; 1 in free places.
const MOST_CUTS: usize = 2 + COMPONENTS;

/// Ascending fractions of an interval.
type Cuts<T> = [T; MOST_CUTS];

/// An interval with its cuts at the turns of the velocity.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Travel<T> {
    length: T,
    /// `v = start + s (change + bend (s - 1))` at the fraction s.
    start: T,
    change: T,
    bend: T,
    turns: Cuts<T>,
    /// `∫ |v| dt`, m.
    pub path: T,
}

/// Nodes from -1 to 1 and weights, of sum 1, of Gauss's rules: with three, exact to degree 5, which is `P³ v`.
const THREE: [[f64; 2]; 3] =
    [[-0.774_596_669_241_483_4, 5.0 / 18.0], [0.0, 8.0 / 18.0], [0.774_596_669_241_483_4, 5.0 / 18.0]];

/// With five, exact to degree 9; for powers that are no polynomials.
const FIVE: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.118_463_442_528_094_54],
    [-0.538_469_310_105_683_1, 0.239_314_335_249_683_24],
    [0.0, 0.284_444_444_444_444_44],
    [0.538_469_310_105_683_1, 0.239_314_335_249_683_24],
    [0.906_179_845_938_664, 0.118_463_442_528_094_54],
];

/// Puts a fraction within the interval in its place; any other, or NaN, is none.
fn cut<T: Real>(cuts: &mut Cuts<T>, fraction: T) {
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
fn for_each_piece<T: Real>(cuts: &Cuts<T>, mut piece: impl FnMut(T, T)) {
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
        let mut turns = [T::ONE; MOST_CUTS];
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
        let mut cuts = self.turns;
        let [before, after] = loads;
        for ((&first, &last), counted) in before.iter().zip(after).zip(rule.counted()) {
            if first * last < T::ZERO && counted {
                cut(&mut cuts, first / (first - last));
            }
        }
        let mut sum = T::ZERO;
        let mut first = rule.groups(before);
        for_each_piece(&cuts, |from, to| {
            let last = if to < T::ONE { rule.groups(&between(loads, to)) } else { rule.groups(after) };
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
        if rule.minor == T::ONE || before * after >= T::ZERO {
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
            return self.by_nodes(&THREE, [from, to], [first, last], |load| load * load * load);
        }
        let raise = first + last < rule.opening + rule.opening;
        self.by_nodes(&FIVE, [from, to], [first, last], |load| {
            exponent.power(if raise { rule.raised(load) } else { load })
        })
    }

    fn by_nodes<const N: usize>(
        &self,
        nodes: &[[f64; 2]; N],
        [from, to]: [T; 2],
        [first, last]: [T; 2],
        power: impl Fn(T) -> T,
    ) -> T {
        let [even, odd, bend] = self.on_piece(from, to);
        let half = T::from_f64(0.5);
        let (middle, half) = (half * (first + last), half * (last - first));
        let mut sum = T::ZERO;
        for &[node, weight] in nodes {
            let (node, weight) = (T::from_f64(node), T::from_f64(weight));
            sum += weight * power(middle + half * node) * (even + node * (odd + node * bend));
        }
        sum.abs() * (to - from)
    }
}

/// Components of the load at a fraction of the interval.
fn between<T: Real>([first, last]: [&[T; COMPONENTS]; 2], s: T) -> [T; COMPONENTS] {
    let mut out = *last;
    for (value, &first) in out.iter_mut().zip(first) {
        *value = (T::ONE - s) * first + s * *value;
    }
    out
}
