//! Tests of static equilibrium, on links without a body.

use super::*;
use crate::error::SceneError;

/// Xorshift64* (Vigna 2016).
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        low + (high - low) * bits as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self, count: usize) -> Vector6<f64> {
        Vector6::from_fn(|i, _| if i < count { self.between(-1.0, 1.0) } else { 0.0 })
    }

    fn law(&mut self, kinds: core::ops::Range<usize>) -> Law {
        let k = self.between(0.1, 1.0) * 1e8;
        let kind = self.between(kinds.start as f64, kinds.end as f64) as usize;
        let law = match kind {
            0 => Law::linear(k),
            1 => Law::sided(k, k, self.between(0.0, 2e-5)),
            2 => Law::sided(k, 0.3 * k, self.between(0.0, 2e-5)),
            3 => Law::curve(&[[-2e-5, -10.0 * k * 1e-5], [-1e-5, -k * 1e-5], [2e-5, 0.0], [3e-5, k * 1e-5]]),
            4 => Law::preloaded(k, self.between(10.0, 3e3), 1.5),
            _ => Law::preloaded(k, self.between(10.0, 3e3), 10.0 / 9.0),
        };
        law.expect("a law")
    }
}

type Spring = (Law, [f64; 6]);

/// Links (law, row) in the coordinates in which their nominal stiffness is the identity, and the way back.
fn scene(links: &[(Law, Vector6<f64>)], count: usize) -> Vec<Spring> {
    let mut stiffness = Matrix6::zeros();
    for (law, row) in links {
        stiffness += row * row.transpose() * law.nominal();
    }
    for i in count..6 {
        stiffness[(i, i)] = 1.0;
    }
    let lower = stiffness.cholesky().expect("a supported body").l();
    let c = |row: &Vector6<f64>| lower.solve_lower_triangular(row).expect("a supported body").into();
    links.iter().map(|(law, row)| (*law, c(row))).collect()
}

fn solve(springs: &[Spring], weight: [f64; 6], count: usize) -> Result<Equilibrium, [f64; 6]> {
    equilibrium(springs.iter().map(|(law, c)| (law, *c, 0.0)), &weight, count)
}

fn deflections(springs: &[Spring], y: &[f64; 6]) -> Vec<f64> {
    springs.iter().map(|(_, c)| Vector6::from(*c).dot(&Vector6::from(*y))).collect()
}

/// Force out of balance over the sum of the link forces.
fn unbalanced(springs: &[Spring], weight: [f64; 6], y: &[f64; 6]) -> f64 {
    let (mut missing, mut size) = (-Vector6::from(weight), 0.0);
    for ((law, c), d) in springs.iter().zip(deflections(springs, y)) {
        missing += Vector6::from(*c) * law.force(d);
        size += law.force(d).abs() * Vector6::from(*c).norm();
    }
    missing.norm() / size
}

fn random_scene(
    random: &mut Random,
    links: usize,
    count: usize,
    kinds: core::ops::Range<usize>,
) -> Vec<Spring> {
    let links: Vec<_> = (0..links).map(|_| (random.law(kinds.clone()), random.vector(count))).collect();
    scene(&links, count)
}

#[test]
fn a_body_on_links_with_clearance_sags_by_clearance_plus_weight_over_stiffness() {
    let (k, c) = (1.2e8, 5e-6);
    for (weight, sag) in [(1e4, c + 1e4 / k), (-1e4, -c - 2e4 / k), (0.0, 0.0)] {
        let springs = scene(&[(Law::sided(k, 0.5 * k, c).unwrap(), Vector6::x())], 1);
        let unit = springs[0].1[0];
        let rest = solve(&springs, [weight * unit, 0.0, 0.0, 0.0, 0.0, 0.0], 1).unwrap();
        assert!((rest.position[0] * unit - sag).abs() <= 4.0 * f64::EPSILON * sag.abs());
        assert_eq!(rest.loose_count, usize::from(weight == 0.0));
    }
}

#[test]
fn linear_links_carry_the_weight_at_rest() {
    let mut random = Random(5);
    let springs = random_scene(&mut random, 12, 6, 0..1);
    let weight = random.vector(6);
    let rest = solve(&springs, weight.into(), 6).unwrap();
    assert!((Vector6::from(rest.position) - weight).norm() <= 1e-14 * weight.norm());
    assert_eq!(rest.loose_count, 0);
}

