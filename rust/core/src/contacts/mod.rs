//! Contact changes: which segment of its law each link is on, and when it leaves it.
//!
//! Between two contact changes the equations are linear, and a deflection is known at any time. From where each link is, how it moves and a
//! bound on the second derivative follows a time in which none can reach an edge; until then no step is asked. A step that may contain a
//! change is asked for the cubic through its ends, whose control points bound it, and the fourth derivative what it is wrong by. Only what
//! that does not clear is looked into, on the power series of the exact solution itself, so that no change is missed.

mod block;
mod path;
mod search;

use block::{Block, EMPTY, LANES, smaller};

use crate::equations::Equations;
use crate::float::{add_scaled, fma, sqrt};
use crate::integrate::{Ramp, Values};
use crate::many::{Many, ROOM};
use crate::piece::Piece;
use crate::propagator::{Series, growth_rate};
use crate::rows::Row;
use crate::simd::{Kernel, widest};
use crate::system::{Force, NO_FORCE, State, System, size};

/// Combinations of segments that are remembered.
#[cfg(feature = "std")]
const KNOWN: usize = 32;
#[cfg(not(feature = "std"))]
const KNOWN: usize = 4;

/// How far beyond its edge a link may be before it counts as beyond: of the deflections at hand, some hundred roundings. The load is wrong
/// by no more than that, and a link that has passed an edge cannot pass it back by rounding alone.
const SLACK: f64 = 1e-13;

/// How far the bound on the second derivative may rise before all links are looked at anew.
const HEADROOM: f64 = 16.0;

/// Steps that a look ahead is worth, and after how many others the next one is tried where one did not clear as many.
const WORTH: f64 = 8.0;
const WAITS: u32 = 16;

/// The next contact change of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Change {
    /// At which fraction of the step.
    pub theta: f64,
    /// Which link, and whether upwards; none where the search only paused.
    crossing: Option<(usize, bool)>,
}

/// What a combination of segments makes.
#[derive(Debug, Clone, Copy)]
struct Made {
    piece: Piece,
    series: Series,
    /// Bound on the growth rate of a state.
    growth_rate: f64,
}

/// The present segments of all links that have more than one.
#[derive(Debug, Clone)]
pub(crate) struct Contacts<'a> {
    system: &'a System,
    /// Row, by index, of each of those links, and its present segment.
    bends: Many<(usize, u8)>,
    blocks: Many<Block, { ROOM / LANES }>,
    linear: Piece,
    made: Made,
    /// Bound on the second derivative of the state at the end of the last step; the slopes of its excitation, and its values there.
    bending: f64,
    slopes: Values,
    values: Values,
    /// Time for which no link can pass an edge, as long as that bound stays below this limit.
    clear_for: f64,
    limit: f64,
    /// Steps until the next look ahead.
    waits: u32,
    /// The last combinations of segments, and what they make.
    known: [Option<(Many<u8>, Made)>; KNOWN],
    named: u32,
    /// The change that ends the step at hand.
    change: Option<Change>,
    pub changes: usize,
    /// Parts of steps that were looked into.
    pub searched: usize,
}

impl<'a> Contacts<'a> {
    /// The contacts at rest. `load_scale`: the size of the loads, N.
    pub(crate) fn new(system: &'a System, load_scale: f64) -> Self {
        let bent = |row: &Row| !row.link.law().is_linear();
        let count = system.rows().iter().filter(|row| bent(row)).count();
        let mut bends = Many::like((0, 0), count);
        let mut blocks = Many::like(EMPTY, count.div_ceil(LANES));
        let rows = system.rows().iter().enumerate().filter(|(_, row)| bent(row));
        for (bend, (index, row)) in rows.enumerate() {
            let law = row.link.law();
            bends.all_mut()[bend] = (index, law.segment_of(row.rest) as u8);
            let (block, lane) = (&mut blocks.all_mut()[bend / LANES], bend % LANES);
            for j in 0..6 {
                block.deflection[j][lane] = row.deflection[j];
                block.rate[j][lane] = row.rate[j];
            }
            block.reach[lane] = sqrt(row.deflection.iter().map(|x| x * x).sum());
            let edges = law.edges().iter().fold(row.rest.abs(), |most, edge| f64::max(most, edge.abs()));
            block.slack[lane] = SLACK * (edges + load_scale / law.nominal());
        }
        let linear = Piece::of_linear_links(system);
        let mut contacts = Self {
            system,
            bends,
            blocks,
            linear,
            made: Made { piece: linear, series: Series::new(&linear), growth_rate: 0.0 },
            bending: f64::INFINITY,
            slopes: [0.0; 9],
            values: [0.0; 9],
            clear_for: 0.0,
            limit: 0.0,
            waits: 0,
            known: [const { None }; KNOWN],
            named: 0,
            change: None,
            changes: 0,
            searched: 0,
        };
        contacts.cross(&[0.0; 12]);
        contacts
    }

