//! Eight links side by side: deflections, rates, and their distance from the edges of their segments.

use crate::numeric::float::{add_scaled, fma};
use crate::numeric::simd::{LANES, Lanes};
use crate::system::{State, StateBox};

/// Eight links on their present segments.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkBlock {
    pub deflection: [Lanes; 6],
    pub rate: [Lanes; 6],
    /// Norm of the deflection row: largest deflection for a state of norm one.
    pub norm: Lanes,
    pub tolerance: Lanes,
    /// Edges of the present segments, less the deflection at rest.
    pub low: Lanes,
    pub high: Lanes,
}

pub(super) const NO_LINKS: LinkBlock = LinkBlock {
    deflection: [[0.0; LANES]; 6],
    rate: [[0.0; LANES]; 6],
    norm: [0.0; LANES],
    tolerance: [0.0; LANES],
    low: [f64::NEG_INFINITY; LANES],
    high: [f64::INFINITY; LANES],
};

impl LinkBlock {
    /// Deflections from rest, m.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn deflections(&self, state: &State) -> Lanes {
        let mut at = [0.0; LANES];
        for j in 0..6 {
            add_scaled(&mut at, &self.deflection[j], state[j]);
        }
        at
    }

    /// Rates of deflection, m/s.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn rates(&self, state: &State) -> Lanes {
        let mut moving = [0.0; LANES];
        for j in 0..6 {
            add_scaled(&mut moving, &self.rate[j], state[6 + j]);
        }
        moving
    }

    /// Whether no link passes an edge between two states, if the distance of the path from the straight line through them is at most
    /// `margin` per unit of the norm of its deflection row.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn ends_clear(&self, state: &State, next: &State, margin: f64) -> bool {
        let (at, end) = (self.deflections(state), self.deflections(next));
        let mut worst = [0.0; LANES];
        for i in 0..LANES {
            let (up, down) = (larger(at[i], end[i]) - self.high[i], self.low[i] - smaller(at[i], end[i]));
            worst[i] = fma(margin, self.norm[i], larger(up, down)) - self.tolerance[i];
        }
        none_above_zero(&worst)
    }

    /// Whether no link passes an edge in the states of a box, or up to `margin` per unit of the norm of its deflection row beside it.
    #[inline(always)]
    pub(super) fn box_clear(&self, states: &StateBox, margin: f64) -> bool {
        let at = self.deflections(&states.middle);
        let mut around = [0.0; LANES];
        for j in 0..6 {
            for i in 0..LANES {
                around[i] = fma(self.deflection[j][i].abs(), states.radius[j], around[i]);
            }
        }
        let mut worst = [0.0; LANES];
        for i in 0..LANES {
            let beyond = larger(at[i] - self.high[i], self.low[i] - at[i]) + around[i];
            worst[i] = fma(margin, self.norm[i], beyond) - self.tolerance[i];
        }
        none_above_zero(&worst)
    }

    /// Smallest distance of a link from its nearest edge, over the norm of its deflection row.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn slack(&self, state: &State) -> f64 {
        let at = self.deflections(state);
        let mut slack = at;
        for i in 0..LANES {
            let left = smaller(self.high[i] - at[i], at[i] - self.low[i]);
            slack[i] = (left + self.tolerance[i]) / self.norm[i];
        }
        // A link that nothing moves divides zero by zero.
        let mut least = [f64::INFINITY; LANES / 2];
        for half in slack.as_chunks::<{ LANES / 2 }>().0 {
            for i in 0..LANES / 2 {
                least[i] = smaller(half[i], least[i]);
            }
        }
        smaller(smaller(least[0], least[1]), smaller(least[2], least[3]))
    }

    /// Whether the cubics through both ends of a step, with an error of at most `margin` per unit of the norm of its deflection row, show that no link passes an
    /// edge: they stay within it, or they only move away from it, as those of a link that has just passed it.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn cubics_clear(&self, h: f64, state: &State, next: &State, margin: f64) -> bool {
        let (at, end_at) = (self.deflections(state), self.deflections(next));
        let (moving, end_moving) = (self.rates(state), self.rates(next));
        let (third, per_third) = (h / 3.0, 3.0 / h);
        // The error of the slope of a cubic is at most h³ / 124 times the fourth derivative, that of the cubic h⁴ / 384 times.
        let slope_margin = 4.0 * margin / h;
        let mut worst = [0.0; LANES];
        for i in 0..LANES {
            let (after, before) = (fma(third, moving[i], at[i]), fma(-third, end_moving[i], end_at[i]));
            let top = larger(larger(after, before), larger(at[i], end_at[i])) - self.high[i];
            let bottom = self.low[i] - smaller(smaller(after, before), smaller(at[i], end_at[i]));
            let beyond = fma(margin, self.norm[i], -self.tolerance[i]);
            // Control points of the slope.
            let middle = (before - after) * per_third;
            let steepest = larger(larger(moving[i], end_moving[i]), middle);
            let flattest = smaller(smaller(moving[i], end_moving[i]), middle);
            let slope_error = slope_margin * self.norm[i];
            worst[i] = larger(
                smaller(top + beyond, steepest + slope_error),
                smaller(bottom + beyond, slope_error - flattest),
            );
        }
        none_above_zero(&worst)
    }

    /// Whether the cubics through both ends of a step stay within the edges even if they were three times as wide. A path that leaves
    /// its cubic by as much as that is wide turns several times in the step, which no error control accepts.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn cubics_far_from_edges(&self, h: f64, state: &State, next: &State) -> bool {
        let (at, end_at) = (self.deflections(state), self.deflections(next));
        let (moving, end_moving) = (self.rates(state), self.rates(next));
        let third = h / 3.0;
        let mut worst = [0.0; LANES];
        for i in 0..LANES {
            let (after, before) = (fma(third, moving[i], at[i]), fma(-third, end_moving[i], end_at[i]));
            let top = larger(larger(after, before), larger(at[i], end_at[i]));
            let bottom = smaller(smaller(after, before), smaller(at[i], end_at[i]));
            worst[i] = larger(top - self.high[i], self.low[i] - bottom) + (top - bottom) - self.tolerance[i];
        }
        none_above_zero(&worst)
    }
}

