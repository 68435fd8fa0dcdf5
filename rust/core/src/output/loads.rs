//! Load recovery, paper section 3.6: loads of links and groups, and the motion of L, from states.
//!
//! A load is the force of the body on its guide, `k δ + b δ'` along the link; the load by the weight points down.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::axes::Axes;
use crate::model::{Dof, Free};
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::{add_columns, add_scaled, fma, scale};
use crate::numeric::simd::dispatch;
use crate::system::{Input, LinkRow, ModelLevel, NO_FORCE, State, System};

/// Part of a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Elastic and damping.
    Total,
    /// `k δ`, with the static load.
    Elastic,
    /// `b δ'`.
    Damping,
}

/// A quantity as a function of state and excitation: a linear part, and the links whose elastic loads are nonlinear.
#[derive(Debug, Clone)]
pub struct Recovery<'a, const ROWS: usize> {
    pub(crate) linear: Linear<ROWS>,
    pub(crate) nonlinear: BoundedVec<NonlinearLink<'a, ROWS>>,
}

/// `constant + by_state s + by_input u`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Linear<const ROWS: usize> {
    pub constant: [f64; ROWS],
    pub by_state: [[f64; ROWS]; 12],
    pub by_input: [[f64; ROWS]; 9],
    /// Whether the quantity depends on the excitation directly; loads of links do not.
    pub by_input_at_all: bool,
}

impl<const ROWS: usize> Linear<ROWS> {
    pub(crate) const NOTHING: Self = Self {
        constant: [0.0; ROWS],
        by_state: [[0.0; ROWS]; 12],
        by_input: [[0.0; ROWS]; 9],
        by_input_at_all: false,
    };

    /// The part that does not depend on the excitation directly.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn of_state(&self, state: &State) -> [f64; ROWS] {
        let mut out = self.constant;
        add_columns(&mut out, &self.by_state, state);
        out
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn at(&self, state: &State, input: &Input) -> [f64; ROWS] {
        let mut out = self.of_state(state);
        if self.by_input_at_all {
            add_columns(&mut out, &self.by_input, input);
        }
        out
    }

    /// Adds the elastic load `load + elastic s` of a link times `direction`.
    pub(crate) fn add_elastic(&mut self, (load, elastic): (f64, &[f64; 6]), direction: &[f64; ROWS]) {
        add_scaled(&mut self.constant, direction, load);
        for (column, load) in self.by_state[..6].iter_mut().zip(elastic) {
            add_scaled(column, direction, *load);
        }
    }

    /// Adds the load of a damper times `direction`.
    pub(crate) fn add_damping(&mut self, damping: &[f64; 6], direction: &[f64; ROWS]) {
        for (column, load) in self.by_state[6..].iter_mut().zip(damping) {
            add_scaled(column, direction, *load);
        }
    }
}

impl Linear<6> {
    /// Adds a matrix times a quantity.
    pub(crate) fn add_product(&mut self, matrix: &Matrix6<f64>, of: &Self) {
        let add = |to: &mut [f64; 6], from: &[f64; 6]| add_scaled(to, &product(matrix, from), 1.0);
        add(&mut self.constant, &of.constant);
        self.by_state.iter_mut().zip(&of.by_state).for_each(|(to, from)| add(to, from));
        self.by_input.iter_mut().zip(&of.by_input).for_each(|(to, from)| add(to, from));
        self.by_input_at_all |= of.by_input_at_all;
    }

    /// Sets the rows of the free degrees of freedom to zero.
    pub(crate) fn clear_free(&mut self, free: Free) {
        clear_free(&mut self.constant, free);
        self.by_state.iter_mut().chain(&mut self.by_input).for_each(|column| clear_free(column, free));
    }
}

fn product(matrix: &Matrix6<f64>, column: &[f64; 6]) -> [f64; 6] {
    (matrix * Vector6::from(*column)).into()
}

