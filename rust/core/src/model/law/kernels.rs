//! Forces of the two common nonlinear laws for vector loops: without branches, with the constants as arguments.

use crate::numeric::float::sqrt;

/// Force of a sided law at the deflection `d`, N: `k₊ (d - c)₊ - k₋ (-d - c)₊`.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn sided_force([positive, negative, clearance]: [f64; 3], d: f64) -> f64 {
    // The deflections are limited at the edges: of comparisons with zero the compiler makes masks, which take longer.
    let (up, down) = (if d > clearance { d } else { clearance }, if d < -clearance { d } else { -clearance });
    positive * (up - clearance) + negative * (down + clearance)
}

/// Compression of both rows of preloaded balls at the deflection `d`: `(d₀ + d)₊` and `(d₀ - d)₊`, m.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn ball_compressions(opening: f64, d: f64) -> [f64; 2] {
    // Limited at the edges, as above.
    let (up, down) = (if d > -opening { d } else { -opening }, if d < opening { d } else { opening });
    [opening + up, opening - down]
}

/// Force of preloaded balls over K at the deflection `d`: `(d₀ + d)₊^(3/2) - (d₀ - d)₊^(3/2)`. Near d = 0
/// digits cancel; [`super::Law::force`] avoids this, but needs branches and divisions.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn ball_force(opening: f64, d: f64) -> f64 {
    let [a, b] = ball_compressions(opening, d);
    a * sqrt(a) - b * sqrt(b)
}
