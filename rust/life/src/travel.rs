//! Integrals over the interval between two samples: of `|v|`, and of `P^p |v|`, for loads that are linear and a speed that is quadratic.

use crate::real::Real;
use crate::rule::{COMPONENTS, Exponent, Rule, Weighed};

/// The travel between two instants: the acceleration is linear in time, so the velocity is quadratic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval<T = f64> {
    /// s.
    pub length: T,
    /// Velocity at both ends, m/s.
    pub velocity: [T; 2],
    /// Acceleration at both ends, m/s².
    pub acceleration: [T; 2],
}

impl<T: Real> Interval<T> {
    /// `∫ |v| dt`, m.
    pub fn path(&self) -> T {
        Travel::new(self).path
    }

    /// `∫ v dt`, m.
    #[inline(always)]
    pub fn displacement(&self) -> T {
        self.length * self.whole().displacement()
    }

    /// The interval as a piece.
    #[inline(always)]
    fn whole(&self) -> Piece<T> {
        let ([start, end], half) = (self.velocity, T::from_f64(0.5));
        Piece::new(T::ZERO, T::ONE, [start, start + half * (end - start - self.bend()), end])
    }

    /// Coefficient of x² of the velocity, x from 0 to 1, m/s.
    #[inline(always)]
    fn bend(&self) -> T {
        T::from_f64(0.5) * self.length * (self.acceleration[1] - self.acceleration[0])
    }
}

/// Integrals over the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals<T = f64> {
    /// `∫ P^p |v| dt`, N^p m.
    pub power: T,
    /// `∫ |v| dt`, m.
    pub path: T,
}

/// Powers `P^p` of loads, integrated over a piece of an interval on which P without preload is linear and the velocity does not turn.
pub trait Power<T: Real> {
    /// `∫ P^p v` over the piece, over the length of the interval, from the loads at both ends.
    fn linear(&self, piece: &Piece<T>, ends: [T; 2]) -> T;
    /// The same where the preload of a rule raises P.
    fn with_preload(&self, rule: &Rule<T>, piece: &Piece<T>, ends: [T; 2]) -> T;
}

impl<T: Real> Power<T> for Exponent {
    #[inline(always)]
    fn linear(&self, piece: &Piece<T>, ends: [T; 2]) -> T {
        if *self == Self::Ball { piece.cubic(ends) } else { piece.by_nodes(ends, |load| self.power(load)) }
    }

    #[inline(never)]
    fn with_preload(&self, rule: &Rule<T>, piece: &Piece<T>, ends: [T; 2]) -> T {
        piece.by_nodes(ends, |load| self.power(rule.with_preload(load)))
    }
}

/// Nodes from 0 to 1 and weights of Gauss's rule that is exact to degree 9: for powers that are no polynomials.
const NODES: [[f64; 2]; 5] = [
    [0.046_910_077_030_668_004, 0.118_463_442_528_094_54],
    [0.230_765_344_947_158_45, 0.239_314_335_249_683_24],
    [0.5, 0.284_444_444_444_444_44],
    [0.769_234_655_052_841_5, 0.239_314_335_249_683_24],
    [0.953_089_922_969_332, 0.118_463_442_528_094_54],
];

/// A piece of an interval.
#[derive(Debug, Clone, Copy)]
pub struct Piece<T> {
    /// Fractions of the interval.
    pub from: T,
    /// Where it ends.
    pub to: T,
    /// Velocity: coefficients of `(1 - x)²`, `2 x (1 - x)` and `x²`, x from 0 to 1 (Bernstein's form, which is cut without loss of digits).
    pub speed: [T; 3],
    /// `∫ P³ v` over the piece, P linear from a to b: weights of a³, a² b, a b² and b³.
    weights: [T; 4],
}

