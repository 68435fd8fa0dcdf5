//! Contact changes: which segment of its law each link is on, and when it leaves it.
//!
//! Between two contact changes the equations are linear, and a deflection is known at any time. Whether a step contains a change is asked
//! of the cubic through its ends, whose control points bound it; what the cubic can be wrong by is bounded by the fourth derivative. Only a
//! step that this does not clear is looked into, on the power series of the exact solution itself, so that no change is missed.

use crate::equations::Equations;
use crate::float::{add_scaled, fma, sqrt};
use crate::integrate::Ramp;
use crate::many::{Many, ROOM};
use crate::piece::Piece;
use crate::propagator::{Series, TERMS, advance, matrix, norms};
use crate::rows::Row;
use crate::simd::{Kernel, widest};
use crate::system::{Force, NO_FORCE, State, System};

/// Links looked at side by side: two AVX2 registers.
const LANES: usize = 8;
type Lanes = [f64; LANES];

/// Combinations of segments whose names are remembered.
#[cfg(feature = "std")]
const NAMES: usize = 64;
#[cfg(not(feature = "std"))]
const NAMES: usize = 8;

/// How far beyond its edge a link may be before it counts as beyond: of the deflections at hand, some hundred roundings. The load is wrong
/// by no more than that, and a link that has passed an edge cannot pass it back by rounding alone.
const SLACK: f64 = 1e-13;

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
    /// Deflection from rest and its rate at the start of the step.
    at: Lanes,
    moving: Lanes,
    /// The same at its end.
    end_at: Lanes,
    end_moving: Lanes,
}

const EMPTY: Block = Block {
    deflection: [[0.0; LANES]; 6],
    rate: [[0.0; LANES]; 6],
    reach: [0.0; LANES],
    slack: [0.0; LANES],
    low: [f64::NEG_INFINITY; LANES],
    high: [f64::INFINITY; LANES],
    at: [0.0; LANES],
    moving: [0.0; LANES],
    end_at: [0.0; LANES],
    end_moving: [0.0; LANES],
};

impl Block {
    #[inline(always)]
    fn of(&self, state: &State) -> (Lanes, Lanes) {
        let (mut at, mut moving) = ([0.0; LANES], [0.0; LANES]);
        for j in 0..6 {
            add_scaled(&mut at, &self.deflection[j], state[j]);
            add_scaled(&mut moving, &self.rate[j], state[6 + j]);
        }
        (at, moving)
    }

    /// Whether the cubics through both ends stay within the edges by `margin` per unit of reach, in all lanes.
    #[inline(always)]
    fn clear(&self, h: f64, margin: f64) -> bool {
        let third = h / 3.0;
        let mut outside = [0.0; LANES];
        for i in 0..LANES {
            let after = fma(third, self.moving[i], self.at[i]);
            let before = fma(-third, self.end_moving[i], self.end_at[i]);
            let room = fma(-margin, self.reach[i], self.slack[i]);
            let top = f64::max(f64::max(after, before), self.end_at[i]) - self.high[i];
            let bottom = self.low[i] - f64::min(f64::min(after, before), self.end_at[i]);
            outside[i] = if f64::max(top, bottom) <= room { 0.0 } else { 1.0 };
        }
        outside == [0.0; LANES]
    }
}

/// The next contact change of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Change {
    /// At which fraction of the step.
    pub theta: f64,
    bend: usize,
    up: bool,
}

