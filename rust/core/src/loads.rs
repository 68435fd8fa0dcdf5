//! Load recovery, paper section 3.6: from states to what the guides carry.
//!
//! A load is the force that the body exerts on its guide, `k δ + b δ'` along the link: gravity makes it point down.

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::dof::Dof;
use crate::float::add_scaled;
use crate::rows::Row;
use crate::simd::{Kernel, widest};
use crate::system::{Input, NO_FORCE, State, System};

/// Which part of a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Elastic and damping.
    Total,
    /// `k δ`, with the static load.
    Elastic,
    /// `b δ'`.
    Damping,
}

/// Rows that turn a state and an excitation into quantities: `constant + by_state s + by_input u`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recovery<const ROWS: usize> {
    constant: [f64; ROWS],
    by_state: [[f64; ROWS]; 12],
    by_input: [[f64; ROWS]; 9],
    /// Whether the excitation reaches the quantity other than through the state; loads of links it does not.
    by_input_at_all: bool,
}

/// The load of one link, N.
pub type Axial = Recovery<1>;

/// A force (x y z, N) and a moment (N m), or six quantities of L, one per degree of freedom.
pub type Wrench = Recovery<6>;

impl<const ROWS: usize> Recovery<ROWS> {
    const NOTHING: Self = Self {
        constant: [0.0; ROWS],
        by_state: [[0.0; ROWS]; 12],
        by_input: [[0.0; ROWS]; 9],
        by_input_at_all: false,
    };

    /// At rest, before anything moves.
    pub fn at_rest(&self) -> [f64; ROWS] {
        self.constant
    }

    /// At one instant.
    #[inline(always)]
    pub fn at(&self, state: &State, input: &Input) -> [f64; ROWS] {
        let mut out = self.of_state(state);
        if self.by_input_at_all {
            for (column, &factor) in self.by_input.iter().zip(input) {
                add_scaled(&mut out, column, factor);
            }
        }
        out
    }

    /// The part that does not come from the excitation directly.
    #[inline(always)]
    fn of_state(&self, state: &State) -> [f64; ROWS] {
        let mut out = self.constant;
        for (column, &factor) in self.by_state.iter().zip(state) {
            add_scaled(&mut out, column, factor);
        }
        out
    }

    /// Adds the load of a link, as a multiple of `direction`.
    fn add_link(&mut self, system: &System, row: &Row, part: Part, direction: &[f64; ROWS]) {
        if part != Part::Damping {
            let rest: f64 = row.elastic.iter().zip(system.rest()).map(|(r, s)| r * s).sum();
            add_scaled(&mut self.constant, direction, rest);
            for (column, load) in self.by_state[..6].iter_mut().zip(row.elastic) {
                add_scaled(column, direction, load);
            }
        }
        if part != Part::Elastic {
            for (column, load) in self.by_state[6..].iter_mut().zip(row.damping) {
                add_scaled(column, direction, load);
            }
        }
    }
}

/// The load of one link, by its index in the scene, along its direction, N.
///
/// # Panics
/// If there is no such link.
pub fn link_load(system: &System, link: usize, part: Part) -> Axial {
    let mut load = Axial::NOTHING;
    load.add_link(system, &system.rows()[link], part, &[1.0]);
    load
}

/// The load of a group of links (a carriage, a rail), by their indices in the scene, as a force and a moment about `center` (m from L).
///
/// # Panics
/// If there is no such link.
pub fn group_load(
    system: &System,
    links: impl IntoIterator<Item = usize>,
    center: Vector3<f64>,
    part: Part,
) -> Wrench {
    let mut load = Wrench::NOTHING;
    for index in links {
        let row = &system.rows()[index];
        let o = row.link.direction();
        let m = (row.link.point() - center).cross(&o);
        load.add_link(system, row, part, &[o.x, o.y, o.z, m.x, m.y, m.z]);
    }
    load
}

/// Position `(u, φ)` of L in the carriage frame, static sag included: m, rad.
pub fn position(system: &System) -> Wrench {
    let mut out = velocity(system);
    out.constant = system.static_position().into();
    for mode in 0..system.mode_count() {
        out.by_state[mode] = out.by_state[6 + mode].map(|x| x / system.frequency[mode]);
        out.by_state[6 + mode] = [0.0; 6];
    }
    out
}

/// Velocity `(u', φ')` of L in the carriage frame: m/s, rad/s.
pub fn velocity(system: &System) -> Wrench {
    let mut out = Wrench::NOTHING;
    for mode in 0..system.mode_count() {
        out.by_state[6 + mode] = system.shapes().column(mode).into_owned().into();
    }
    out
}

