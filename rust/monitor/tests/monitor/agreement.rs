//! The monitor agrees with a run of the core, given the same acceleration.

use guideload::{Control, EquivalentLoad, Exact, Excitation, Interval, Output, Preload, State, System, run};
use guideload_monitor::{Exponent, Motion, Real};

use crate::common::{PERIOD, TestMonitor, constants, full_rule, loads, motion, system};

/// Loads of a run at each period.
fn offline(system: &System, motion: &[[f64; 3]]) -> Vec<[[f64; 5]; 4]> {
    let samples: Vec<_> = motion.iter().map(|[a, ..]| [*a, 0.0, 0.0]).collect();
    let excitation = Excitation::uniform(0.0, PERIOD, &samples).expect("an excitation");
    let mut states = Vec::<State>::new();
    let control = Control::Adaptive { rtol: 1e-6 };
    run(system, &Exact, control, &excitation, Output::Samples, &mut states).expect("a run");
    let loads = loads(system);
    states
        .iter()
        .map(|state| {
            loads.each_ref().map(|load| load.at(state, &[0.0; 9]).last_chunk().copied().expect("five"))
        })
        .collect()
}

fn largest_deviation<T: Real>(rule: EquivalentLoad, exponent: Exponent) -> (f64, f64) {
    let (system, motion) = (system(), motion(6000));
    let offline = offline(&system, &motion);
    let prepared = constants::<T>(&system, rule, exponent);
    let mut monitor = TestMonitor::<T>::NEW;
    let (mut power, mut path) = ([0.0; 4], 0.0);
    let (mut deviation, mut scale) = (0.0_f64, 0.0_f64);
    for (k, ([a, v, _], expected)) in motion.iter().zip(&offline).enumerate() {
        let at = Motion { velocity: T::from_f64(*v), acceleration: T::from_f64(*a) };
        monitor.push_motion(&prepared, at);
        for (load, expected) in monitor.loads().iter().flatten().zip(expected.iter().flatten()) {
            deviation = deviation.max((load.to_f64() - expected).abs());
            scale = scale.max(expected.abs());
        }
        if k > 0 {
            let ends = [motion[k - 1], motion[k]];
            let interval =
                Interval { length: PERIOD, velocity: ends.map(|m| m[1]), acceleration: ends.map(|m| m[0]) };
            path += interval.path();
            for (carriage, power) in power.iter_mut().enumerate() {
                let ends = [&offline[k - 1][carriage], &offline[k][carriage]];
                *power += rule.integrals(exponent.value(), &interval, ends).power;
            }
        }
    }
    let totals = monitor.totals();
    let mut of_sums = (totals.distance.value() / path - 1.0).abs();
    for (carriage, power) in totals.carriages.iter().zip(power) {
        of_sums = of_sums.max((carriage.power.value() / power - 1.0).abs());
    }
    (deviation / scale, of_sums)
}

/// The effects of a preload of 900 N, for balls or rollers.
fn preloads(exponent: Exponent) -> [Preload; 3] {
    let rows = if exponent == Exponent::Ball { Preload::Balls(900.0) } else { Preload::Rollers(900.0) };
    [Preload::Power(900.0), Preload::Linear(900.0), rows]
}

#[test]
fn loads_and_sums_are_those_of_a_run() {
    let (loads, sums) = largest_deviation::<f64>(EquivalentLoad::SUM_OF_FORCES, Exponent::Ball);
    assert!(loads < 1e-12, "{loads:e}");
    assert!(sums < 1e-12, "{sums:e}");
}

#[test]
fn loads_and_sums_agree_for_every_branch_of_a_rule_and_both_exponents() {
    for exponent in [Exponent::Ball, Exponent::Roller] {
        for preload in preloads(exponent) {
            let (loads, sums) = largest_deviation::<f64>(EquivalentLoad { preload, ..full_rule() }, exponent);
            assert!(loads < 1e-12, "{loads:e}");
            // Powers that are no polynomials are integrated with five nodes.
            assert!(sums < 1e-9, "{exponent:?} {preload:?}: {sums:e}");
        }
    }
    let (_, sums) = largest_deviation::<f64>(EquivalentLoad::SUM_OF_FORCES, Exponent::Roller);
    assert!(sums < 1e-9, "{sums:e}");
}

#[test]
fn single_precision_agrees_to_its_digits() {
    for exponent in [Exponent::Ball, Exponent::Roller] {
        for preload in preloads(exponent) {
            let (loads, sums) = largest_deviation::<f32>(EquivalentLoad { preload, ..full_rule() }, exponent);
            assert!(loads < 1e-5, "{loads:e}");
            assert!(sums < 1e-5, "{sums:e}");
        }
    }
}

#[test]
fn extremes_and_histogram_are_those_of_the_loads() {
    let (system, motion) = (system(), motion(6000));
    let offline = offline(&system, &motion);
    let rule = full_rule();
    let prepared = constants::<f64>(&system, rule, Exponent::Ball);
    let mut monitor = TestMonitor::<f64>::NEW;
    for [a, v, _] in &motion {
        monitor.push_motion(&prepared, Motion { velocity: *v, acceleration: *a });
    }
    for (carriage, totals) in monitor.totals().carriages.iter().enumerate() {
        let equivalent: Vec<f64> = offline.iter().map(|loads| rule.of(&loads[carriage])).collect();
        let largest = equivalent.iter().copied().fold(0.0, f64::max);
        let at = equivalent.iter().position(|&load| load == largest).expect("a place");
        assert!((totals.largest[6] / largest - 1.0).abs() < 1e-12);
        assert_eq!(totals.period_of_largest[6], at as u64);
        let above = equivalent.iter().filter(|&&load| load > crate::common::LIMIT).count();
        let rises = equivalent.windows(2).filter(|w| w[0] <= 4000.0 && w[1] > 4000.0).count();
        let first = usize::from(equivalent[0] > 4000.0);
        assert_eq!((totals.above_limit, totals.limit_exceeded), (above as u64, (rises + first) as u64));
        for (bin, &periods) in totals.histogram.iter().enumerate() {
            let low = 500.0 * bin as f64;
            let high = if bin == 15 { f64::INFINITY } else { low + 500.0 };
            let count = equivalent.iter().filter(|&&load| load >= low && load < high).count();
            assert_eq!(periods, count as u64, "bin {bin}");
        }
        assert_eq!(totals.histogram.iter().sum::<u64>(), 6000);
    }
}