fn clear_free(column: &mut [f64; 6], free: Free) {
    Dof::ALL.into_iter().filter(|&dof| free.contains(dof)).for_each(|dof| column[dof as usize] = 0.0);
}

/// A nonlinear link, and its contribution to the quantity per unit of its loads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NonlinearLink<'a, const ROWS: usize> {
    pub row: &'a LinkRow,
    pub elastic: [f64; ROWS],
    /// Contribution per unit of the load of its damper, if the damper acts only in contact.
    pub damping: [f64; ROWS],
}

/// The load of one link, N.
pub type Axial<'a> = Recovery<'a, 1>;

/// A force (x y z, N) and a moment (N m), or six quantities of L, one per degree of freedom.
pub type Wrench<'a> = Recovery<'a, 6>;

impl<'a, const ROWS: usize> Recovery<'a, ROWS> {
    /// The quantity that is always zero.
    fn nothing(system: &'a System) -> Self {
        let none = NonlinearLink { row: &system.rows()[0], elastic: [0.0; ROWS], damping: [0.0; ROWS] };
        Self { linear: Linear::NOTHING, nonlinear: BoundedVec::filled(none, 0) }
    }

    /// The quantity less a constant one, as the load less that at rest.
    #[must_use]
    pub fn less(mut self, constant: &[f64; ROWS]) -> Self {
        add_scaled(&mut self.linear.constant, constant, -1.0);
        self
    }

    /// Linear combinations of the entries: one row of factors for each.
    #[cfg(feature = "studies")]
    pub(crate) fn combined(&self, rows: &[[f64; ROWS]; ROWS]) -> Self {
        let by_row = |column: &[f64; ROWS]| {
            core::array::from_fn(|row| {
                rows[row].iter().zip(column).map(|(factor, entry)| factor * entry).sum()
            })
        };
        let mut out = self.clone();
        out.linear.constant = by_row(&self.linear.constant);
        for column in out.linear.by_state.iter_mut().chain(&mut out.linear.by_input) {
            *column = by_row(column);
        }
        for link in out.nonlinear.as_mut_slice() {
            (link.elastic, link.damping) = (by_row(&link.elastic), by_row(&link.damping));
        }
        out
    }

    /// With factors on the direct effect of accelerations and of external loads.
    #[cfg(feature = "studies")]
    pub(crate) fn scaled(mut self, factors: [f64; 2]) -> Self {
        for (component, column) in self.linear.by_input.iter_mut().enumerate() {
            scale(column, factors[usize::from(component >= 3)]);
        }
        self
    }

    /// Value at rest.
    pub fn at_rest(&self) -> [f64; ROWS] {
        self.at(&[0.0; 12], &[0.0; 9])
    }

