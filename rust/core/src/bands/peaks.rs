//! Random peaks of the loads, drawn from the posterior of the motion.

use std::sync::{Mutex, PoisonError};

use super::schedule::{Deviation, Event, Response, Schedule};
use crate::error::Stopped;
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::numeric::simd::{LANES, Lanes, dispatch_wide};
use crate::numeric::watch::{Watch, filled, on_threads, room};
use crate::output::Wrench;
use crate::smoother::DeviationDraws;
use crate::system::{ModelLevel, State, System};

/// The loads to which deviations are added.
#[derive(Debug, Clone, Copy)]
pub struct NominalLoads<'a> {
    /// m ascending times, s.
    pub instants: &'a [f64],
    /// m x groups x 6: force (N) and moment (N m).
    pub loads: &'a [f64],
    /// m x groups: whether a group is evaluated at an instant.
    pub wanted: &'a [bool],
}

/// Draws the largest y-z resultant of each group over its `wanted` instants: `out[group * draws + draw]`, N, zero if there are none. Returns
/// None for a scene that is not linear. A draw depends only on the seed and its own number, not on the number of `threads`.
///
/// # Errors
/// [`Stopped`].
///
/// # Panics
/// If lengths do not agree.
pub fn draw_peaks(
    system: &System,
    deviation: Deviation,
    nominal: NominalLoads,
    groups: &[Wrench],
    seed: u64,
    threads: usize,
    out: &mut [f64],
) -> Result<Option<()>, Stopped> {
    if system.model_level() != ModelLevel::Linear {
        return Ok(None);
    }
    let NominalLoads { instants, loads, wanted } = nominal;
    let draws = out.len() / groups.len().max(1);
    assert_eq!(out.len(), draws * groups.len(), "room for every draw of every group");
    assert_eq!(loads.len(), 6 * groups.len() * instants.len(), "loads at every instant");
    assert_eq!(wanted.len(), groups.len() * instants.len(), "every group at every instant");
    // No load is evaluated after the last wanted instant.
    let last = wanted.iter().rposition(|wanted| *wanted).map_or(0, |at| at / groups.len() + 1);
    let plan = Plan {
        active: system.mode_count(),
        order: deviation.posterior.order(),
        derivative: deviation.derivative,
        start: deviation.start(system),
        across: groups
            .iter()
            .map(|load| [1, 2].map(|row| load.linear.by_state.map(|all| all[row])))
            .collect(),
        loads,
        wanted,
    };
    let mut blocks = room(draws.div_ceil(LANES))?;
    for first in (0..draws).step_by(LANES) {
        blocks.push(DrawBlock::new(seed, first, groups.len())?);
    }
    let watch = deviation.posterior.watch();
    follow_on_threads(threads, watch, &mut blocks, &plan, || {
        Schedule::new(system, deviation, &instants[..last])
    });
    watch.check()?;
    for (index, out) in out.iter_mut().enumerate() {
        let (group, draw) = (index / draws, index % draws);
        *out = sqrt(blocks[draw / LANES].largest[group][draw % LANES]);
    }
    Ok(Some(()))
}

/// Advances all draws along a schedule. Each thread advances a part of the draws, with its own schedule.
fn follow_on_threads<'a>(
    threads: usize,
    watch: Watch,
    blocks: &mut [DrawBlock],
    plan: &Plan,
    schedule: impl Fn() -> Schedule<'a> + Sync,
) {
    let follow = |blocks: &mut [DrawBlock]| {
        let mut schedule = schedule();
        let mut events = Vec::with_capacity(EVENTS_AT_A_TIME);
        loop {
            events.clear();
            events.extend(schedule.by_ref().take(EVENTS_AT_A_TIME));
            if events.is_empty() {
                return;
            }
            for block in &mut *blocks {
                if watch.stops() {
                    return;
                }
                dispatch_wide!(follow(block, &events, plan));
            }
        }
    };
    let share = blocks.len().div_ceil(threads.max(1)).max(1);
    let threads = threads.clamp(1, blocks.len().div_ceil(share).max(1));
    let shares = Mutex::new(blocks.chunks_mut(share));
    on_threads(threads, watch, || {
        loop {
            let next = shares.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some(blocks) = next else { return };
            follow(blocks);
        }
    });
}