#[test]
fn hundreds_of_scenes_balance_at_the_minimum_of_their_energy() {
    let mut random = Random(6);
    let mut worst = 0.0_f64;
    for round in 0..600 {
        let kinds = [1..4, 0..6, 4..6][round % 3].clone();
        let (count, links) = (1 + round % 6, 6 + round % 11);
        let springs = random_scene(&mut random, links, count, kinds);
        let weight: [f64; 6] = (random.vector(count) * random.between(0.1, 3.0)).into();
        let rest = solve(&springs, weight, count).unwrap();
        assert_eq!(solve(&springs, weight, count), Ok(rest));
        assert!(rest.position[count..].iter().all(|&y| y == 0.0));
        worst = worst.max(unbalanced(&springs, weight, &rest.position));

        let energy = |y: &[f64; 6]| -> f64 {
            let elastic: f64 =
                springs.iter().zip(deflections(&springs, y)).map(|((law, _), d)| law.energy(d)).sum();
            elastic - Vector6::from(weight).dot(&Vector6::from(*y))
        };
        let least = energy(&rest.position);
        for size in [1e-3, 0.1, 1.0] {
            let other = Vector6::from(rest.position) + random.vector(count) * size;
            assert!(energy(&other.into()) >= least - 1e-12 * least.abs());
        }
    }
    // Rounding of a deflection at the size of the clearance.
    assert!(worst <= 1e-13, "{worst:e}");
}

#[test]
fn of_all_equilibria_it_is_the_most_central() {
    let mut random = Random(7);
    let (mut free, mut tried) = (0, 0);
    for _ in 0..200 {
        let springs = random_scene(&mut random, 7, 6, 1..3);
        // Two links carry the weight, the others are within their clearance; sometimes more links are in contact.
        let weight =
            Vector6::from(springs[0].1) * 3e3 + Vector6::from(springs[1].1) * random.between(-3e3, 3e3);
        let rest = solve(&springs, weight.into(), 6).unwrap();
        free += usize::from(rest.loose_count > 0);
        let y = Vector6::from(rest.position);
        for direction in &rest.loose[..rest.loose_count] {
            for size in [-1e-3, -1e-5, 1e-5, 1e-3] {
                let other = y + Vector6::from(*direction) * (size * y.norm());
                if unbalanced(&springs, weight.into(), &other.into()) < 1e-12 {
                    tried += 1;
                    assert!(other.norm() >= y.norm() * (1.0 - 1e-12));
                }
            }
        }
    }
    assert!(free > 20 && tried > 100, "{free} {tried}");
}

#[test]
fn a_link_without_load_may_hold_the_nearest_position_at_its_edge() {
    let (k, c) = (1e8, 1e-5);
    let play = |clearance: f64| Law::sided(k, k, clearance).unwrap();
    let diagonal = Vector6::x() + Vector6::y();
    let springs = scene(&[(play(c), Vector6::x()), (play(c), Vector6::y()), (play(0.6 * c), diagonal)], 2);
    // The load moves x to 1.5 c. Centring springs alone would move y to -0.75 c; the diagonal link allows at most -0.9 c.
    let weight = Vector6::from(springs[0].1) * (0.5 * k * c);
    let rest = solve(&springs, weight.into(), 2).unwrap();
    for (got, want) in deflections(&springs, &rest.position).into_iter().zip([1.5, -0.9, 0.6]) {
        assert!((got - want * c).abs() <= 1e-13 * c, "{got} {want}");
    }
    assert!(unbalanced(&springs, weight.into(), &rest.position) <= 1e-14);
}

