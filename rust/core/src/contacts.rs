//! Contact changes: which segment of its law each link is on, and when it leaves it.
//!
//! Between two contact changes the equations are linear, and a deflection is known at any time. From where each link is, how it moves and a
//! bound on the second derivative follows a time in which none can reach an edge; until then no step is asked. A step that may contain a
//! change is asked for the cubic through its ends, whose control points bound it, and the fourth derivative what it is wrong by. Only what
//! that does not clear is looked into, on the power series of the exact solution itself, so that no change is missed.

use crate::equations::Equations;
use crate::float::{add_scaled, fma, sqrt};
use crate::integrate::{Ramp, Values};
use crate::many::{Many, ROOM};
use crate::piece::Piece;
use crate::propagator::{Series, TERMS, advance, growth_rate};
use crate::rows::Row;
use crate::simd::{Kernel, widest};
use crate::system::{Force, NO_FORCE, State, System};

/// Links looked at side by side: two AVX2 registers.
const LANES: usize = 8;
type Lanes = [f64; LANES];

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

/// Part of that bound which one kink of the excitation may be before it counts as rough.
const ROUGH: f64 = 0.25;

/// In place of an edge that is infinitely far, and of a rate of zero: no product or ratio of them is no number.
const FAR: f64 = 1e100;
const NEAR: f64 = 1e-100;

/// Eight links: how they move, where they are and which edges they may not pass.
#[derive(Debug, Clone, Copy)]
struct Block {
    deflection: [Lanes; 6],
    rate: [Lanes; 6],
    /// Size of the deflection row: what a state of size one moves the link by.
    reach: Lanes,
    slack: Lanes,
    /// Edges of the present segments, less the deflection at rest.
    low: Lanes,
    high: Lanes,
}

const EMPTY: Block = Block {
    deflection: [[0.0; LANES]; 6],
    rate: [[0.0; LANES]; 6],
    reach: [0.0; LANES],
    slack: [0.0; LANES],
    low: [f64::NEG_INFINITY; LANES],
    high: [f64::INFINITY; LANES],
};

impl Block {
    /// Deflections from rest.
    #[cfg_attr(feature = "std", inline(always))]
    fn deflections(&self, state: &State) -> Lanes {
        let mut at = [0.0; LANES];
        for j in 0..6 {
            add_scaled(&mut at, &self.deflection[j], state[j]);
        }
        at
    }

    /// Their rates.
    #[cfg_attr(feature = "std", inline(always))]
    fn rates(&self, state: &State) -> Lanes {
        let mut moving = [0.0; LANES];
        for j in 0..6 {
            add_scaled(&mut moving, &self.rate[j], state[6 + j]);
        }
        moving
    }

    /// Time in which no link can pass an edge from `state` on, if no second derivative of a state is above `bending`; below zero if one
    /// is beyond.
    #[cfg_attr(feature = "std", inline(always))]
    fn clear_for(&self, state: &State, bending: f64) -> f64 {
        let (at, moving) = (self.deflections(state), self.rates(state));
        let mut times = [0.0; LANES];
        for i in 0..LANES {
            // |v| t + b t² / 2 = d on either side.
            let b = 2.0 * bending * self.reach[i];
            let up = smaller(self.high[i] - at[i] + self.slack[i], FAR);
            let down = smaller(at[i] - self.low[i] + self.slack[i], FAR);
            let (rising, falling) = (larger(moving[i], NEAR), larger(-moving[i], NEAR));
            let to_high = 2.0 * up / (rising + sqrt(fma(rising, rising, b * larger(up, 0.0))));
            let to_low = 2.0 * down / (falling + sqrt(fma(falling, falling, b * larger(down, 0.0))));
            times[i] = smaller(to_high, to_low);
        }
        let mut first = f64::INFINITY;
        for time in times {
            first = smaller(time, first);
        }
        first
    }

    /// Whether no link can pass an edge in a time `h` from `state` on, if no second derivative of a state is above `bending`.
    #[cfg_attr(feature = "std", inline(always))]
    fn step_clear(&self, h: f64, state: &State, bending: f64) -> bool {
        let (at, moving) = (self.deflections(state), self.rates(state));
        let margin = 0.5 * h * h * bending;
        let mut worst = [0.0; LANES];
        for i in 0..LANES {
            let up = fma(h, larger(moving[i], 0.0), at[i] - self.high[i]);
            let down = fma(h, larger(-moving[i], 0.0), self.low[i] - at[i]);
            worst[i] = fma(margin, self.reach[i], larger(up, down)) - self.slack[i];
        }
        let mut clear = true;
        for worst in worst {
            clear &= worst <= 0.0;
        }
        clear
    }

