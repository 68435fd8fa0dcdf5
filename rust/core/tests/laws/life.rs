//! Integrals of equivalent loads over the travel are exact for loads and accelerations linear in time.

use guideload::{EquivalentLoad, Interval, Law, LoadPower, Preload};

use crate::common::{Random, close, rules};

/// Midpoint rule; kinks of the integrand cost it 1/CELLS² of its value, and the jump of a few percent at which the effect of a preload by
/// Rexroth's formula begins, that jump over CELLS.
const CELLS: usize = 40_000;
const AT_KINKS: f64 = 1e-8;
const AT_JUMPS: f64 = 0.1 / CELLS as f64;

/// `∫ P^p |v| dt` and `∫ |v| dt` by their definition.
fn by_cells(rule: &EquivalentLoad, exponent: f64, travel: &Interval, loads: [&[f64; 5]; 2]) -> [f64; 2] {
    let Interval { length, velocity: [v0, v1], acceleration: [a0, a1] } = *travel;
    let (mut power, mut path) = (0.0, 0.0);
    for cell in 0..CELLS {
        let s = (cell as f64 + 0.5) / CELLS as f64;
        let load: [f64; 5] = std::array::from_fn(|j| (1.0 - s) * loads[0][j] + s * loads[1][j]);
        // The integral of an acceleration linear in time that ends at v1.
        let speed = (v0 + s * (v1 - v0) - 0.5 * length * (a1 - a0) * s * (1.0 - s)).abs();
        power += rule.of(&load).powf(exponent) * speed;
        path += speed;
    }
    [power, path].map(|sum| sum * length / CELLS as f64)
}

#[test]
fn integrals_agree_with_their_definition() {
    let mut random = Random::new(1);
    for rule in rules() {
        for exponent in [3.0, 10.0 / 3.0, 1.0, 2.7, 5.0] {
            for size in [10.0, 1e3, 4e3] {
                let mut pair = |size: f64| [random.between(-size, size), random.between(-size, size)];
                let travel = Interval { length: 0.7, velocity: pair(1.0), acceleration: pair(8.0) };
                let components: [[f64; 2]; 5] =
                    std::array::from_fn(|j| pair(if j < 2 { size } else { 0.2 * size }));
                let [first, last] = [0, 1].map(|end| components.map(|ends| ends[end]));
                let found = rule.integrals(exponent, &travel, [&first, &last]);
                let [power, path] = by_cells(&rule, exponent, &travel, [&first, &last]);
                let jumps = matches!(rule.preload, Preload::Power(_));
                close(found.power, power, if jumps { AT_JUMPS } else { AT_KINKS }, power);
                close(found.path, path, AT_KINKS, path);
                assert_eq!(found.path, travel.path());
            }
        }
    }
}

#[test]
fn powers_have_exponents_from_1_to_100() {
    for exponent in [1.0, 3.0, 99.5, 100.0] {
        assert!(LoadPower::new(exponent).is_some(), "{exponent}");
        // Of a load from 1 to 2 N at 1 m/s.
        let travel = Interval { length: 1.0, velocity: [1.0; 2], acceleration: [0.0; 2] };
        let ends = [&[1.0, 0.0, 0.0, 0.0, 0.0], &[2.0, 0.0, 0.0, 0.0, 0.0]];
        let found = EquivalentLoad::SUM_OF_FORCES.integrals(exponent, &travel, ends).power;
        let expected = (2.0_f64.powf(exponent + 1.0) - 1.0) / (exponent + 1.0);
        assert!((found / expected - 1.0).abs() < 1e-12, "{exponent}: {found} {expected}");
    }
    for exponent in [f64::NAN, f64::INFINITY, -1.0, 0.9, 100.5, 1e9] {
        assert!(LoadPower::new(exponent).is_none(), "{exponent}");
    }
}

/// On a load without sign changes the whole interval and its parts agree to rounding, for small and large changes of the load.
#[test]
fn integrals_add_up_over_parts_of_an_interval() {
    let mut random = Random::new(2);
    for exponent in [3.0, 10.0 / 3.0, 2.7, 8.0] {
        for change in [0.0, 1e-6, 0.1, 0.9, 1.1, 30.0] {
            let [v0, a0, jerk] = [1.5, 0.4, random.between(-1.0, 1.0)];
            let velocity = |t: f64| v0 + t * (a0 + 0.5 * jerk * t);
            let load = |t: f64| [1e3 * (1.0 + change * t), 0.0, 0.0, 0.0, 0.0];
            let over = |from: f64, to: f64| {
                let travel = Interval {
                    length: to - from,
                    velocity: [velocity(from), velocity(to)],
                    acceleration: [from, to].map(|t| a0 + jerk * t),
                };
                rules()[0].integrals(exponent, &travel, [&load(from), &load(to)]).power
            };
            let parts: f64 = (0..64).map(|k| over(k as f64 / 64.0, (k + 1) as f64 / 64.0)).sum();
            close(over(0.0, 1.0), parts, 2e-14, parts);
        }
    }
}

/// The effect of preloaded rows on P is the load of the row that their elastic law loads, at any deflection.
#[test]
fn rows_carry_what_their_elastic_law_says() {
    let preload = 2090.0;
    for (exponent, rows) in [(1.5, Preload::Balls(preload)), (10.0 / 9.0, Preload::Rollers(preload))] {
        let law = Law::preloaded(539e6, preload, exponent).unwrap();
        let opening = 2.0 * exponent * preload / 539e6;
        let rule = EquivalentLoad { preload: rows, ..EquivalentLoad::SUM_OF_FORCES }.rule();
        close(rule.opening, law.force(opening), 1e-14, preload);
        for k in 0..=3000 {
            let share = f64::from(k) / 1000.0;
            for share in [share, share + 1e-7, f64::max(share - 1e-12, 0.0)] {
                let row = preload * (1.0 + share).powf(exponent);
                let other = preload * f64::max(1.0 - share, 0.0).powf(exponent);
                close(rule.with_preload(law.force(share * opening)), row, 1e-13, row);
                close(rule.with_preload(row - other), row, 1e-13, row);
            }
        }
    }
}

/// Integrals under preloaded rows are those of their parts, also towards and across the opening, where the row load is not smooth.
#[test]
fn integrals_under_preloaded_rows_add_up() {
    for (exponent, rows) in [(3.0, Preload::Balls(900.0)), (10.0 / 3.0, Preload::Rollers(900.0))] {
        let rule = EquivalentLoad { preload: rows, ..EquivalentLoad::SUM_OF_FORCES };
        let opening = rule.preload.opening();
        for [first, last] in
            [[0.0, 0.014], [0.0, 0.9], [0.3, 1.0], [0.999, 0.2], [0.9, 1.1], [1.5, -0.1], [1.0, 2.0]]
        {
            let over = |from: f64, to: f64| {
                let speed = |t: f64| 1.5 + t * (0.4 - 0.3 * t);
                let travel = Interval {
                    length: to - from,
                    velocity: [speed(from), speed(to)],
                    acceleration: [from, to].map(|t| 0.4 - 0.6 * t),
                };
                let load = |t: f64| [opening * (first + (last - first) * t), 0.0, 0.0, 0.0, 0.0];
                rule.integrals(exponent, &travel, [&load(from), &load(to)]).power
            };
            let parts: f64 = (0..4096).map(|k| over(f64::from(k) / 4096.0, f64::from(k + 1) / 4096.0)).sum();
            close(over(0.0, 1.0), parts, 1e-11, parts);
        }
    }
}
