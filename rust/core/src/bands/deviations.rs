//! Standard deviations of acceleration and loads at every instant.

use super::covariance::Covariance;
use super::schedule::{Deviation, Event, Schedule};
use crate::error::Stopped;
use crate::numeric::float::{add_scaled, fma, norm, sqrt};
use crate::numeric::simd::{LANES, Lanes, dispatch};
use crate::output::{Axial, Part, Recovery, Wrench, link_load};
use crate::system::{ModelLevel, System};

/// Eight quantities per unit of each entry of the state.
type Rows = [Lanes; 12];

/// Standard deviations at m instants, to be filled.
#[derive(Debug)]
pub struct StandardDeviations<'a> {
    /// m: of the acceleration along x, m/s².
    pub acceleration: &'a mut [f64],
    /// m x groups x 6: of force (N) and moment (N m).
    pub groups: &'a mut [f64],
    /// m x groups x 2: of the y-z resultant of the force (N) and of the size of the moment (N m), to first order in the deviation.
    pub sizes: &'a mut [f64],
    /// m x links: of the loads along the links, N.
    pub links: &'a mut [f64],
}

/// Computes the standard deviations of the loads of `groups` and of all links that follow from the deviation of the acceleration; None for a
/// scene that is not linear.
///
/// `instants`: m ascending times, s. `loads`: m x groups x 6, the nominal loads, which determine the direction of the resultants. A
/// resultant of zero has no direction; its deviation is the root of the sum of its components' variances.
///
/// # Errors
/// [`Stopped::Interrupted`].
///
/// # Panics
/// If lengths do not agree.
pub fn standard_deviations(
    system: &System,
    deviation: Deviation,
    instants: &[f64],
    groups: &[Wrench],
    loads: &[f64],
    out: &mut StandardDeviations,
) -> Result<Option<()>, Stopped> {
    if system.model_level() != ModelLevel::Linear {
        return Ok(None);
    }
    let (count, width) = (instants.len(), 6 * groups.len());
    assert_eq!(loads.len(), count * width, "loads at every instant");
    let links: Vec<Axial> = (0..system.rows().len()).map(|i| link_load(system, i, Part::Total)).collect();
    let lengths = [&*out.acceleration, out.groups, out.sizes, out.links].map(<[f64]>::len);
    assert_eq!(lengths, [count, count * width, count * width / 3, count * links.len()], "room for all");
    let mut schedule = Schedule::new(system, deviation, instants);
    let mut covariance =
        Covariance::new(deviation.posterior.order(), deviation.derivative, deviation.start(system));
    let quantities = Quantities {
        groups: packed(groups),
        links: packed(&links),
        components: core::array::from_fn(|row| across(groups, row)),
    };
    let mut events = Vec::with_capacity(EVENTS_AT_A_TIME);
    loop {
        events.clear();
        events.extend(schedule.by_ref().take(EVENTS_AT_A_TIME));
        if events.is_empty() {
            return Ok(Some(()));
        }
        deviation.posterior.watch().check()?;
        let covariance = &mut covariance;
        dispatch!(follow(&events, covariance, &quantities, loads, out));
    }
}

/// Events that are prepared at a time.
const EVENTS_AT_A_TIME: usize = 64;

struct Quantities {
    /// Six rows of each group, one group after the other.
    groups: Vec<Rows>,
    links: Vec<Rows>,
    /// Each of the six components, of all groups.
    components: [Vec<Rows>; 6],
}

/// The rows of all quantities, one after the other.
fn packed<const ROWS: usize>(quantities: &[Recovery<ROWS>]) -> Vec<Rows> {
    pack(quantities.len() * ROWS, |row, entry| quantities[row / ROWS].linear.by_state[entry][row % ROWS])
}

/// One row of each group.
fn across(groups: &[Wrench], row: usize) -> Vec<Rows> {
    pack(groups.len(), |group, entry| groups[group].linear.by_state[entry][row])
}