impl<T: Real> Piece<T> {
    #[inline(always)]
    fn new(from: T, to: T, speed: [T; 3]) -> Self {
        let [first, middle, last] = speed;
        let number = |value: f64| T::from_f64(value);
        let (unit, double) = ((to - from) * number(1.0 / 60.0), middle + middle);
        let weights = [
            number(10.0) * first + double + double + last,
            number(3.0) * (first + first + double + last),
            number(3.0) * (first + double + last + last),
            first + double + double + number(10.0) * last,
        ];
        Self { from, to, speed, weights: weights.map(|weight| unit * weight) }
    }

    /// Both parts of the piece, cut at a share of it (de Casteljau).
    #[inline(always)]
    fn cut(&self, share: T) -> [Self; 2] {
        let [first, middle, last] = self.speed;
        let (before, after) = (first + share * (middle - first), middle + share * (last - middle));
        let (at, there) = (self.from + share * (self.to - self.from), before + share * (after - before));
        [Self::new(self.from, at, [first, before, there]), Self::new(at, self.to, [there, after, last])]
    }

    /// Velocity: coefficients of 1, x and x², x from -1 to 1.
    pub fn speed_powers(&self) -> [T; 3] {
        let ([first, middle, last], number) = (self.speed, T::from_f64);
        let (quarter, double) = (number(0.25), middle + middle);
        [quarter * (first + double + last), number(0.5) * (last - first), quarter * (first - double + last)]
    }

    /// `∫ v`, over the length of the interval.
    #[inline(always)]
    fn displacement(&self) -> T {
        let [first, middle, last] = self.speed;
        (self.to - self.from) * T::from_f64(1.0 / 3.0) * (first + middle + last)
    }

    /// The share of the piece at which it reaches a fraction of the interval.
    fn share(&self, fraction: T) -> T {
        (fraction - self.from) / (self.to - self.from)
    }

    /// `∫ P³ v`, P linear.
    #[inline(always)]
    pub fn cubic(&self, [a, b]: [T; 2]) -> T {
        let [of_a, of_ab, of_ba, of_b] = self.weights;
        a * a * (of_a * a + of_ab * b) + b * b * (of_ba * a + of_b * b)
    }

    /// Integral of `power(P) v`, P linear.
    fn by_nodes(&self, [first, last]: [T; 2], power: impl Fn(T) -> T) -> T {
        let mut sum = T::ZERO;
        for [x, weight] in NODES {
            let factors = [(1.0 - x) * (1.0 - x), 2.0 * x * (1.0 - x), x * x]
                .map(|factor| T::from_f64(weight * factor));
            let speed = factors[0] * self.speed[0] + factors[1] * self.speed[1] + factors[2] * self.speed[2];
            sum += speed * power(first + T::from_f64(x) * (last - first));
        }
        (self.to - self.from) * sum
    }
}

/// An interval with the turns of the velocity.
#[derive(Debug, Clone, Copy)]
pub struct Travel<T> {
    length: T,
    /// The interval as a piece.
    pub whole: Piece<T>,
    /// Ascending fractions at which the velocity turns, 1 in free places.
    pub turns: [T; 2],
    /// `∫ |v| dt`, m.
    pub path: T,
}

impl<T: Real> Travel<T> {
    /// The travel over an interval.
    #[inline(always)]
    pub fn new(interval: &Interval<T>) -> Self {
        let (whole, bend) = (interval.whole(), interval.bend());
        let [start, middle, end] = whole.speed;
        let mut travel = Self { length: interval.length, whole, turns: [T::ONE; 2], path: T::ZERO };
        // The velocity stays between its three coefficients.
        if !(start * end > T::ZERO && start * middle > T::ZERO) {
            travel.find_turns(start, end - start - bend, bend);
        }
        travel.path =
            interval.length * travel.by_turns(&whole, [T::ZERO; 2], |piece, _| piece.displacement());
        travel
    }