    /// Whether the cubics through both ends of a step, which they are wrong by no more than `margin` per unit of reach, stay within the edges.
    #[cfg_attr(feature = "std", inline(always))]
    fn cubics_clear(&self, h: f64, state: &State, next: &State, margin: f64) -> bool {
        let (at, end_at) = (self.deflections(state), self.deflections(next));
        let (moving, end_moving) = (self.rates(state), self.rates(next));
        let third = h / 3.0;
        let mut worst = f64::NEG_INFINITY;
        for i in 0..LANES {
            let (after, before) = (fma(third, moving[i], at[i]), fma(-third, end_moving[i], end_at[i]));
            let top = larger(larger(after, before), larger(at[i], end_at[i])) - self.high[i];
            let bottom = self.low[i] - smaller(smaller(after, before), smaller(at[i], end_at[i]));
            worst = larger(fma(margin, self.reach[i], larger(top, bottom)) - self.slack[i], worst);
        }
        worst <= 0.0
    }
}

/// The larger of two; unlike `f64::max` one instruction.
#[cfg_attr(feature = "std", inline(always))]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two; the second if one is no number.
#[cfg_attr(feature = "std", inline(always))]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

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
        // Where each sample is a kink, the bound does not hold for longer than a step.
        let rough = turn > ROUGH * self.bending;
        if rough && self.step_clear(ramp, state) {
            return None;
        }
        self.bending = growth * size(&self.second_derivative(ramp, state));
        if rough {
            if self.step_clear(ramp, state) {
                return None;
            }
        } else {
            self.limit = HEADROOM * self.bending;
            // Loops and not iterators: closures would be compiled for the oldest processor.
            let mut clear_for = f64::INFINITY;
            for block in self.blocks.all() {
                clear_for = smaller(block.clear_for(state, self.limit), clear_for);
            }
            if clear_for >= ramp.h && self.limit < f64::INFINITY {
                self.clear_for = clear_for - ramp.h;
                return None;
            }
        }
        self.change = if self.cubics_clear(ramp, state, next) { None } else { self.search(ramp, state) };
        self.change.map(|change| change.theta)
    }

    /// Whether no link can pass an edge within a step.
    #[cfg_attr(feature = "std", inline(always))]
    fn step_clear(&self, ramp: &Ramp, state: &State) -> bool {
        let mut clear = self.bending < f64::INFINITY;
        for block in self.blocks.all() {
            clear = clear && block.step_clear(ramp.h, state, self.bending);
        }
        clear
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
        let mut rise = rise(ramp);
        for entry in &mut rise {
            *entry /= ramp.h;
        }
        self.made.piece.linear(&rate, &rise)
    }

    /// Bound on the growth of a state without force in a time h: `exp(x) <= 1 + 2 x` up to x = 1.25; beyond, the step is halved.
    #[cfg_attr(feature = "std", inline(always))]
    fn growth(&self, h: f64) -> f64 {
        let x = self.made.growth_rate * h;
        if x <= 1.25 { fma(2.0, x, 1.0) } else { f64::INFINITY }
    }

    /// All of the force but that of the state.
    #[cfg_attr(feature = "std", inline(always))]
    fn force(&self, ramp: &Ramp, theta: f64) -> Force {
        let mut force = ramp.force(theta);
        add_scaled(&mut force, self.made.piece.constant(), 1.0);
        force
    }

    /// Looks for the first change by halves until the power series holds.
    #[inline(never)]
    fn search(&mut self, ramp: &Ramp, state: &State) -> Option<Change> {
        let (change, searched) = widest(Search { contacts: self, ramp, state });
        self.searched += searched;
        change
    }

    /// The first change on the power series of a state over a part of a step.
    #[cfg_attr(feature = "std", inline(always))]
    fn search_series(&self, terms: &[State; TERMS + 1]) -> Option<Change> {
        let mut first: Option<Change> = None;
        for (index, block) in self.blocks.all().iter().enumerate() {
            let mut paths = [[0.0; LANES]; TERMS + 1];
            let mut reached = [0.0; LANES];
            for k in 0..=TERMS {
                paths[k] = block.deflections(&terms[k]);
                for i in 0..LANES {
                    reached[i] += if k > 0 { paths[k][i].abs() } else { 0.0 };
                }
            }
            for lane in 0..LANES {
                let (low, high) = (block.low[lane] - block.slack[lane], block.high[lane] + block.slack[lane]);
                if paths[0][lane] + reached[lane] <= high && paths[0][lane] - reached[lane] >= low {
                    continue;
                }
                let mut path = [0.0; TERMS + 1];
                for k in 0..=TERMS {
                    path[k] = paths[k][lane];
                }
                let limit = if let Some(change) = first { change.theta } else { 1.0 };
                if let Some((theta, up)) = Path::new(path).first_exit(low, high, limit) {
                    first = Some(Change { theta, crossing: Some((index * LANES + lane, up)) });
                }
            }
        }
        first
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

/// Parts of one step that are looked into at a time, about a second's work: then the run may count them.
const MOST_PARTS: usize = 1_000_000;

/// Halvings of a step, after which any is short.
const MOST_HALVINGS: usize = 64;

/// [`Contacts::search`] for the processor at hand; also how many parts it looked into.
struct Search<'a> {
    contacts: &'a Contacts<'a>,
    ramp: &'a Ramp<'a>,
    state: &'a State,
}

