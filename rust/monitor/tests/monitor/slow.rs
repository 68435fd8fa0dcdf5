//! A constant feed of any speed: counts come one by one, and what they seem to accelerate is no travel and no load.

use core::ops::ControlFlow;

use guideload::EquivalentLoad;
use guideload_monitor::{Exponent, Judgement, Monitor, Real, Settings, prepare};

use crate::common::{PERIOD, QUANTUM, full_rule, input, loads, system};

/// Steps of the encoder through which a smoother lays a straight line.
const STEPS: usize = 40;

/// Weights of the slope of the line, and of its value `lag` samples before the last one: the velocity less the last step.
fn line(lag: u32) -> Vec<[f64; 2]> {
    let middle = (STEPS - 1) as f64 / 2.0;
    let squares: f64 = (0..STEPS).map(|k| (k as f64 - middle).powi(2)).sum();
    let at = (STEPS - 1) as f64 + 0.5 - f64::from(lag) - middle;
    let mut sums = [0.0; 2];
    (0..STEPS - 1)
        .map(|k| {
            let slope = (k as f64 - middle) / squares;
            sums = [sums[0] - slope, sums[1] - 1.0 / STEPS as f64 - at * slope];
            sums
        })
        .collect()
}

/// Samples between which sums are taken.
const BETWEEN: [i64; 2] = [5_000, 105_000];

/// Travel of the positions (m) at the samples, and the power of the first carriage over that of its load at rest, m.
fn sums<T: Real>(position: impl Fn(i64) -> f64, lag: u32, rule: EquivalentLoad) -> [f64; 2] {
    let system = system();
    let judgement = Judgement { rule, limit: f64::INFINITY, bin: 500.0, capacity: 0.0 };
    let (taps, exponent) = (line(lag), Exponent::Ball);
    let settings = Settings { period: PERIOD, quantum: QUANTUM, input: input(), taps: &taps, lag, exponent };
    let loads = loads(&system).map(|load| (load, judgement));
    let prepared = prepare::<T, 10, 4, 64>(&system, &loads, &settings).expect("constants");
    let at_rest = rule.of(&prepared.carriages[0].rest.map(Real::to_f64)).powi(3);
    let mut monitor = Monitor::<T, 10, 4, 64>::NEW;
    let (mut number, mut sums) = (0, [0.0; 2]);
    let counts = (0..=BETWEEN[1]).map(|k| (position(k - 2_000) / QUANTUM + 1000.3).floor() as u32);
    let _ = monitor.push_many(&prepared, (0..).map(|k| 1000 * k).zip(counts), |monitor, _| {
        if let Some(end) = BETWEEN.iter().position(|&end| end == number) {
            let totals = monitor.totals();
            let found = [totals.distance.value(), totals.carriages[0].power.value() / at_rest];
            sums = if end == 0 { found } else { core::array::from_fn(|k| found[k] - sums[k]) };
        }
        number += 1;
        ControlFlow::Continue(())
    });
    sums
}

/// In f64 and f32, with a rule each.
fn all_sums(position: impl Fn(i64) -> f64, lag: u32) -> [f64; 4] {
    let double = sums::<f64>(&position, lag, EquivalentLoad::SUM_OF_FORCES);
    let [travel, power] = sums::<f32>(&position, lag, full_rule());
    [double[0], double[1], travel, power]
}

#[test]
fn travel_and_life_are_those_of_a_constant_feed() {
    for lag in [0, 5, 20] {
        for feed in [2e-5, 1e-4, 3.3e-4, 1e-3, 2e-3, 4.9e-3, 0.011, 0.02, 0.05] {
            let found = all_sums(|k| feed * PERIOD * k.max(0) as f64, lag);
            let travel = feed * PERIOD * (BETWEEN[1] - BETWEEN[0]) as f64;
            for one in found {
                assert!((one / travel - 1.0).abs() < 0.01, "lag {lag}, {feed} m/s: {found:?}, {travel}");
            }
        }
    }
}

#[test]
fn slow_movement_to_and_fro_costs_some_counts_in_a_turn() {
    let (feed, swing) = (1e-3, 1e-3);
    for lag in [0, 5, 20] {
        let there = |k: i64| feed * PERIOD * k.max(0) as f64;
        let found = all_sums(|k| swing - (there(k).rem_euclid(2.0 * swing) - swing).abs(), lag);
        let travel = feed * PERIOD * (BETWEEN[1] - BETWEEN[0]) as f64;
        for one in found {
            assert!((one - travel).abs() < 2.5 * QUANTUM * travel / swing, "lag {lag}: {found:?}, {travel}");
        }
    }
}