    /// Value at one instant.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn at(&self, state: &State, input: &Input) -> [f64; ROWS] {
        let mut out = self.linear.at(state, input);
        for link in self.nonlinear.as_slice() {
            let (elastic, damping) = link.row.loads(state);
            add_scaled(&mut out, &link.elastic, elastic);
            add_scaled(&mut out, &link.damping, damping);
        }
        out
    }

    /// The quantity while each link stays on the straight segment of its law that it is on in a state; preloaded links have none.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn on_segments(&self, state: &State) -> Self {
        let Some(first) = self.nonlinear.as_slice().first() else { return self.clone() };
        let mut out = Self { linear: self.linear, nonlinear: BoundedVec::filled(*first, 0) };
        for link in self.nonlinear.as_slice() {
            let NonlinearLink { row, elastic, damping } = link;
            let law = row.link.law();
            if !law.is_piecewise_linear() {
                out.nonlinear.push(*link);
                continue;
            }
            let (load_at_zero, stiffness) = law.segment(row.segment_at(state));
            add_scaled(&mut out.linear.constant, elastic, fma(stiffness, row.rest, load_at_zero));
            for j in 0..6 {
                add_scaled(&mut out.linear.by_state[j], elastic, stiffness * row.deflection[j]);
            }
            // In its clearance a link has no stiffness, and its damper does not act.
            for j in 0..if stiffness > 0.0 { 6 } else { 0 } {
                add_scaled(&mut out.linear.by_state[6 + j], damping, row.damping[j]);
            }
        }
        out
    }

    /// Rate of change at one instant, from those of state and excitation.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn rate(&self, state: &State, rate: &State, input: &Input) -> [f64; ROWS] {
        let mut out = self.linear.at(rate, input);
        for (entry, constant) in out.iter_mut().zip(self.linear.constant) {
            *entry -= constant;
        }
        for link in self.nonlinear.as_slice() {
            let (elastic, damping) = link.row.load_rates(state, rate);
            add_scaled(&mut out, &link.elastic, elastic);
            add_scaled(&mut out, &link.damping, damping);
        }
        out
    }

    /// Adds the load of a link times `direction`.
    fn add_link(&mut self, row: &'a LinkRow, part: Part, direction: &[f64; ROWS]) {
        let none = [0.0; ROWS];
        let (elastic, damping) = (part != Part::Damping, part != Part::Elastic);
        let is_nonlinear = !row.link.law().is_linear();
        let idle = row.link.is_damped_in_contact();
        if elastic && !is_nonlinear {
            self.linear.add_elastic((row.load, &row.elastic), direction);
        }
        if damping && !idle {
            self.linear.add_damping(&row.damping, direction);
        }
        let elastic = if elastic && is_nonlinear { *direction } else { none };
        let damping = if damping && idle { *direction } else { none };
        if elastic != none || damping != none {
            self.add_nonlinear(NonlinearLink { row, elastic, damping });
        }
    }

    /// Adds a nonlinear link, once per link.
    fn add_nonlinear(&mut self, link: NonlinearLink<'a, ROWS>) {
        match self.nonlinear.as_mut_slice().iter_mut().find(|known| core::ptr::eq(known.row, link.row)) {
            Some(known) => {
                add_scaled(&mut known.elastic, &link.elastic, 1.0);
                add_scaled(&mut known.damping, &link.damping, 1.0);
            }
            None => self.nonlinear.push(link),
        }
    }
}

/// The load of one link, by its index in the scene, along its direction, N.
///
/// # Panics
/// If there is no such link.
pub fn link_load(system: &System, link: usize, part: Part) -> Axial<'_> {
    let mut load = Axial::nothing(system);
    load.add_link(&system.rows()[link], part, &[1.0]);
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
) -> Wrench<'_> {
    group_load_along(system, links, center, Axes::MACHINE, part)
}

/// The load of a group of links as [`group_load`], along and about other axes than those of the machine.
///
/// # Panics
/// If there is no such link.
pub fn group_load_along(
    system: &System,
    links: impl IntoIterator<Item = usize>,
    center: Vector3<f64>,
    axes: Axes,
    part: Part,
) -> Wrench<'_> {
    let mut load = Wrench::nothing(system);
    for index in links {
        let row = &system.rows()[index];
        let direction = row.link.direction();
        let o = axes.components(direction);
        let m = axes.components((row.link.point() - center).cross(&direction));
        load.add_link(row, part, &[o.x, o.y, o.z, m.x, m.y, m.z]);
    }
    load
}

/// Position `(u, φ)` of L in the travelling frame, static sag included: m, rad.
pub fn position(system: &System) -> Wrench<'_> {
    let mut out = velocity(system);
    out.linear.constant = system.static_position().into();
    for mode in 0..system.mode_count() {
        out.linear.by_state[mode] = out.linear.by_state[6 + mode].map(|x| x / system.frequency[mode]);
        out.linear.by_state[6 + mode] = [0.0; 6];
    }
    out
}