    /// Fractions s at which the velocity `start + s (linear + s bend)` is zero.
    #[inline(never)]
    fn find_turns(&mut self, start: T, linear: T, bend: T) {
        let discriminant = linear * linear - T::from_f64(4.0) * bend * start;
        if discriminant >= T::ZERO {
            let root = discriminant.sqrt();
            let root = if linear < T::ZERO { -root } else { root };
            let large = T::from_f64(-0.5) * (linear + root);
            let [first, second] = [large / bend, start / large].map(|turn| {
                // Outside of the interval, or NaN: none.
                if turn > T::ZERO && turn < T::ONE { turn } else { T::ONE }
            });
            self.turns = if first < second { [first, second] } else { [second, first] };
        }
    }

    /// `∫ P^p |v| dt` of one carriage, N^p m, from its loads at both ends and what the rule makes of them.
    #[inline(always)]
    pub fn power(
        &self,
        rule: &Rule<T>,
        power: &impl Power<T>,
        loads: [&[T; COMPONENTS]; 2],
        [before, after]: [&Weighed<T>; 2],
    ) -> T {
        let changed = (before.signs ^ after.signs) & rule.counted;
        let groups = [before.groups, after.groups];
        let sum = if changed == 0 {
            self.groups_linear(rule, power, &self.whole, groups)
        } else {
            self.across_zeros(rule, power, loads, groups, changed)
        };
        sum * self.length
    }

    /// Over the interval, cut where a component that counts changes its sign: bit 0 of `changed` for Fy.
    #[inline(never)]
    fn across_zeros(
        &self,
        rule: &Rule<T>,
        power: &impl Power<T>,
        loads: [&[T; COMPONENTS]; 2],
        [start, end]: [[T; 2]; 2],
        changed: u32,
    ) -> T {
        // A magnitude falls to zero and rises as steeply. In front of all zeros, the groups have these slopes.
        let (mut zeros, mut slope) = ([T::ONE; COMPONENTS], [end[0] - start[0], end[1] - start[1]]);
        for component in bits(changed) {
            let ([fall, rise], [first, second]) = ends_and_weights(rule, loads, component);
            slope = [slope[0] - first * rise, slope[1] - second * rise];
            if let Some(zero) = zeros.get_mut(component) {
                *zero = fall / (fall + rise);
            }
        }
        let (mut sum, mut rest, mut groups, mut left) = (T::ZERO, self.whole, start, changed);
        for _ in 0..COMPONENTS {
            let (mut to, mut nearest) = (T::ONE, None);
            for component in bits(left) {
                match zeros.get(component) {
                    Some(&zero) if zero < to => (to, nearest) = (zero, Some(component)),
                    _ => (),
                }
            }
            let Some(component) = nearest else { break };
            let length = to - rest.from;
            let there = [groups[0] + slope[0] * length, groups[1] + slope[1] * length];
            let [piece, after] = rest.cut(rest.share(to));
            sum += self.groups_linear(rule, power, &piece, [groups, there]);
            let ([fall, rise], [first, second]) = ends_and_weights(rule, loads, component);
            slope = [slope[0] + first * (fall + rise), slope[1] + second * (fall + rise)];
            (rest, groups, left) = (after, there, left & !(1 << component));
        }
        sum + self.groups_linear(rule, power, &rest, [groups, end])
    }

    /// Over a piece on which both groups are linear.
    #[inline(always)]
    fn groups_linear(
        &self,
        rule: &Rule<T>,
        power: &impl Power<T>,
        piece: &Piece<T>,
        [first, last]: [[T; 2]; 2],
    ) -> T {
        if rule.plain != 0 || (first[0] - first[1]) * (last[0] - last[1]) >= T::ZERO {
            self.load_linear(rule, power, piece, [rule.combined(first), rule.combined(last)])
        } else {
            self.across_equal_groups(rule, power, piece, [first, last])
        }
    }

    /// Over a piece on which the larger group becomes the smaller: cut where they are equal.
    #[inline(never)]
    fn across_equal_groups(
        &self,
        rule: &Rule<T>,
        power: &impl Power<T>,
        piece: &Piece<T>,
        [first, last]: [[T; 2]; 2],
    ) -> T {
        let (before, after) = (first[0] - first[1], last[0] - last[1]);
        let share = before / (before - after);
        let even = first[0] + share * (last[0] - first[0]);
        let ([left, right], middle) = (piece.cut(share), rule.combined([even, even]));
        self.load_linear(rule, power, &left, [rule.combined(first), middle])
            + self.load_linear(rule, power, &right, [middle, rule.combined(last)])
    }