fn pack(count: usize, of: impl Fn(usize, usize) -> f64) -> Vec<Rows> {
    let mut all = vec![[[0.0; LANES]; 12]; count.div_ceil(LANES)];
    for row in 0..count {
        for entry in 0..12 {
            all[row / LANES][entry][row % LANES] = of(row, entry);
        }
    }
    all
}

/// Follows events and writes the results at their instants.
#[inline(always)]
fn follow(
    events: &[Event],
    covariance: &mut Covariance,
    quantities: &Quantities,
    loads: &[f64],
    out: &mut StandardDeviations,
) {
    let (width, links) = (loads.len() / out.acceleration.len(), out.links.len() / out.acceleration.len());
    for step in events {
        covariance.follow(step);
        let &Event::Instant { index, at } = step else { continue };
        out.acceleration[index] = root(covariance.acceleration(at));
        let groups = index * width..(index + 1) * width;
        let z = &covariance.z;
        fill(z, &quantities.groups, &mut out.groups[groups.clone()]);
        fill(z, &quantities.links, &mut out.links[index * links..(index + 1) * links]);
        let sizes = &mut out.sizes[index * width / 3..(index + 1) * width / 3];
        fill_sizes(z, quantities, &loads[groups.clone()], &out.groups[groups], sizes);
    }
}

#[inline(always)]
fn fill(z: &[[f64; 12]; 12], rows: &[Rows], out: &mut [f64]) {
    for (rows, out) in rows.iter().zip(out.chunks_mut(LANES)) {
        let variances = variances(z, rows);
        for (out, variance) in out.iter_mut().zip(variances) {
            *out = root(variance);
        }
    }
}

/// Standard deviation of the magnitude of (Fy, Fz), and of the moment, along their directions. spread: of the components.
#[inline(always)]
fn fill_sizes(z: &[[f64; 12]; 12], quantities: &Quantities, loads: &[f64], spread: &[f64], out: &mut [f64]) {
    for (which, components) in [1..3, 3..6].into_iter().enumerate() {
        for (chunk, loads) in loads.chunks(6 * LANES).enumerate() {
            let mut size = [0.0; LANES];
            for (size, load) in size.iter_mut().zip(loads.as_chunks::<6>().0) {
                *size = norm(&load[components.clone()]);
            }
            let mut rows = [[0.0; LANES]; 12];
            for component in components.clone() {
                let mut share = [0.0; LANES];
                for (lane, load) in loads.as_chunks::<6>().0.iter().enumerate() {
                    share[lane] = if size[lane] > 0.0 { load[component] / size[lane] } else { 0.0 };
                }
                let of = &quantities.components[component][chunk];
                for (row, of) in rows.iter_mut().zip(of) {
                    for lane in 0..LANES {
                        row[lane] = fma(share[lane], of[lane], row[lane]);
                    }
                }
            }
            let along = variances(z, &rows);
            for lane in 0..loads.len() / 6 {
                let group = chunk * LANES + lane;
                let all = &spread[6 * group + components.start..6 * group + components.end];
                out[2 * group + which] = if size[lane] > 0.0 { root(along[lane]) } else { norm(all) };
            }
        }
    }
}

/// Variances of eight quantities: row z row^T.
#[inline(always)]
fn variances(z: &[[f64; 12]; 12], rows: &Rows) -> Lanes {
    let mut sum = [0.0; LANES];
    for i in 0..12 {
        let mut below = [0.0; LANES];
        for j in 0..i {
            add_scaled(&mut below, &rows[j], z[i][j]);
        }
        for lane in 0..LANES {
            sum[lane] = fma(rows[i][lane], fma(rows[i][lane], z[i][i], 2.0 * below[lane]), sum[lane]);
        }
    }
    sum
}

/// Square root of a variance, which rounding may have made negative.
#[inline(always)]
fn root(variance: f64) -> f64 {
    sqrt(f64::max(variance, 0.0))
}