/// Velocity `(u', φ')` of L in the travelling frame: m/s, rad/s.
pub fn velocity(system: &System) -> Wrench<'_> {
    let mut out = Wrench::nothing(system);
    for mode in 0..system.mode_count() {
        out.linear.by_state[6 + mode] = system.shapes().column(mode).into_owned().into();
    }
    out
}

/// Largest change of each component of the velocity of L from one state to the next: m/s, rad/s.
pub fn largest_velocity_change(system: &System, states: &[State]) -> [f64; 6] {
    let velocity = velocity(system);
    dispatch!(largest_change(&velocity.linear.by_state[6..], states))
}

#[cfg_attr(feature = "std", inline(always))]
fn largest_change(by_rate: &[[f64; 6]], states: &[State]) -> [f64; 6] {
    let mut largest = [0.0; 6];
    for pair in states.windows(2) {
        let (before, after) = (&pair[0], &pair[1]);
        let (mut rates, mut change) = ([0.0; 6], [0.0; 6]);
        for mode in 0..6 {
            rates[mode] = after[6 + mode] - before[6 + mode];
        }
        add_columns(&mut change, by_rate, &rates);
        for i in 0..6 {
            largest[i] = f64::max(largest[i], change[i].abs());
        }
    }
    largest
}

/// Acceleration `(u'', φ'')` of L in the travelling frame: m/s², rad/s².
pub fn acceleration(system: &System) -> Wrench<'_> {
    let shapes = system.shapes();
    let spread = |modal: &[f64]| -> [f64; 6] { (shapes * Vector6::from_column_slice(modal)).into() };
    let mut out = Wrench::nothing(system);
    out.linear.by_input_at_all = true;
    let is_nonlinear = system.model_level() != ModelLevel::Linear;
    for (index, column) in out.linear.by_state.iter_mut().enumerate() {
        let mut state: State = [0.0; 12];
        state[index] = 1.0;
        if !is_nonlinear {
            *column = spread(&system.linear_rate(&state, &NO_FORCE)[6..]);
        }
    }
    if is_nonlinear {
        // Link by link: the loads less those at rest, which balance the weight.
        for row in system.rows() {
            let direction = spread(&row.rate.map(|rate| -rate));
            add_scaled(&mut out.linear.constant, &direction, -row.load);
            out.add_link(row, Part::Total, &direction);
        }
    }
    for (column, force) in out.linear.by_input.iter_mut().zip(system.influence()) {
        *column = spread(&force[..6]);
    }
    out
}

/// Reactions of the held degrees of freedom, N and N m; that of held x is the drive force (eqs. 34-36 solved for F). Zero for free degrees of
/// freedom.
///
/// `reaction = M q'' + M_u a - Q - E + C q' + K q` in the held rows; the last two terms are the loads of all links about L.
pub fn reaction<'a>(system: &'a System) -> Wrench<'a> {
    let matrices = system.matrices();
    let mut out = Wrench::nothing(system);
    let mut add = |matrix: &Matrix6<f64>, term: &Wrench<'a>| {
        out.linear.add_product(matrix, &term.linear);
        for link in term.nonlinear.as_slice() {
            let [elastic, damping] = [&link.elastic, &link.damping].map(|column| {
                let mut rows = product(matrix, column);
                clear_free(&mut rows, system.free());
                rows
            });
            out.add_nonlinear(NonlinearLink { row: link.row, elastic, damping });
        }
    };
    add(&matrices.mass, &acceleration(system));
    add(&Matrix6::identity(), &group_load(system, 0..system.rows().len(), Vector3::zeros(), Part::Total));
    let mut outside = Wrench::nothing(system);
    outside.linear.constant = (-matrices.weight).into();
    for axis in 0..3 {
        outside.linear.by_input[axis] = matrices.mass.column(axis).into_owned().into();
    }
    for axis in 0..6 {
        outside.linear.by_input[3 + axis][axis] = -1.0;
    }
    add(&Matrix6::identity(), &outside);
    out.linear.clear_free(system.free());
    out
}