    /// Over a piece on which P without preload is linear.
    #[inline(always)]
    fn load_linear(
        &self,
        rule: &Rule<T>,
        power: &impl Power<T>,
        piece: &Piece<T>,
        [first, last]: [T; 2],
    ) -> T {
        if (first - rule.opening) * (last - rule.opening) >= T::ZERO {
            self.one_branch(rule, power, piece, [first, last])
        } else {
            self.across_opening(rule, power, piece, [first, last])
        }
    }

    /// Over a piece on which the preload begins or ceases to act: cut there.
    #[inline(never)]
    fn across_opening(
        &self,
        rule: &Rule<T>,
        power: &impl Power<T>,
        piece: &Piece<T>,
        [first, last]: [T; 2],
    ) -> T {
        let [left, right] = piece.cut((first - rule.opening) / (first - last));
        self.one_branch(rule, power, &left, [first, rule.opening])
            + self.one_branch(rule, power, &right, [rule.opening, last])
    }

    /// Over a piece on which the preload acts everywhere or nowhere.
    #[inline(always)]
    fn one_branch(&self, rule: &Rule<T>, power: &impl Power<T>, piece: &Piece<T>, ends: [T; 2]) -> T {
        let raise = ends[0] + ends[1] < rule.opening + rule.opening;
        self.by_turns(piece, ends, |piece, ends| {
            if raise { power.with_preload(rule, piece, ends) } else { power.linear(piece, ends) }
        })
    }

    /// Over a piece on which the load is linear: the sum of the magnitudes of `integral` over the parts between the turns of the velocity.
    #[inline(always)]
    pub fn by_turns(&self, piece: &Piece<T>, ends: [T; 2], integral: impl Fn(&Piece<T>, [T; 2]) -> T) -> T {
        let [first, second] = self.turns;
        if first < T::ONE
            && ((first > piece.from && first < piece.to) || (second > piece.from && second < piece.to))
        {
            self.across_turns(piece, ends, integral)
        } else {
            integral(piece, ends).abs()
        }
    }

    /// The same for a piece in which the velocity turns.
    #[inline(never)]
    fn across_turns(
        &self,
        piece: &Piece<T>,
        [first, last]: [T; 2],
        integral: impl Fn(&Piece<T>, [T; 2]) -> T,
    ) -> T {
        let (mut sum, mut rest, mut start) = (T::ZERO, *piece, first);
        for &turn in &self.turns {
            if turn > rest.from && turn < rest.to {
                let share = rest.share(turn);
                let ([part, after], there) = (rest.cut(share), start + share * (last - start));
                sum += integral(&part, [start, there]).abs();
                (rest, start) = (after, there);
            }
        }
        sum + integral(&rest, [start, last]).abs()
    }
}

/// Numbers of the bits that are set, of the lowest [`COMPONENTS`].
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    (0..COMPONENTS).map_while(move |_| {
        let bit = mask.trailing_zeros() as usize;
        let is_set = mask != 0;
        mask &= mask.wrapping_sub(1);
        is_set.then_some(bit)
    })
}

/// Magnitudes of a component at both ends of an interval, and double its weights in the groups A and B.
fn ends_and_weights<T: Real>(
    rule: &Rule<T>,
    loads: [&[T; COMPONENTS]; 2],
    component: usize,
) -> ([T; 2], [T; 2]) {
    let at = |of: &[T; COMPONENTS]| of.get(component).copied().unwrap_or(T::ZERO);
    (
        loads.map(|load| at(load).abs()),
        rule.weights.each_ref().map(|[magnitudes, _]| at(magnitudes) + at(magnitudes)),
    )
}