/// The present segments of all links that have more than one.
#[derive(Debug, Clone)]
pub(crate) struct Contacts<'a> {
    system: &'a System,
    /// Row, by index, of each of those links, and its present segment.
    bends: Many<(usize, u8)>,
    blocks: Many<Block, { ROOM / LANES }>,
    linear: Piece,
    piece: Piece,
    series: Series,
    /// Norm of the piece's matrix, and bound on the growth rate of a state.
    norm: f64,
    growth: f64,
    /// Names of the last pieces: a number, and the segments.
    names: [(u32, Option<Many<u8>>); NAMES],
    named: u32,
    /// The change that ends the step at hand.
    change: Option<Change>,
    pub changes: usize,
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
            piece: linear,
            series: Series::new(&linear),
            norm: 0.0,
            growth: 0.0,
            names: [const { (0, None) }; NAMES],
            named: 0,
            change: None,
            changes: 0,
        };
        contacts.make_piece();
        contacts.place(&[0.0; 12]);
        contacts
    }

    /// The equations until the next change.
    #[inline(always)]
    pub(crate) fn piece(&self) -> &Piece {
        &self.piece
    }

    /// The first change in the step from `state` to `next`, which does not know of it; none if there is none.
    #[inline(always)]
    pub(crate) fn first_change(&mut self, ramp: &Ramp, state: &State, next: &State) -> Option<f64> {
        for block in self.blocks.all_mut() {
            (block.end_at, block.end_moving) = block.of(next);
        }
        // Quick: the second derivative of the state from its size; closer: as it is.
        let (force, rise) = (self.force(ramp, 0.0), rise(ramp));
        let quick =
            self.norm * fma(self.norm, size(state), size_of_force(&force)) + size_of_force(&rise) / ramp.h;
        let factor = self.margin_factor(ramp.h);
        if self.all_clear(ramp.h, factor * quick) {
            self.change = None;
            return None;
        }
        let bending = self.bending(ramp, state);
        self.change = if self.all_clear(ramp.h, factor * bending) { None } else { self.search(ramp, state) };
        self.change.map(|change| change.theta)
    }

    /// Size of the second derivative of the state at the start of a step: from there on, as the force is linear in time, it follows the
    /// equations without force.
    #[inline(always)]
    fn bending(&self, ramp: &Ramp, state: &State) -> f64 {
        let rate = self.piece.linear(state, &self.force(ramp, 0.0));
        let rise = rise(ramp).map(|x| x / ramp.h);
        size(&self.piece.linear(&rate, &rise))
    }

    /// What the error of a cubic through both ends is, per unit of the second derivative and of reach: `h⁴ |A²| / 384`, and growth.
    #[inline(always)]
    fn margin_factor(&self, h: f64) -> f64 {
        let square = self.norm * h * (self.norm * h);
        // exp(x) <= 1 + 2 x up to x = 1.25; beyond, the step is halved.
        let growth = if self.growth * h <= 1.25 { 1.0 + 2.0 * self.growth * h } else { f64::INFINITY };
        square * h * h / 384.0 * growth
    }

    #[inline(always)]
    fn all_clear(&self, h: f64, margin: f64) -> bool {
        self.blocks.all().iter().all(|block| block.clear(h, margin))
    }

    /// All of the force but that of the state.
    #[inline(always)]
    fn force(&self, ramp: &Ramp, theta: f64) -> Force {
        let mut force = ramp.force(theta);
        add_scaled(&mut force, self.piece.constant(), 1.0);
        force
    }

    /// Looks for the first change by halves until the power series holds.
    #[inline(never)]
    fn search(&self, ramp: &Ramp, state: &State) -> Option<Change> {
        widest(Search { contacts: self, ramp, state })
    }

    #[inline(always)]
    fn search_half(&self, ramp: &Ramp, state: &State, next: &State) -> Option<Change> {
        let margin = self.margin_factor(ramp.h) * self.bending(ramp, state);
        let clear = self.blocks.all().iter().all(|block| {
            let mut block = *block;
            (block.at, block.moving) = block.of(state);
            (block.end_at, block.end_moving) = block.of(next);
            // The start is asked too: here it may lie beyond an edge.
            block.clear(0.0, 0.0) && block.clear(ramp.h, margin)
        });
        if clear { None } else { self.search(ramp, state) }
    }

    /// Looks for the first change on the power series of each deflection.
    #[inline(always)]
    fn search_series(&self, ramp: &Ramp, state: &State) -> Option<Change> {
        let terms = self.series.terms(&self.piece, ramp, state);
        let mut first: Option<Change> = None;
        for (index, block) in self.blocks.all().iter().enumerate() {
            for lane in 0..LANES {
                let (low, high) = (block.low[lane] - block.slack[lane], block.high[lane] + block.slack[lane]);
                let mut path = [0.0; TERMS + 1];
                for (entry, term) in path.iter_mut().zip(&terms) {
                    *entry = (0..6).map(|j| block.deflection[j][lane] * term[j]).sum();
                }
                let limit = first.map_or(1.0, |change| change.theta);
                if let Some((theta, up)) = Path::new(path).first_exit(low, high, limit) {
                    first = Some(Change { theta, bend: index * LANES + lane, up });
                }
            }
        }
        first
    }

    /// The step stands as it is, and `first_change` has seen its end.
    #[inline(always)]
    pub(crate) fn passed(&mut self) {
        for block in self.blocks.all_mut() {
            (block.at, block.moving) = (block.end_at, block.end_moving);
        }
    }

    /// The step ended, in `state`, with the change that was found: other equations hold from there on.
    #[inline(never)]
    pub(crate) fn cross(&mut self, state: &State) {
        widest(Crossing { contacts: self, state });
    }

    #[inline(always)]
    fn change_segments(&mut self, state: &State) {
        self.place(state);
        if let Some(change) = self.change.take() {
            let segment = &mut self.bends.all_mut()[change.bend].1;
            *segment = if change.up { *segment + 1 } else { *segment - 1 };
            self.changes += 1;
            // And those that are at their edges too, as where a machine is symmetric.
            for bend in (0..self.bends.all().len()).filter(|&bend| bend != change.bend) {
                let (block, lane) = (&self.blocks.all()[bend / LANES], bend % LANES);
                let (at, moving, slack) = (block.at[lane], block.moving[lane], block.slack[lane]);
                let segment = &mut self.bends.all_mut()[bend].1;
                if at >= block.high[lane] - slack && moving > 0.0 {
                    *segment += 1;
                } else if at <= block.low[lane] + slack && moving < 0.0 {
                    *segment -= 1;
                } else {
                    continue;
                }
                self.changes += 1;
            }
        }
        self.make_piece();
    }

    /// Where all links are, at the start of a step.
    #[inline(always)]
    fn place(&mut self, state: &State) {
        for block in self.blocks.all_mut() {
            (block.at, block.moving) = block.of(state);
        }
    }

    /// Equations and edges of the present segments.
    #[inline(always)]
    fn make_piece(&mut self) {
        let mut piece = self.linear;
        for (bend, &(index, segment)) in self.bends.all().iter().enumerate() {
            let row = &self.system.rows()[index];
            let law = row.link.law();
            let (load_at_zero, stiffness) = law.segment(segment as usize);
            let excess = fma(stiffness, row.rest, load_at_zero) - row.load;
            // In its clearance a link has no stiffness.
            piece.add(row, stiffness, excess, stiffness > 0.0 || !row.link.is_damped_in_contact());
            let (block, lane) = (&mut self.blocks.all_mut()[bend / LANES], bend % LANES);
            let edges = law.edges();
            let edge = |i: usize, none: f64| edges.get(i).map_or(none, |edge| edge - row.rest);
            block.low[lane] = edge((segment as usize).wrapping_sub(1), f64::NEG_INFINITY);
            block.high[lane] = edge(segment as usize, f64::INFINITY);
        }
        self.piece = piece.with_key(self.name());
        self.series = Series::new(&self.piece);
        (self.norm, self.growth) = norms(&matrix(&self.piece));
    }

    /// The number of the present combination of segments: that of earlier, or a new one.
    fn name(&mut self) -> u32 {
        let mut segments = Many::like(0, self.bends.all().len());
        for (to, (_, from)) in segments.all_mut().iter_mut().zip(self.bends.all()) {
            *to = *from;
        }
        for (name, known) in &self.names {
            if known.as_ref() == Some(&segments) {
                return *name;
            }
        }
        self.named += 1;
        self.names[self.named as usize % NAMES] = (self.named, Some(segments));
        self.named
    }
}