/// Number of events by which all draws advance before the next ones are prepared.
const EVENTS_AT_A_TIME: usize = 48;

struct Plan<'a> {
    /// Number of modes.
    active: usize,
    order: usize,
    derivative: usize,
    /// State at the first sample per m/s² of its acceleration.
    start: State,
    /// Fy and Fz of each group per unit of each entry of the state.
    across: Vec<[[f64; 12]; 2]>,
    loads: &'a [f64],
    wanted: &'a [bool],
}

/// Eight draws side by side.
struct DrawBlock {
    drawn: DeviationDraws,
    started: bool,
    /// Acceleration at the start and at the end of the interval, m/s².
    before: Lanes,
    after: Lanes,
    state: [Lanes; 12],
    /// Square of the largest resultant of each group so far.
    largest: Vec<Lanes>,
}

impl DrawBlock {
    fn new(seed: u64, first: usize, groups: usize) -> Result<Self, Stopped> {
        Ok(Self {
            drawn: DeviationDraws::new(seed, first),
            started: false,
            before: [0.0; LANES],
            after: [0.0; LANES],
            state: [[0.0; LANES]; 12],
            largest: filled([0.0; LANES], groups)?,
        })
    }

    #[inline(always)]
    fn advance(&mut self, plan: &Plan, response: &Response, from: f64, to: f64) {
        let (mut start, mut end) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let rise = self.after[lane] - self.before[lane];
            start[lane] = fma(from, rise, self.before[lane]);
            end[lane] = fma(to, rise, self.before[lane]);
        }
        let old = self.state;
        // Four entries at a time share each entry of the old state while it is in a register.
        for rows in 0..3 {
            let mut sums = [[0.0; LANES]; 4];
            for i in 0..4 {
                let row = 4 * rows + i;
                for lane in 0..LANES {
                    sums[i][lane] = fma(response.start[row], start[lane], response.end[row] * end[lane]);
                }
            }
            for half in [0, 6] {
                for j in half..half + plan.active {
                    for i in 0..4 {
                        add_scaled(&mut sums[i], &old[j], response.transition[j][4 * rows + i]);
                    }
                }
            }
            self.state[4 * rows..4 * rows + 4].copy_from_slice(&sums);
        }
    }

    #[inline(always)]
    fn update_largest(&mut self, plan: &Plan, index: usize) {
        let groups = plan.across.len();
        for group in 0..groups {
            if !plan.wanted[index * groups + group] {
                continue;
            }
            let load = &plan.loads[6 * (index * groups + group)..];
            let (mut y, mut z) = ([load[1]; LANES], [load[2]; LANES]);
            let [by_y, by_z] = &plan.across[group];
            for j in 0..12 {
                add_scaled(&mut y, &self.state[j], by_y[j]);
                add_scaled(&mut z, &self.state[j], by_z[j]);
            }
            let largest = &mut self.largest[group];
            for lane in 0..LANES {
                let square = fma(y[lane], y[lane], z[lane] * z[lane]);
                largest[lane] = if square > largest[lane] { square } else { largest[lane] };
            }
        }
    }
}

/// Advances eight draws by several events.
#[inline(always)]
fn follow(block: &mut DrawBlock, events: &[Event], plan: &Plan) {
    for step in events {
        match step {
            Event::Sample { step, unit } => {
                block.before = block.after;
                block.drawn.advance(step, plan.order);
                for lane in 0..LANES {
                    block.after[lane] = unit * block.drawn.state[plan.derivative][lane];
                }
                if !block.started {
                    block.started = true;
                    block.state = plan.start.map(|z| block.after.map(|acceleration| z * acceleration));
                }
            }
            Event::Part { response, from, to } => block.advance(plan, response, *from, *to),
            Event::Instant { index, .. } => block.update_largest(plan, *index),
        }
    }
}
