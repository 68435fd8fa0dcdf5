//! Evaluation of quantities at all instants of a run, several at a time in vector loops.

use super::loads::{Linear, NonlinearLink, Recovery};
use crate::model::{ball_force, sided_force};
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{LANES, dispatch, dispatch_wide};
use crate::system::{Input, State};

/// Nonlinear links side by side: an AVX2 register, and those of a carriage.
const LINKS: usize = 4;

/// Instants in a block: the forces of the links are computed at all of them before the loads are summed.
const BLOCK: usize = 32;

/// Evaluates quantities at all instants: `out[(k * quantities + q) * ROWS + row]`. `input` gives the excitation of instant k. Returns whether
/// all values are finite.
///
/// # Panics
/// If the length of `out` is not `states * quantities * ROWS`.
pub fn evaluate<const ROWS: usize>(
    quantities: &[Recovery<ROWS>],
    states: &[State],
    input: impl Fn(usize) -> Input,
    out: &mut [f64],
) -> bool {
    let (width, mut finite) = (quantities.len() * ROWS, true);
    assert_eq!(out.len(), states.len() * width, "room for every quantity at every state");
    if quantities.iter().all(|quantity| quantity.nonlinear.as_slice().is_empty()) {
        for from in (0..width).step_by(LANES) {
            let mut lanes = Linear::<LANES>::NOTHING;
            for (lane, row) in (from..usize::min(from + LANES, width)).enumerate() {
                lanes.copy_row(lane, &quantities[row / ROWS].linear, row % ROWS);
            }
            finite &= dispatch_wide!(write_linear(&lanes, states, &input, out, from, width));
        }
        return finite;
    }
    for (index, quantity) in quantities.iter().enumerate() {
        let from = index * ROWS;
        if let Some(group) = LinkGroup::<SidedLanes>::of(quantity) {
            finite &= dispatch!(write_group(&group, states, out, from, width, ROWS));
        } else if let Some(group) = LinkGroup::<BallLanes>::of(quantity) {
            finite &= dispatch!(write_group(&group, states, out, from, width, ROWS));
        } else {
            finite &= dispatch!(write_any(quantity, states, &input, out, from, width));
        }
    }
    finite
}

/// Sum of all values times zero: zero while they are finite, NaN after the first that is not. It takes one vector instruction per instant.
struct FiniteCheck([f64; LANES]);

