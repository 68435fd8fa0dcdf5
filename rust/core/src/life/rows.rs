//! The loads of two rows of balls or rollers that are preloaded against each other, and integrals of their powers.
//!
//! Loads are in units of the preload, deflections e in units of that at which a row opens: under a load `r = (1 + e)^n - (1 - e)^n` the
//! loaded row carries `(1 + e)^n`.

use crate::numeric::float::{pow, sqrt};

/// Exponent of balls, for which a root replaces the power.
const BALL: f64 = 1.5;

/// Newton's steps for e: two leave 7e-11 of the row load, three leave rounding.
const STEPS: usize = 3;

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
/// Largest change of the load on a piece over its distance from the opening for which three nodes leave less than 1e-11.
const NEARLY_CONSTANT: f64 = 0.015;
/// At the opening the row load has no second derivative, so pieces halve their distance from it, down to this share of the opening; below,
/// what is not smooth is less than rounding.
const LAST_GAP: f64 = 1e-4;

/// The load at which the other row opens, `2^n`.
pub(super) fn opening(exponent: f64) -> f64 {
    if exponent == BALL { core::f64::consts::SQRT_2 * 2.0 } else { pow(2.0, exponent) }
}

/// `(1 + e)^n`, the load of the loaded row, and its derivative by the load, under a load from 0 to the opening.
pub(super) fn loaded_row(load: f64, exponent: f64) -> [f64; 2] {
    let power = |x: f64| if exponent == BALL { sqrt(x) } else { pow(x, exponent - 1.0) };
    // The load over e falls from 2 n to 2^n: e is between both lines, and the load is concave in it, so the steps converge from anywhere.
    let (share, slope) = (load / opening(exponent), opening(exponent) / (2.0 * exponent));
    let mut e = share * (slope + (1.0 - slope) * share * share);
    let (mut above, mut below) = (1.0, 1.0);
    for _ in 0..STEPS {
        (above, below) = (power(1.0 + e), power(1.0 - e));
        let step = ((1.0 + e) * above - (1.0 - e) * below - load) / (exponent * (above + below));
        e = (e - step).clamp(0.0, 1.0);
    }
    [(1.0 + e) * power(1.0 + e), above / (above + below)]
}

/// Nodes and weights for a piece on which the load in units of the opening changes from one number to another.
pub(super) fn nodes([first, last]: [f64; 2]) -> &'static [[f64; 2]] {
    let gap = 1.0 - f64::max(first, last);
    if f64::abs(last - first) < NEARLY_CONSTANT * gap { &THREE_NODES } else { &SIX_NODES }
}

/// Calls `part` for the parts of a piece, each with its ends and the loads there in units of the opening: below it, the load is linear on
/// the piece. No part is longer than its distance from the opening, so that integrals by nodes converge.
pub(super) fn for_each_part(
    [from, to]: [f64; 2],
    [first, last]: [f64; 2],
    mut part: impl FnMut([f64; 2], [f64; 2]),
) {
    let ([mut at, end], [mut load, nearest]) =
        if first <= last { ([from, to], [first, last]) } else { ([to, from], [last, first]) };
    while 1.0 - load > LAST_GAP && nearest - load > 0.5 * (1.0 - load) {
        let next = 0.5 * (1.0 + load);
        let there = at + (next - load) / (nearest - load) * (end - at);
        part([at, there], [load, next]);
        (at, load) = (there, next);
    }
    part([at, end], [load, nearest]);
}