#[test]
fn free_motions_at_rest_are_those_within_clearances() {
    let (k, c) = (1e8, 1e-5);
    let (play, firm) = (Law::sided(k, k, c).unwrap(), Law::linear(k).unwrap());
    let springs = scene(&[(play, Vector6::x()), (play, Vector6::y()), (firm, Vector6::z())], 3);
    let along_x = Vector6::from(springs[0].1) * 1e3;
    let rest = solve(&springs, along_x.into(), 3).unwrap();
    assert_eq!((rest.loose_count, rest.position[1], rest.position[2]), (1, 0.0, 0.0));
    assert_eq!(rest.loose[0].map(f64::abs), [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let rest = solve(&springs, [0.0; 6], 3).unwrap();
    assert_eq!((rest.loose_count, rest.position), (2, [0.0; 6]));
}

#[test]
fn the_error_names_the_direction_of_an_unsupported_body() -> Result<(), SceneError> {
    let k = 1e8;
    let full = Law::curve(&[[-2e-5, -1e3], [-1e-5, -1e3], [1e-5, 1e3], [2e-5, 1e3]])?;
    let one_sided = Law::sided(k, 0.0, 1e-5)?;
    let firm = Law::linear(k)?;
    for (law, held, lost) in [(full, 0.999, 1.001), (full, -0.999_999, -1.000_001), (one_sided, 1e3, -1e-6)] {
        let springs = scene(&[(firm, Vector6::x()), (law, Vector6::y())], 2);
        let weight =
            |part: f64| Vector6::from(springs[0].1) * 5e2 + Vector6::from(springs[1].1) * (part * 1e3);
        assert!(
            unbalanced(
                &springs,
                weight(held).into(),
                &solve(&springs, weight(held).into(), 2).unwrap().position
            ) <= 1e-14
        );
        let leaves = solve(&springs, weight(lost).into(), 2).unwrap_err();
        assert!((leaves[1] - lost.signum()).abs() <= 1e-9 && leaves[0].abs() <= 1e-9, "{leaves:?}");
    }
    Ok(())
}

#[test]
fn soft_sides_and_wide_gaps_are_found() {
    let k = 1e8;
    for (soft, clearance) in [(1e-3, 0.0), (1e-6, 1e-6), (1e-9, 1e-5), (1.0, 1e-2), (1.0, 1.0), (1e-6, 1e-2)]
    {
        let law = Law::sided(k, soft * k, clearance).unwrap();
        let springs =
            scene(&[(law, Vector6::x()), (Law::linear(k).unwrap(), Vector6::x() + Vector6::y())], 2);
        for load in [-1e4, -1.0, 1e-3, 1e4] {
            let weight = Vector6::from(springs[0].1) * load;
            let rest = solve(&springs, weight.into(), 2).unwrap();
            let d = deflections(&springs, &rest.position)[0];
            let want = if load > 0.0 { clearance + load / k } else { load / (soft * k) - clearance };
            assert!((d - want).abs() <= 1e-13 * want.abs(), "{soft} {clearance} {load}: {d} {want}");
        }
    }
}

#[test]
fn overflow_is_an_error() {
    let springs = [(Law::linear(1e300).unwrap(), [1e300, 0.0, 0.0, 0.0, 0.0, 0.0])];
    assert!(solve(&springs, [1.0; 6], 1).is_err());
}

/// Links that push only, as many as coordinates: the weight is a sum of their rows in one way, and all factors must be positive.
#[test]
fn a_weight_is_borne_if_and_only_if_the_links_can_balance_it() {
    let k = 1e8;
    let push = Law::sided(k, 0.0, 0.0).unwrap();
    let mut random = Random(8);
    let (mut borne, mut lost) = (0, 0);
    for round in 0..400 {
        let count = 2 + round % 5;
        let soft = Law::sided(k * random.between(1e-3, 1.0), 0.0, random.between(0.0, 1e-5)).unwrap();
        let links: Vec<_> = (0..count).map(|i| ([push, soft][i % 2], random.vector(count))).collect();
        let springs = scene(&links, count);
        let share = |random: &mut Random| if random.between(0.0, 1.0) < 0.2 { -1.0 } else { 1.0 };
        let factors: Vec<f64> = (0..count).map(|_| share(&mut random) * random.between(0.01, 1.0)).collect();
        let mut weight = Vector6::zeros();
        for ((_, c), factor) in springs.iter().zip(&factors) {
            weight += Vector6::from(*c) * (factor * 1e3);
        }
        let found = solve(&springs, weight.into(), count);
        if factors.iter().all(|&factor| factor > 0.0) {
            borne += 1;
            let rest = found.expect("an equilibrium");
            assert!(unbalanced(&springs, weight.into(), &rest.position) <= 1e-9);
        } else {
            lost += 1;
            // The weight does work in the motion that is named, and no link resists it.
            let motion = Vector6::from(found.expect_err("no equilibrium"));
            assert!(motion.dot(&weight) > 0.0, "{motion}");
            for (_, c) in &springs {
                assert!(Vector6::from(*c).dot(&motion) <= 1e-6 * Vector6::from(*c).norm());
            }
        }
    }
    assert!(borne > 50 && lost > 50, "{borne} {lost}");
}