/// [`Contacts::search`] for the processor at hand.
struct Search<'a> {
    contacts: &'a Contacts<'a>,
    ramp: &'a Ramp<'a>,
    state: &'a State,
}

impl Kernel for Search<'_> {
    type Output = Option<Change>;

    #[inline(always)]
    fn run(self) -> Option<Change> {
        let Self { contacts, ramp, state } = self;
        let Contacts { piece, series, .. } = contacts;
        if series.parts(ramp.h) <= 1.0 {
            return contacts.search_series(ramp, state);
        }
        let middle = ramp.values(0.5);
        let first = Ramp { h: 0.5 * ramp.h, end: &middle, whole: false, ..*ramp };
        let second = Ramp { start: &middle, end: ramp.end, ..first };
        let halfway = advance(piece, series, &first, state);
        if let Some(change) = contacts.search_half(&first, state, &halfway) {
            return Some(Change { theta: 0.5 * change.theta, ..change });
        }
        let end = advance(piece, series, &second, &halfway);
        let change = contacts.search_half(&second, &halfway, &end)?;
        Some(Change { theta: fma(0.5, change.theta, 0.5), ..change })
    }
}

/// [`Contacts::cross`] for the processor at hand.
struct Crossing<'a, 'b> {
    contacts: &'b mut Contacts<'a>,
    state: &'b State,
}

