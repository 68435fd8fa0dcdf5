//! A machine of four carriages, its motion, and its constants.

use guideload::{
    Body, EquivalentLoad, Free, Link, Part, Preload, Scene, System, Wrench, carriage_links, group_load,
};
use guideload_monitor::{Exponent, InputSettings, Judgement, Monitor, Prepared, Real, Settings, prepare};
use nalgebra::{Matrix3, Vector3};

pub const PERIOD: f64 = 1e-3;
/// m per count.
pub const QUANTUM: f64 = 2e-5;
pub const LAG: u32 = 20;
pub const TAPS: usize = 39;

/// Places: state, carriages, second differences.
pub type Constants<T> = Prepared<T, 10, 4, 64>;
pub type TestMonitor<T> = Monitor<T, 10, 4, 64>;

/// Limit of the equivalent load, N.
pub const LIMIT: f64 = 4000.0;

pub fn system() -> System {
    let inertia = Matrix3::new(440.0, 15.0, -8.0, 15.0, 420.0, 22.0, -8.0, 22.0, 400.0);
    let body = Body::new(1250.0, Vector3::new(0.08, -0.45, 0.09), inertia).expect("a body");
    let links: Vec<Link> = centers()
        .into_iter()
        .flat_map(|center| carriage_links(center, 0.12, [55e6, 50e6], [10.4e3, 3.1e3]).expect("links"))
        .collect();
    let gravity = Vector3::new(0.0, -9.80665, 0.0);
    System::new(&Scene::new(body, &links, gravity, Free::GUIDED).expect("a scene")).expect("a system")
}

fn centers() -> [Vector3<f64>; 4] {
    [[-0.6, -0.55], [0.6, -0.55], [-0.6, 0.55], [0.6, 0.55]].map(|[x, z]| Vector3::new(x, -0.05, z))
}

pub fn loads(system: &System) -> [Wrench<'_>; 4] {
    let centers = centers();
    [0, 1, 2, 3].map(|k| group_load(system, 4 * k..4 * k + 4, centers[k], Part::Total))
}

/// A rule in which every component counts, with a smaller group and a preload.
pub fn full_rule() -> EquivalentLoad {
    let mut weights = [[[0.0; 2]; 5]; 2];
    weights[0] = [[1.0, 1.2], [0.0; 2], [8.0, 9.0], [0.0; 2], [6.0, 6.0]];
    weights[1] = [[0.0; 2], [1.1, 0.9], [0.0; 2], [7.0, 5.0], [0.0; 2]];
    EquivalentLoad { weights, minor: 0.6, preload: Preload::Power(900.0) }
}

pub fn input() -> InputSettings {
    InputSettings {
        ticks: 1000,
        tolerance: 50,
        counter_bits: 24,
        most_change: (50.0 * PERIOD * PERIOD / QUANTUM * 16.0) as i32,
        slack: 48,
        still: 16,
        most_missing: 10,
    }
}

/// Weights of a parabola of acceleration, and of the velocity at the same instant.
fn taps() -> [[f64; 2]; TAPS] {
    let mut taps = [[0.0; 2]; TAPS];
    let middle = (TAPS - 1) as f64 / 2.0;
    for (k, tap) in taps.iter_mut().enumerate() {
        let x = (k as f64 - middle) / (middle + 1.0);
        tap[0] = (1.0 - x * x) * (1.0 - x * x);
    }
    let sum: f64 = taps.iter().map(|tap| tap[0]).sum();
    for (k, tap) in taps.iter_mut().enumerate() {
        tap[0] /= sum;
        // The velocity in the middle is the last step less half of the change in the middle and all changes after it.
        let after = k as f64 - middle;
        tap[1] = if after > 0.0 {
            -1.0
        } else if after == 0.0 {
            -0.5
        } else {
            0.0
        };
    }
    taps
}

pub fn constants<T: Real>(system: &System, rule: EquivalentLoad, exponent: Exponent) -> Constants<T> {
    constants_in_places(system, rule, exponent)
}

/// The same for any places.
pub fn constants_in_places<T: Real, const S: usize, const C: usize, const N: usize>(
    system: &System,
    rule: EquivalentLoad,
    exponent: Exponent,
) -> Prepared<T, S, C, N> {
    let judgement = Judgement { rule, limit: LIMIT, bin: 500.0, capacity: 1e18 };
    let loads = loads(system).map(|load| (load, judgement));
    let taps = taps();
    let settings =
        Settings { period: PERIOD, quantum: QUANTUM, input: input(), taps: &taps, lag: LAG, exponent };
    prepare(system, &loads, &settings).expect("constants")
}

/// Acceleration, velocity and position of the axis at `count` periods: to and fro with a jerk that jumps.
pub fn motion(count: usize) -> Vec<[f64; 3]> {
    let mut states = vec![[0.0; 3]];
    let mut acceleration: f64 = 0.0;
    for k in 1..count {
        // m/s²: up and down within 20 ms, with dwells.
        let target = [0.0, 4.0, 4.0, 0.0, -4.0, -4.0, 0.0, 0.0, -3.0, 0.0, 3.0, 0.0][k / 150 % 12];
        acceleration += (target - acceleration).clamp(-0.2, 0.2);
        let [before, velocity, position] = states[k - 1];
        let position = position + PERIOD * velocity + PERIOD * PERIOD * (2.0 * before + acceleration) / 6.0;
        states.push([acceleration, velocity + PERIOD * (before + acceleration) / 2.0, position]);
    }
    states
}

/// The counter, of 24 bits, and of any start, at each period.
pub fn counts(motion: &[[f64; 3]], start: i64) -> Vec<u32> {
    motion.iter().map(|[.., x]| ((start + (x / QUANTUM).round() as i64) & 0xFF_FFFF) as u32).collect()
}