    /// The equations until the next change.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn piece(&self) -> &Piece {
        &self.made.piece
    }

    /// The first change in the step from `state` to `next`, which does not know of it; none if there is none.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn first_change(&mut self, ramp: &Ramp, state: &State, next: &State) -> Option<f64> {
        let growth = self.growth(ramp.h);
        let turn = growth * ramp.turn(&mut self.slopes, &mut self.values);
        self.bending = fma(growth, self.bending, turn);
        // What is no number is not clear.
        if self.clear_for >= ramp.h && self.bending <= self.limit {
            self.clear_for -= ramp.h;
            return None;
        }
        self.clear_for = 0.0;
        // Where the step ends, and how far it can bow in between, on what is known.
        let clear = self.ends_clear(ramp.h, state, next);
        if clear && self.waits > 0 {
            self.waits -= 1;
            return None;
        }
        self.bending = growth * size(&self.second_derivative(ramp, state));
        if clear || self.ends_clear(ramp.h, state, next) {
            self.look_ahead(ramp.h, next);
            return None;
        }
        self.change = if self.cubics_clear(ramp, state, next) { None } else { self.search(ramp, state) };
        self.change.map(|change| change.theta)
    }

    /// Whether no link can pass an edge within a step of length `h` between two states, if none bends more than is known.
    #[cfg_attr(feature = "std", inline(always))]
    fn ends_clear(&self, h: f64, state: &State, next: &State) -> bool {
        let margin = 0.125 * h * h * self.bending;
        let mut clear = margin < f64::INFINITY;
        for block in self.blocks.all() {
            clear = clear && block.ends_clear(state, next, margin);
        }
        clear
    }

    /// For how long no link can pass an edge from a state on.
    #[cfg_attr(feature = "std", inline(always))]
    fn look_ahead(&mut self, h: f64, state: &State) {
        self.limit = HEADROOM * self.bending;
        // Loops and not iterators: closures would be compiled for the oldest processor.
        let mut clear_for = f64::INFINITY;
        for block in self.blocks.all() {
            clear_for = smaller(block.clear_for(state, self.limit), clear_for);
        }
        if clear_for >= h && self.limit < f64::INFINITY {
            self.clear_for = clear_for;
        }
        if clear_for < WORTH * h {
            self.waits = WAITS;
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn cubics_clear(&self, ramp: &Ramp, state: &State, next: &State) -> bool {
        let h = ramp.h;
        // The fourth derivative follows the equations without force too.
        let third = self.made.piece.linear(&self.second_derivative(ramp, state), &NO_FORCE);
        let fourth = self.growth(h) * size(&self.made.piece.linear(&third, &NO_FORCE));
        let margin = h * h * (h * h) / 384.0 * fourth;
        let mut clear = margin < f64::INFINITY;
        for block in self.blocks.all() {
            clear = clear && block.cubics_clear(h, state, next, margin);
        }
        clear
    }

    /// Second derivative of the state at the start of a step: from there on, as the force is linear in time, it follows the equations
    /// without force.
    #[cfg_attr(feature = "std", inline(always))]
    fn second_derivative(&self, ramp: &Ramp, state: &State) -> State {
        let rate = self.made.piece.linear(state, &self.force(ramp, 0.0));
        let mut rise = ramp.rise();
        for entry in &mut rise {
            *entry /= ramp.h;
        }
        self.made.piece.linear(&rate, &rise)
    }

    /// Bound on the growth of a state without force in a time h: `exp(x) <= 1 + x + x²` up to x = 1.25; beyond, the step is halved.
    #[cfg_attr(feature = "std", inline(always))]
    fn growth(&self, h: f64) -> f64 {
        let x = self.made.growth_rate * h;
        if x <= 1.25 { fma(x, x, x) + 1.0 } else { f64::INFINITY }
    }

    /// All of the force but that of the state.
    #[cfg_attr(feature = "std", inline(always))]
    fn force(&self, ramp: &Ramp, theta: f64) -> Force {
        let mut force = ramp.force(theta);
        add_scaled(&mut force, self.made.piece.constant(), 1.0);
        force
    }

    /// The step ended, in `state`, with the change that was found: other equations hold from there on.
    #[inline(never)]
    pub(crate) fn cross(&mut self, state: &State) {
        widest(Crossing { contacts: self, state });
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn change_segments(&mut self, state: &State) {
        if let Some(Change { crossing: Some((crossed, up)), .. }) = self.change.take() {
            let segment = &mut self.bends.all_mut()[crossed].1;
            *segment = if up { *segment + 1 } else { *segment - 1 };
            self.changes += 1;
            // And those that are at their edges too, as where a machine is symmetric.
            for bend in (0..self.bends.all().len()).filter(|&bend| bend != crossed) {
                let (block, lane) = (&self.blocks.all()[bend / LANES], bend % LANES);
                let (at, moving) = (block.deflections(state)[lane], block.rates(state)[lane]);
                let slack = block.slack[lane];
                let segment = &mut self.bends.all_mut()[bend].1;
                // As differences, which are no number where a state is as far as there is no edge.
                if block.high[lane] - at <= slack && moving > 0.0 {
                    *segment += 1;
                } else if at - block.low[lane] <= slack && moving < 0.0 {
                    *segment -= 1;
                } else {
                    continue;
                }
                self.changes += 1;
            }
        }
        self.take_up();
    }

    /// Equations and edges of the present segments.
    #[cfg_attr(feature = "std", inline(always))]
    fn take_up(&mut self) {
        for (bend, &(index, segment)) in self.bends.all().iter().enumerate() {
            let row = &self.system.rows()[index];
            let edges = row.link.law().edges();
            let edge = |i: usize, none: f64| edges.get(i).map_or(none, |edge| edge - row.rest);
            let (block, lane) = (&mut self.blocks.all_mut()[bend / LANES], bend % LANES);
            block.low[lane] = edge((segment as usize).wrapping_sub(1), f64::NEG_INFINITY);
            block.high[lane] = edge(segment as usize, f64::INFINITY);
        }
        (self.bending, self.clear_for) = (f64::INFINITY, 0.0);
        let same = |segments: &Many<u8>| {
            segments.all().iter().zip(self.bends.all()).all(|(known, (_, segment))| known == segment)
        };
        if let Some((_, made)) = self.known.iter().flatten().find(|(segments, _)| same(segments)) {
            self.made = *made;
            return;
        }
        self.named += 1;
        self.made = self.make(self.named);
        let mut segments = Many::like(0, self.bends.all().len());
        for (to, (_, from)) in segments.all_mut().iter_mut().zip(self.bends.all()) {
            *to = *from;
        }
        self.known[self.named as usize % KNOWN] = Some((segments, self.made));
    }

    /// What the present segments make, under the name `key`.
    #[cfg_attr(feature = "std", inline(always))]
    fn make(&self, key: u32) -> Made {
        let mut piece = self.linear;
        for &(index, segment) in self.bends.all() {
            let row = &self.system.rows()[index];
            let (load_at_zero, stiffness) = row.link.law().segment(segment as usize);
            // None on the segment of rest, so that rest is rest to the last bit.
            let excess = if segment as usize == row.link.law().segment_of(row.rest) {
                0.0
            } else {
                fma(stiffness, row.rest, load_at_zero) - row.load
            };
            // In its clearance a link has no stiffness.
            piece.add(row, stiffness, excess, stiffness > 0.0 || !row.link.is_damped_in_contact());
        }
        let piece = piece.with_key(key);
        Made { piece, series: Series::new(&piece), growth_rate: growth_rate(&piece) }
    }
}

/// [`Contacts::cross`] for the processor at hand.
struct Crossing<'a, 'b> {
    contacts: &'b mut Contacts<'a>,
    state: &'b State,
}

impl Kernel for Crossing<'_, '_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        self.contacts.change_segments(self.state);
    }
}
