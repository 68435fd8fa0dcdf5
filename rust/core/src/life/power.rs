//! Integrals of `P^p v` for any exponent p, to rounding: over a piece on which the load is linear and the speed quadratic, in closed form; under
//! preloaded rows, by a Taylor series where the load changes little, else by nodes.

use guideload_life::{Number, Piece, Power, Real, Rule};

use crate::numeric::float::{floor, pow, sqrt};

/// Largest relative change of L from the middle of a piece to its end for the series; beyond, the closed form loses no digits.
const SERIES: f64 = 1.0 / 3.0;

/// Terms of the series below this fraction of the first are rounding.
const NEGLIGIBLE: f64 = 1e-18;

/// Nodes and weights of the Gauss-Legendre rules of three and of six points on -1 to 1, exact up to degrees 5 and 11.
const THREE_NODES: [[f64; 2]; 3] = [
    [-0.774_596_669_241_483_4, 0.555_555_555_555_555_6],
    [0.0, 0.888_888_888_888_888_8],
    [0.774_596_669_241_483_4, 0.555_555_555_555_555_6],
];
pub(super) const SIX_NODES: [[f64; 2]; 6] = [
    [-0.932_469_514_203_152, 0.171_324_492_379_170_35],
    [-0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
    [-0.238_619_186_083_196_9, 0.467_913_934_572_691_05],
    [0.238_619_186_083_196_9, 0.467_913_934_572_691_05],
    [0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
    [0.932_469_514_203_152, 0.171_324_492_379_170_35],
];

/// Largest ratio of the change of the load on a part to its distance from the opening with a truncation error of four terms below 1e-11.
pub(crate) const NEARLY_CONSTANT: f64 = 0.015;

/// At the opening the row load has no second derivative, so parts halve their distance from it, down to this share of the opening; below,
/// what is not smooth is less than rounding.
pub(crate) const LAST_GAP: f64 = 1e-4;

/// Largest exponent p of an equivalent load. Those of lives are below 10; with much larger ones only the largest load would count, and the
/// powers would leave the range of numbers.
pub(crate) const MAX_EXPONENT: f64 = 100.0;

/// Powers `P^p` by their exponent p, 1 to 100.
#[derive(Debug, Clone, Copy)]
pub struct LoadPower(f64);

impl Power<f64> for LoadPower {
    #[inline(always)]
    fn linear(&self, piece: &Piece<f64>, ends: [f64; 2]) -> f64 {
        if self.0 == 3.0 {
            return piece.cubic(ends);
        }
        let [load, end] = ends.map(|load| f64::max(load, 0.0));
        (piece.to - piece.from) * mean_of_product(load, end, piece.speed_powers(), self.0)
    }

    #[inline(never)]
    fn with_preload(&self, rule: &Rule<f64>, piece: &Piece<f64>, ends: [f64; 2]) -> f64 {
        match rule.preload_form {
            0 => {
                let relative = ends.map(|load| 1.0 + load / rule.opening);
                power(rule.preload, self.0) * Self(1.5 * self.0).linear(piece, relative)
            }
            1 => self.linear(piece, ends.map(|load| rule.with_preload(load))),
            _ => self.of_rows(rule, piece, ends),
        }
    }
}

impl LoadPower {
    /// The powers of an exponent; none if that is not 1 to 100.
    pub fn new(exponent: f64) -> Option<Self> {
        (1.0..=MAX_EXPONENT).contains(&exponent).then_some(Self(exponent))
    }

    /// The powers of an exponent that is checked.
    pub(crate) fn of_checked(exponent: f64) -> Self {
        Self(exponent)
    }

    /// The integral over a piece under two preloaded rows.
    fn of_rows(&self, rule: &Rule<f64>, piece: &Piece<f64>, ends: [f64; 2]) -> f64 {
        let [even, odd, bend] = piece.speed_powers();
        let mut sum = 0.0;
        for_each_part(ends.map(|load| load / rule.opening), |[from, to], [first, last]| {
            // Of the part, x from -1 to 1.
            let (middle, length) = (from + to - 1.0, to - from);
            let speed = [
                even + middle * (odd + middle * bend),
                (odd + 2.0 * middle * bend) * length,
                bend * length * length,
            ];
            let (load, change) = (0.5 * rule.opening * (first + last), 0.5 * rule.opening * (last - first));
            let gap = 1.0 - f64::max(first, last);
            let mean = if gap > LAST_GAP && f64::abs(last - first) < NEARLY_CONSTANT * gap {
                mean_by_series(self.0, rule.rows(load).series(load), change, speed, |row| power(row, self.0))
            } else {
                let of_node = |[x, weight]: [f64; 2]| {
                    let speed = speed[0] + x * (speed[1] + x * speed[2]);
                    0.5 * weight * speed * power(rule.with_preload(load + x * change), self.0)
                };
                SIX_NODES.map(of_node).iter().sum()
            };
            sum += f64::abs(length) * mean;
        });
        (piece.to - piece.from) * sum
    }
}

/// Mean of `R^p v` with R by its series in the change of the load, x times `change`, and `v = c0 + c1 x + c2 x²`, x from -1 to 1. `power`:
/// `R^p`.
#[inline(always)]
pub(crate) fn mean_by_series<N: Number>(
    p: f64,
    [row, r1, r2, r3, r4]: [N; 5],
    change: N,
    [c0, c1, c2]: [N; 3],
    power: impl Fn(N) -> N,
) -> N {
    let number = |value: f64| row.constant(value);
    let (one, p1, p2) = (number(1.0), number(p), number(0.5 * (p - 1.0)));
    let (p3, p4) = (number((p - 2.0) / 3.0), number(0.25 * (p - 3.0)));
    let mut sum = number(0.0);
    for [x, weight] in THREE_NODES {
        let (x, weight) = (number(x), number(0.5 * weight));
        let d = x * change;
        let r = d * (r1 + d * (r2 + d * (r3 + d * r4))) / row;
        // (1 + r)^p.
        let relative = one + p1 * r * (one + p2 * r * (one + p3 * r * (one + p4 * r)));
        sum = sum + weight * relative * (c0 + x * (c1 + x * c2));
    }
    power(row) * sum
}

/// Calls `part` for the parts of a piece on which the load, in units of the opening, is linear from one end to the other and below 1: with the
/// shares of the piece at their ends, and the loads there. No part is longer than its distance from the opening, so that integrals by
/// nodes converge.
pub(super) fn for_each_part([first, last]: [f64; 2], mut part: impl FnMut([f64; 2], [f64; 2])) {
    let ([mut at, end], [mut load, nearest]) =
        if first <= last { ([0.0, 1.0], [first, last]) } else { ([1.0, 0.0], [last, first]) };
    while 1.0 - load > LAST_GAP && nearest - load > 0.5 * (1.0 - load) {
        let next = 0.5 * (1.0 + load);
        let there = at + (next - load) / (nearest - load) * (end - at);
        part([at, there], [load, next]);
        (at, load) = (there, next);
    }
    part([at, end], [load, nearest]);
}

/// Mean of `L^p v`; L >= 0 from `first` to `last`, `v = c0 + c1 x + c2 x²` with x from -1 to 1.
fn mean_of_product(first: f64, last: f64, speed: [f64; 3], exponent: f64) -> f64 {
    let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
    if middle <= 0.0 {
        return 0.0;
    }
    let ratio = half / middle;
    if ratio.abs() > SERIES && exponent != floor(exponent) {
        return closed_form(first, last, speed, exponent);
    }
    // L^p = middle^p (1 + ratio x)^p, a binomial series; it ends by itself for a whole p.
    let [even, odd, bend] = speed;
    let (mut sum, mut coefficient, mut k) = (0.0, 1.0, 0);
    while f64::abs(coefficient) > NEGLIGIBLE {
        let moment = if k % 2 == 0 { even * over(k + 1) + bend * over(k + 3) } else { odd * over(k + 2) };
        sum += coefficient * moment;
        coefficient *= (exponent - k as f64) * over(k + 1) * ratio;
        k += 1;
    }
    power(middle, exponent) * sum
}

/// 1/k.
fn over(k: usize) -> f64 {
    const RECIPROCALS: [f64; 48] = {
        let mut table = [f64::INFINITY; 48];
        let mut k = 1;
        while k < 48 {
            table[k] = 1.0 / k as f64;
            k += 1;
        }
        table
    };
    RECIPROCALS.get(k).copied().unwrap_or(1.0 / k as f64)
}

/// `x^p`, by products and a root for the usual exponents: of balls, of rollers, and of balls under [`crate::Preload::Power`].
fn power(x: f64, exponent: f64) -> f64 {
    const ROLLERS: f64 = 10.0 / 3.0;
    match exponent {
        3.0 => x * x * x,
        ROLLERS => x * x * x * Real::cbrt(x),
        4.5 => x * x * x * x * sqrt(x),
        _ => pow(x, exponent),
    }
}

/// [`mean_of_product`] from the antiderivatives of `u^p`, `u^(p + 1)` and `u^(p + 2)`, with L = large u and u from small/large to 1.
fn closed_form(first: f64, last: f64, [even, odd, bend]: [f64; 3], exponent: f64) -> f64 {
    // From the small end to the large one, s from 0 to 1, x = 2 s - 1.
    let (small, large, odd) = if first <= last { (first, last, odd) } else { (last, first, -odd) };
    let start = small / large;
    let width = 1.0 - start;
    let mut power = pow(start, exponent);
    let raised = [1.0, 2.0, 3.0].map(|k| {
        power *= start;
        (1.0 - power) / (exponent + k)
    });
    let of_s = (raised[1] - start * raised[0]) / width;
    let of_square = (raised[2] - start * (2.0 * raised[1] - start * raised[0])) / (width * width);
    let sum = (even - odd + bend) * raised[0] + 2.0 * (odd - 2.0 * bend) * of_s + 4.0 * bend * of_square;
    pow(large, exponent) * sum / width
}