impl FiniteCheck {
    #[cfg_attr(feature = "std", inline(always))]
    fn add(&mut self, values: &[f64; LANES]) {
        add_scaled(&mut self.0, values, 0.0);
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn all_finite(&self) -> bool {
        self.0 == [0.0; LANES]
    }
}

impl Linear<LANES> {
    fn copy_row<const ROWS: usize>(&mut self, lane: usize, from: &Linear<ROWS>, row: usize) {
        self.constant[lane] = from.constant[row];
        for (to, from) in self.by_state.iter_mut().zip(&from.by_state) {
            to[lane] = from[row];
        }
        for (to, from) in self.by_input.iter_mut().zip(&from.by_input) {
            to[lane] = from[row];
        }
        self.by_input_at_all |= from.by_input_at_all;
    }
}

/// Writes eight rows of linear quantities to `out[k * width + from..]`, fewer at the end of a row.
#[cfg_attr(feature = "std", inline(always))]
fn write_linear<I: Fn(usize) -> Input>(
    lanes: &Linear<LANES>,
    states: &[State],
    input: &I,
    out: &mut [f64],
    from: usize,
    width: usize,
) -> bool {
    let (count, mut check) = (usize::min(LANES, width - from), FiniteCheck([0.0; LANES]));
    if lanes.by_input_at_all || count < LANES {
        for (k, (state, out)) in states.iter().zip(out.chunks_exact_mut(width)).enumerate() {
            let values = lanes.at(state, &input(k));
            check.add(&values);
            for (out, value) in out[from..].iter_mut().zip(&values) {
                *out = *value;
            }
        }
    } else {
        // Two instants at a time share each column while it is in a register.
        let (pairs, last) = states.as_chunks::<2>();
        let mut rows = out.chunks_exact_mut(width);
        for [a, b] in pairs {
            let (Some(row_a), Some(row_b)) = (rows.next(), rows.next()) else { break };
            let (mut sum_a, mut sum_b) = (lanes.constant, lanes.constant);
            for j in 0..12 {
                add_scaled(&mut sum_a, &lanes.by_state[j], a[j]);
                add_scaled(&mut sum_b, &lanes.by_state[j], b[j]);
            }
            check.add(&sum_a);
            check.add(&sum_b);
            row_a[from..from + LANES].copy_from_slice(&sum_a);
            row_b[from..from + LANES].copy_from_slice(&sum_b);
        }
        for (state, row) in last.iter().zip(rows) {
            let values = lanes.of_state(state);
            check.add(&values);
            row[from..from + LANES].copy_from_slice(&values);
        }
    }
    check.all_finite()
}

/// Writes the rows of a quantity to `out[k * width + from..]`, one instant at a time.
#[cfg_attr(feature = "std", inline(always))]
fn write_any<I: Fn(usize) -> Input, const ROWS: usize>(
    quantity: &Recovery<ROWS>,
    states: &[State],
    input: &I,
    out: &mut [f64],
    from: usize,
    width: usize,
) -> bool {
    let mut finite = true;
    for (k, (state, out)) in states.iter().zip(out.chunks_exact_mut(width)).enumerate() {
        let all = quantity.at(state, &input(k));
        out[from..from + ROWS].copy_from_slice(&all);
        finite &= all.iter().all(|value| value.is_finite());
    }
    finite
}

/// Elastic laws of one kind, one link per lane.
trait LaneLaws: Sized {
    /// Links without stiffness.
    const NONE: Self;

    /// Puts a link into a lane; false if its law is of another kind.
    fn set<const ROWS: usize>(&mut self, lane: usize, link: &NonlinearLink<ROWS>) -> bool;

    /// Forces at four deflections.
    fn force(&self, at: [f64; LINKS]) -> [f64; LINKS];
}

/// Stiffness to both sides, and clearance.
struct SidedLanes([[f64; LINKS]; 3]);

impl LaneLaws for SidedLanes {
    const NONE: Self = Self([[0.0; LINKS]; 3]);

    fn set<const ROWS: usize>(&mut self, lane: usize, link: &NonlinearLink<ROWS>) -> bool {
        let Some(constants) = link.row.link.law().sides() else { return false };
        for (to, constant) in self.0.iter_mut().zip(constants) {
            to[lane] = constant;
        }
        true
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn force(&self, mut at: [f64; LINKS]) -> [f64; LINKS] {
        let [positive, negative, clearance] = &self.0;
        for i in 0..LINKS {
            at[i] = sided_force([positive[i], negative[i], clearance[i]], at[i]);
        }
        at
    }
}

/// d₀ and K of preloaded balls.
struct BallLanes([[f64; LINKS]; 2]);

impl LaneLaws for BallLanes {
    const NONE: Self = Self([[1.0; LINKS], [0.0; LINKS]]);