impl Kernel for Crossing<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.contacts.change_segments(self.state);
    }
}

#[inline(always)]
fn rise(ramp: &Ramp) -> Force {
    let (first, last) = (ramp.force(0.0), ramp.force(1.0));
    let mut rise = NO_FORCE;
    for i in 0..6 {
        rise[i] = last[i] - first[i];
    }
    rise
}

#[inline(always)]
fn size(state: &State) -> f64 {
    let mut sums = [0.0; 4];
    for entries in state.as_chunks::<4>().0 {
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum = fma(*entry, *entry, *sum);
        }
    }
    sqrt(sums[0] + sums[1] + (sums[2] + sums[3]))
}

#[inline(always)]
fn size_of_force(force: &Force) -> f64 {
    let mut sums = [0.0; 4];
    for entries in force.as_chunks::<4>().0 {
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

/// Steps of a root search that gains a digit or more each.
const ROOT_STEPS: usize = 60;

impl Path {
    #[inline(always)]
    fn new(terms: [f64; TERMS + 1]) -> Self {
        let fourth = (4..=TERMS).map(|k| (k * (k - 1) * (k - 2) * (k - 3)) as f64 * terms[k].abs()).sum();
        Self { terms, fourth }
    }

    /// Value and slope.
    #[inline(always)]
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
    #[inline(always)]
    fn first_exit(&self, low: f64, high: f64, limit: f64) -> Option<(f64, bool)> {
        let mut start = self.at(0.0);
        if start[0] > high && start[1] > 0.0 || start[0] < low && start[1] < 0.0 {
            return Some((0.0, start[0] > high));
        }
        let (low, high) = (f64::min(low, start[0]), f64::max(high, start[0]));
        // Parts that lie ahead, the nearest last: the end of each.
        let mut ends = [(0.0, [0.0; 2]); HALVINGS + 1];
        ends[0] = (limit, self.at(limit));
        let (mut ahead, mut a) = (1, 0.0);
        while ahead > 0 {
            let (b, end) = ends[ahead - 1];
            match self.look(a, start, b, end, low, high) {
                Look::Inside => {}
                Look::Exit(theta, up) => return Some((theta, up)),
                Look::Closer if ahead <= HALVINGS => {
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
    #[inline(always)]
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
    #[inline(always)]
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