impl Kernel for Search<'_> {
    type Output = (Option<Change>, usize);

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> Self::Output {
        let Self { contacts, ramp, state } = self;
        let Made { piece, series, .. } = &contacts.made;
        // Parts that lie ahead, the nearest last: where they end. The whole is known not to be clear.
        let mut ends = [1.0; MOST_HALVINGS];
        ends[1] = 0.5;
        let mut ahead = if series.parts(ramp.h) > 1.0 { 2 } else { 1 };
        let (mut from, mut state) = (0.0, *state);
        let mut searched = 0;
        while ahead > 0 {
            let to = ends[ahead - 1];
            if searched == MOST_PARTS {
                return (Some(Change { theta: from, crossing: None }), searched);
            }
            searched += 1;
            let (start, end) = (ramp.values(from), ramp.values(to));
            let part =
                Ramp { h: (to - from) * ramp.h, start: &start, end: &end, drive: ramp.drive, whole: false };
            if series.parts(part.h) <= 1.0 {
                let terms = series.terms(piece, &part, &state);
                if let Some(Change { theta, crossing }) = contacts.search_series(&terms) {
                    return (Some(Change { theta: fma(theta, to - from, from), crossing }), searched);
                }
                for term in &terms[1..] {
                    add_scaled(&mut state, term, 1.0);
                }
            } else {
                let next = advance(piece, series, &part, &state);
                if ahead < MOST_HALVINGS && !contacts.cubics_clear(&part, &state, &next) {
                    ends[ahead] = 0.5 * (from + to);
                    ahead += 1;
                    continue;
                }
                state = next;
            }
            from = to;
            ahead -= 1;
        }
        (None, searched)
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

#[cfg_attr(feature = "std", inline(always))]
fn rise(ramp: &Ramp) -> Force {
    let (first, last) = (ramp.force(0.0), ramp.force(1.0));
    let mut rise = NO_FORCE;
    for i in 0..6 {
        rise[i] = last[i] - first[i];
    }
    rise
}

#[cfg_attr(feature = "std", inline(always))]
fn size(state: &State) -> f64 {
    let mut sums = [0.0; 4];
    for entries in state.as_chunks::<4>().0 {
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum = fma(*entry, *entry, *sum);
        }
    }
    sqrt(sums[0] + sums[1] + (sums[2] + sums[3]))
}

/// A deflection over a step: its power series in the fraction of the step.
struct Path {
    terms: [f64; TERMS + 1],
    /// Largest fourth derivative, or more.
    fourth: f64,
}

/// Halvings of a step after which it is not looked into any more: a path that turns within such a part turns within rounding.
const HALVINGS: usize = 30;

/// Parts of a step after which none is halved any more: a path that turns at an edge needs some sixty, one along it would need all.
const MOST_LOOKS: usize = 1000;

/// Steps of a root search that gains a digit or more each.
const ROOT_STEPS: usize = 60;