/// Whether all are zero or less; NaN is not.
#[cfg_attr(feature = "std", inline(always))]
fn none_above_zero(lanes: &Lanes) -> bool {
    let mut none = true;
    for lane in lanes {
        none &= *lane <= 0.0;
    }
    none
}

/// The larger of two numbers; one instruction, unlike `f64::max`.
#[cfg_attr(feature = "std", inline(always))]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers; the second if one of them is NaN.
#[cfg_attr(feature = "std", inline(always))]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cubics that start past their lower edge by rounding are exact on themselves, so the test needs no margin.
    #[test]
    fn a_cubic_that_passes_an_edge_is_never_clear() {
        let (h, tolerance) = (0.5, 1e-9);
        let mut block = NO_LINKS;
        (block.deflection[0][3], block.rate[0][3], block.norm[3], block.tolerance[3]) =
            (1.0, 1.0, 1.0, tolerance);
        let [mut clear, mut away] = [0; 2];
        for i in 0..7 * 41 * 41 {
            let (start, middle) = ([-1e-9, 1e-9, 0.2][i % 3], 0.3 * f64::from((i % 7) as u32));
            let [first, last] = [i / 7 % 41, i / 287].map(|k| 0.1 * (k as f64 - 15.0));
            let end = start + h / 3.0 * (first + middle + last);
            let mut states = [[0.0; 12]; 2];
            for (state, [at, moving]) in states.iter_mut().zip([[start, first], [end, last]]) {
                (state[0], state[6]) = (at, moving);
            }
            let lowest = (0..=1000).fold(f64::INFINITY, |lowest, k| {
                let (t, u) = (f64::from(k) / 1000.0, 1.0 - f64::from(k) / 1000.0);
                let [b, c] = [start + h / 3.0 * first, end - h / 3.0 * last];
                let at = u * u * u * start + 3.0 * u * t * (u * b + t * c) + t * t * t * end;
                if at < lowest { at } else { lowest }
            });
            for up in [false, true] {
                // The same below an upper edge.
                let sign = if up { -1.0 } else { 1.0 };
                let [state, next] = states.map(|state| state.map(|entry| sign * entry));
                (block.low[3], block.high[3]) = if up { (-9.0, 0.0) } else { (0.0, 9.0) };
                if block.cubics_clear(h, &state, &next, 0.0) {
                    assert!(lowest >= -2.0 * tolerance, "{start} {first} {middle} {last}: {lowest}");
                    clear += 1;
                    away += usize::from(start < 0.1 && lowest >= start);
                }
            }
        }
        assert!(clear > 5000 && away > 2000, "{clear} {away}");
    }
}
