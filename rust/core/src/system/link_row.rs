//! Link rows: deflection and load of each link in the undamped modes.

use super::state::State;
use super::state_box::StateBox;
use super::statics::NEGLIGIBLE;
use crate::model::{Link, ball_force};
use crate::numeric::float::{add_scaled, dot, fma};

/// A link in the undamped modes, per unit of each entry of the state (√J), and at rest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinkRow {
    pub link: Link,
    /// Stiffness k in the modes, N/m: the slope of the law at rest.
    pub stiffness: f64,
    /// Load per unit of `ω η`: `k d·Φ / ω`, N.
    pub elastic: [f64; 6],
    /// Load per unit of `η'`: `b d·Φ`, N.
    pub damping: [f64; 6],
    /// Deflection rate per unit of `η'`, which is also the modal force per unit of load: `d·Φ`.
    pub rate: [f64; 6],
    /// Deflection per unit of `ω η`: `d·Φ / ω`, m.
    pub deflection: [f64; 6],
    /// Deflection at rest, m; before the equilibrium is known, the offset of [`LinkRow::set_offsets`].
    pub rest: f64,
    /// Elastic load at rest, N.
    pub load: f64,
}

impl LinkRow {
    /// A row of zeros, with the nominal stiffness of the link.
    pub(crate) fn new(link: &Link) -> Self {
        Self {
            link: *link,
            stiffness: link.law().nominal(),
            elastic: [0.0; 6],
            damping: [0.0; 6],
            rate: [0.0; 6],
            deflection: [0.0; 6],
            rest: 0.0,
            load: 0.0,
        }
    }

    /// Where linear links with these offsets rest without weight, in energy coordinates. `rest` of each row receives the offset from
    /// there, with which the equilibrium is found.
    pub(crate) fn set_offsets(rows: &mut [Self]) -> [f64; 6] {
        let mut unloaded = [0.0; 6];
        for row in rows.iter() {
            add_scaled(&mut unloaded, &row.elastic, row.link.offset());
        }
        for row in rows {
            row.rest = row.link.offset() - dot(&row.deflection, &unloaded);
        }
        unloaded
    }

    /// Slope of the law at rest, N/m, and whether it is the stiffness in the modes: without stiffness at rest that is the nominal one.
    pub(crate) fn slope_at_rest(&self) -> (f64, bool) {
        let law = self.link.law();
        let slope = law.tangent(self.rest);
        (slope, slope > NEGLIGIBLE * law.nominal())
    }

    /// On a segment of a piecewise linear law: its stiffness, by how much the elastic load at the static position exceeds the load at rest,
    /// and whether the damper acts.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn on_segment(&self, segment: usize) -> (f64, f64, bool) {
        let (load_at_zero, stiffness) = self.link.law().segment(segment);
        // Exactly zero on the segment of rest, so that a body at rest stays at rest to the last bit.
        let excess = if segment == self.link.law().segment_of(self.rest) {
            0.0
        } else {
            fma(stiffness, self.rest, load_at_zero) - self.load
        };
        // In its clearance a link has no stiffness.
        (stiffness, excess, stiffness > 0.0 || !self.link.is_damped_in_contact())
    }

    /// Becomes the row of a link that stays on a segment of its law, of which [`LinkRow::on_segment`] gives the numbers.
    pub(crate) fn stay_on(&mut self, segment: usize, (stiffness, excess, damped): (f64, f64, bool)) {
        self.link = self.link.on_segment(segment, damped);
        self.stiffness = stiffness;
        self.elastic = self.deflection.map(|deflection| stiffness * deflection);
        self.load += excess;
        if !damped {
            self.damping = [0.0; 6];
        }
    }

    /// Deflection at a state, m.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn deflection_at(&self, state: &State) -> f64 {
        let mut at = self.rest;
        for j in 0..6 {
            at = fma(self.deflection[j], state[j], at);
        }
        at
    }

    /// Segment of the law at a state.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn segment_at(&self, state: &State) -> usize {
        self.link.law().segment_of(self.deflection_at(state))
    }

    /// Deflections at some states, to the last bit those of [`LinkRow::deflection_at`]; `entries`: each at all states.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn deflections<const COUNT: usize>(&self, entries: &[[f64; COUNT]; 12]) -> [f64; COUNT] {
        let mut at = [self.rest; COUNT];
        for j in 0..6 {
            add_scaled(&mut at, &entries[j], self.deflection[j]);
        }
        at
    }

    /// Elastic load at a state beyond that of a spring with the stiffness at rest, N, and its slope over the deflection, N/m.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn beyond_spring(&self, state: &State) -> (f64, f64) {
        let (at, law) = (self.deflection_at(state), self.link.law());
        let spring = fma(self.stiffness, at - self.rest, self.load);
        (law.force(at) - spring, law.tangent(at) - self.stiffness)
    }

    /// Bound on how much the elastic load in a box is off the tangent at the state `at`, N; infinite if a row opens or closes.
    ///
    /// Between the edges of a law its slope falls with |δ|, and ever faster; beyond them it only rises. So the tangent is farthest off at an
    /// end of a range that is as wide on both sides.
    #[inline(always)]
    pub(crate) fn tangent_error(&self, at: &State, states: &StateBox) -> f64 {
        let (at, law) = (self.deflection_at(at), self.link.law());
        let (mut middle, mut reach) = (self.rest, 0.0);
        for j in 0..6 {
            middle = fma(self.deflection[j], states.middle[j], middle);
            reach = fma(self.deflection[j].abs(), states.radius[j], reach);
        }
        reach += (middle - at).abs();
        if law.segment_of(at - reach) != law.segment_of(at + reach) {
            return f64::INFINITY;
        }
        let (load, slope) = (law.force(at), law.tangent(at));
        let off = |way: f64| (law.force(at + way) - fma(slope, way, load)).abs();
        let (below, above) = (off(-reach), off(reach));
        if below <= above { above } else { below }
    }

    /// Load of the damper at a state, N, whether it acts there or not.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn damping_load(&self, state: &State) -> f64 {
        let mut load = 0.0;
        for j in 0..6 {
            load = fma(self.damping[j], state[6 + j], load);
        }
        load
    }

    /// Whether the damper is without effect: it acts only in contact, and the link has no contact at this state.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn damper_is_idle(&self, state: &State) -> bool {
        self.link.is_damped_in_contact() && self.link.law().tangent(self.deflection_at(state)) == 0.0
    }

    /// Elastic and damping load at a state, N: to the last bit the values of the vector loops over many states, in which preloaded balls
    /// have an expression of their own.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn loads(&self, state: &State) -> (f64, f64) {
        let damping = if self.damper_is_idle(state) { 0.0 } else { self.damping_load(state) };
        let at = self.deflection_at(state);
        let elastic = match self.link.law().balls() {
            Some([opening, coefficient]) => coefficient * ball_force(opening, at),
            None => self.link.law().force(at),
        };
        (elastic, damping)
    }

    /// Rates of change of elastic and damping load at a state, N/s, from that of the state.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn load_rates(&self, state: &State, rate: &State) -> (f64, f64) {
        let damping = if self.damper_is_idle(state) { 0.0 } else { self.damping_load(rate) };
        let slope = self.link.law().tangent(self.deflection_at(state));
        (slope * (self.deflection_at(rate) - self.rest), damping)
    }
}