impl Path {
    #[cfg_attr(feature = "std", inline(always))]
    fn new(terms: [f64; TERMS + 1]) -> Self {
        let mut fourth = 0.0;
        for k in 4..=TERMS {
            fourth = fma((k * (k - 1) * (k - 2) * (k - 3)) as f64, terms[k].abs(), fourth);
        }
        Self { terms, fourth }
    }

    /// Value and slope.
    #[cfg_attr(feature = "std", inline(always))]
    fn at(&self, theta: f64) -> [f64; 2] {
        let (mut value, mut slope) = (0.0, 0.0);
        for term in self.terms.iter().rev() {
            slope = fma(slope, theta, value);
            value = fma(value, theta, *term);
        }
        [value, slope]
    }

    /// The first fraction up to `limit` at which the path leaves `low..=high`, and whether upwards. A start outside counts once the path
    /// moves further out.
    #[cfg_attr(feature = "std", inline(always))]
    fn first_exit(&self, low: f64, high: f64, limit: f64) -> Option<(f64, bool)> {
        let mut start = [self.terms[0], self.terms[1]];
        if start[0] > high && start[1] > 0.0 || start[0] < low && start[1] < 0.0 {
            return Some((0.0, start[0] > high));
        }
        let (low, high) = (f64::min(low, start[0]), f64::max(high, start[0]));
        // Parts that lie ahead, the nearest last: the end of each.
        let mut ends = [(0.0, [0.0; 2]); HALVINGS + 1];
        ends[0] = (limit, self.at(limit));
        let (mut ahead, mut a, mut looks) = (1, 0.0, 0);
        while ahead > 0 {
            let (b, end) = ends[ahead - 1];
            looks += 1;
            match self.look(a, start, b, end, low, high) {
                Look::Inside => {}
                Look::Exit(theta, up) => return Some((theta, up)),
                Look::Closer if ahead <= HALVINGS && looks < MOST_LOOKS => {
                    let middle = 0.5 * (a + b);
                    ends[ahead] = (middle, self.at(middle));
                    ahead += 1;
                    continue;
                }
                Look::Closer if end[0] < low || end[0] > high => return Some((b, end[0] > high)),
                Look::Closer => {}
            }
            (a, start) = (b, end);
            ahead -= 1;
        }
        None
    }

    /// What the values and slopes at both ends of a part tell of it.
    #[cfg_attr(feature = "std", inline(always))]
    fn look(&self, a: f64, start: [f64; 2], b: f64, end: [f64; 2], low: f64, high: f64) -> Look {
        let h = b - a;
        // Control points of the cubic, and what it can be wrong by; the same of its slope.
        let margin = self.fourth * h * h * h * h / 384.0;
        let (after, before) = (start[0] + h / 3.0 * start[1], end[0] - h / 3.0 * end[1]);
        let (top, bottom) =
            (f64::max(f64::max(after, before), end[0]), f64::min(f64::min(after, before), end[0]));
        if bottom - margin >= low && top + margin <= high {
            return Look::Inside;
        }
        let up = end[0] > high;
        if up || end[0] < low {
            let (bow, margin) =
                (3.0 * (end[0] - start[0]) / h - start[1] - end[1], self.fourth * h * h * h / 100.0);
            let sign = if up { 1.0 } else { -1.0 };
            if f64::min(f64::min(sign * start[1], sign * end[1]), sign * bow) > margin {
                return Look::Exit(self.root(a, b, if up { high } else { low }, up), up);
            }
        }
        Look::Closer
    }

    /// Where a path that rises (`up`) or falls all along passes `edge`, from the far side: Newton, held within a bracket.
    #[cfg_attr(feature = "std", inline(always))]
    fn root(&self, mut a: f64, mut b: f64, edge: f64, up: bool) -> f64 {
        let mut theta = 0.5 * (a + b);
        for _ in 0..ROOT_STEPS {
            let [value, slope] = self.at(theta);
            if (value > edge) == up {
                b = theta
            } else {
                a = theta
            }
            let next = theta - (value - edge) / slope;
            if (next - theta).abs() <= 4.0 * f64::EPSILON * theta || b - a <= 2.0 * f64::EPSILON * b {
                break;
            }
            theta = if next > a && next < b { next } else { 0.5 * (a + b) };
        }
        theta
    }
}

/// What is known of a part of a path.
enum Look {
    /// It does not leave.
    Inside,
    /// It leaves there, and whether upwards.
    Exit(f64, bool),
    /// Its halves will tell.
    Closer,
}