/// Acceleration `(u'', φ'')` of L in the carriage frame: m/s², rad/s².
pub fn acceleration(system: &System) -> Wrench {
    let shapes = system.shapes();
    let spread = |modal: &[f64]| -> [f64; 6] { (shapes * Vector6::from_column_slice(modal)).into() };
    let mut out = Wrench { by_input_at_all: true, ..Wrench::NOTHING };
    for (index, column) in out.by_state.iter_mut().enumerate() {
        let mut state: State = [0.0; 12];
        state[index] = 1.0;
        *column = spread(&system.rate(&state, &NO_FORCE)[6..]);
    }
    for (column, force) in out.by_input.iter_mut().zip(system.influence()) {
        *column = spread(&force[..6]);
    }
    out
}

/// Reaction of the held degrees of freedom, that of a held x being the drive force: N, N m (eqs. 34-36 solved for F); zero for the
/// free ones.
///
/// `reaction = M q'' + M_u a - Q - E + C q' + K q` in the held rows; the last two are the loads of all links about L.
pub fn reaction(system: &System) -> Wrench {
    let matrices = system.matrices();
    let mut out = Wrench { by_input_at_all: true, ..Wrench::NOTHING };
    let mut add = |matrix: &Matrix6<f64>, term: &Wrench| {
        let product = |column: &[f64; 6]| matrix * Vector6::from(*column);
        for dof in Dof::ALL.into_iter().filter(|&dof| !system.free().contains(dof)) {
            let row = dof as usize;
            out.constant[row] += product(&term.constant)[row];
            for (to, from) in out.by_state.iter_mut().zip(&term.by_state) {
                to[row] += product(from)[row];
            }
            for (to, from) in out.by_input.iter_mut().zip(&term.by_input) {
                to[row] += product(from)[row];
            }
        }
    };
    add(&matrices.mass, &acceleration(system));
    add(&Matrix6::identity(), &group_load(system, 0..system.rows().len(), Vector3::zeros(), Part::Total));
    let mut outside = Wrench::NOTHING;
    outside.constant = (-matrices.weight).into();
    for axis in 0..3 {
        outside.by_input[axis] = matrices.mass.column(axis).into_owned().into();
    }
    for axis in 0..6 {
        outside.by_input[3 + axis][axis] = -1.0;
    }
    add(&Matrix6::identity(), &outside);
    out
}

/// Rows that [`fill`] works on at a time: two AVX2 registers.
const LANES: usize = 8;

/// Writes quantities at all instants: `out[(k * quantities + q) * ROWS + row]`. `input` gives the excitation of instant k.
///
/// # Panics
/// If `out` is not of the length `states * quantities * ROWS`.
pub fn fill<const ROWS: usize>(
    quantities: &[Recovery<ROWS>],
    states: &[State],
    input: impl Fn(usize) -> Input,
    out: &mut [f64],
) {
    let width = quantities.len() * ROWS;
    assert_eq!(out.len(), states.len() * width, "room for every quantity at every state");
    for from in (0..width).step_by(LANES) {
        let mut lanes = Recovery::<LANES>::NOTHING;
        for (lane, row) in (from..usize::min(from + LANES, width)).enumerate() {
            lanes.copy_row(lane, &quantities[row / ROWS], row % ROWS);
        }
        widest(Fill { lanes: &lanes, states, input: &input, out, from, width });
    }
}

impl Recovery<LANES> {
    fn copy_row<const ROWS: usize>(&mut self, lane: usize, from: &Recovery<ROWS>, row: usize) {
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

/// Writes the lanes to `out[k * width + from..]`, as many as there is room for in a row.
struct Fill<'a, I> {
    lanes: &'a Recovery<LANES>,
    states: &'a [State],
    input: &'a I,
    out: &'a mut [f64],
    from: usize,
    width: usize,
}

impl<I: Fn(usize) -> Input> Kernel for Fill<'_, I> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { lanes, states, input, out, from, width } = self;
        let count = usize::min(LANES, width - from);
        if lanes.by_input_at_all || count < LANES {
            for (k, (state, out)) in states.iter().zip(out.chunks_exact_mut(width)).enumerate() {
                let values = lanes.at(state, &input(k));
                for (out, value) in out[from..].iter_mut().zip(&values) {
                    *out = *value;
                }
            }
        } else {
            // Two instants at a time share each column while it is in a register.
            let (pairs, last) = states.as_chunks::<2>();
            let mut rows = out.chunks_exact_mut(width);
            for [a, b] in pairs {
                let (Some(row_a), Some(row_b)) = (rows.next(), rows.next()) else { return };
                let (mut sum_a, mut sum_b) = (lanes.constant, lanes.constant);
                for j in 0..12 {
                    add_scaled(&mut sum_a, &lanes.by_state[j], a[j]);
                    add_scaled(&mut sum_b, &lanes.by_state[j], b[j]);
                }
                row_a[from..from + LANES].copy_from_slice(&sum_a);
                row_b[from..from + LANES].copy_from_slice(&sum_b);
            }
            for (state, row) in last.iter().zip(rows) {
                row[from..from + LANES].copy_from_slice(&lanes.of_state(state));
            }
        }
    }
}