    fn set<const ROWS: usize>(&mut self, lane: usize, link: &NonlinearLink<ROWS>) -> bool {
        let Some(constants) = link.row.link.law().balls() else { return false };
        for (to, constant) in self.0.iter_mut().zip(constants) {
            to[lane] = constant;
        }
        true
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn force(&self, mut at: [f64; LINKS]) -> [f64; LINKS] {
        let [opening, coefficient] = &self.0;
        for i in 0..LINKS {
            at[i] = coefficient[i] * ball_force(opening[i], at[i]);
        }
        at
    }
}

/// A quantity with up to four nonlinear links, such as the load of a carriage.
struct LinkGroup<L> {
    linear: Linear<LANES>,
    deflection: [[f64; LINKS]; 6],
    rest: [f64; LINKS],
    laws: L,
    /// Per unit of the elastic load of each link.
    elastic: [[f64; LANES]; LINKS],
}

impl<L: LaneLaws> LinkGroup<L> {
    /// The group of a quantity, if its nonlinear links are at most four, of one kind, and always damped.
    fn of<const ROWS: usize>(quantity: &Recovery<ROWS>) -> Option<Self> {
        let nonlinear = quantity.nonlinear.as_slice();
        let fits =
            (1..=LINKS).contains(&nonlinear.len()) && ROWS <= LANES && !quantity.linear.by_input_at_all;
        if !fits || nonlinear.iter().any(|link| link.row.link.is_damped_in_contact()) {
            return None;
        }
        let mut group = Self {
            linear: Linear::NOTHING,
            deflection: [[0.0; LINKS]; 6],
            rest: [0.0; LINKS],
            laws: L::NONE,
            elastic: [[0.0; LANES]; LINKS],
        };
        for row in 0..ROWS {
            group.linear.copy_row(row, &quantity.linear, row);
        }
        for (lane, link) in nonlinear.iter().enumerate() {
            for j in 0..6 {
                group.deflection[j][lane] = link.row.deflection[j];
            }
            group.rest[lane] = link.row.rest;
            group.elastic[lane][..ROWS].copy_from_slice(&link.elastic);
            if !group.laws.set(lane, link) {
                return None;
            }
        }
        Some(group)
    }

    /// Forces of the links at an instant.
    #[cfg_attr(feature = "std", inline(always))]
    fn forces(&self, state: &State) -> [f64; LINKS] {
        let mut at = self.rest;
        for j in 0..6 {
            add_scaled(&mut at, &self.deflection[j], state[j]);
        }
        self.laws.force(at)
    }

    /// Values at N instants, which share each column while it is in a register. `first`: the first entry of the state with a share in the
    /// linear part.
    #[cfg_attr(feature = "std", inline(always))]
    fn at<const N: usize>(
        &self,
        states: &[State; N],
        forces: &[[f64; LINKS]; N],
        first: usize,
    ) -> [[f64; LANES]; N] {
        let mut sums = [self.linear.constant; N];
        for j in first..12 {
            for n in 0..N {
                add_scaled(&mut sums[n], &self.linear.by_state[j], states[n][j]);
            }
        }
        for i in 0..LINKS {
            for n in 0..N {
                add_scaled(&mut sums[n], &self.elastic[i], forces[n][i]);
            }
        }
        sums
    }
}

/// Writes the rows of a group to `out[k * width + from..]`.
#[cfg_attr(feature = "std", inline(always))]
fn write_group<L: LaneLaws>(
    group: &LinkGroup<L>,
    states: &[State],
    out: &mut [f64],
    from: usize,
    width: usize,
    rows: usize,
) -> bool {
    let first = if group.linear.by_state[..6].as_flattened() == [0.0; 6 * LANES] { 6 } else { 0 };
    let (mut places, mut check) = (out.chunks_exact_mut(width), FiniteCheck([0.0; LANES]));
    for states in states.chunks(BLOCK) {
        // All forces of a block first: stored to memory, the four of an instant are computed as one vector.
        let mut forces = [[0.0; LINKS]; BLOCK];
        for (forces, state) in forces.iter_mut().zip(states) {
            *forces = group.forces(state);
        }
        let (pairs, last) = states.as_chunks::<2>();
        for (pair, forces) in pairs.iter().zip(forces.as_chunks::<2>().0) {
            let sums = if first == 6 { group.at(pair, forces, 6) } else { group.at(pair, forces, 0) };
            for sum in &sums {
                let Some(place) = places.next() else { break };
                check.add(sum);
                if let Some(place) = place.get_mut(from..from + LANES) {
                    // The lanes past the rows are overwritten by the next quantity.
                    place.copy_from_slice(sum);
                } else {
                    place[from..from + rows].copy_from_slice(&sum[..rows]);
                }
            }
        }
        if let [state] = last
            && let Some(place) = places.next()
        {
            let sums = group.at(&[*state], &[forces[states.len() - 1]], 0)[0];
            check.add(&sums);
            place[from..from + rows].copy_from_slice(&sums[..rows]);
        }
    }
    check.all_finite()
}
