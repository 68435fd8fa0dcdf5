//! Elastic laws: force, tangent and energy of each, and refused parameters.

use guideload::{Law, SceneError};

use crate::common::{BALL, ROLLER, Random, close};

/// A bent curve with a flat, a gap and a force at zero.
const BENT: [[f64; 2]; 6] =
    [[-3e-5, -9e3], [-2e-5, -3e3], [-1e-5, -3e3], [-2e-6, 1e2], [1e-5, 1e2], [2e-5, 4e3]];

fn laws() -> Vec<Law> {
    let mut laws = vec![
        Law::linear(3.5e8),
        Law::sided(3e8, 5e8, 0.0),
        Law::sided(3e8, 5e8, 5e-6),
        Law::sided(3e8, 3e8, 5e-6),
        Law::sided(3e8, 0.0, 5e-6),
        Law::sided(0.0, 3e8, 5e-6),
        Law::sided(0.0, 3e8, 0.0),
        Law::curve(&BENT),
        Law::curve(&BENT.map(|[d, load]| [d + 4e-5, load])),
        Law::curve(&[[-1e-5, -1e3], [1e-5, 2e3]]),
    ];
    for exponent in [BALL, ROLLER, 1.8, 2.0] {
        laws.push(Law::preloaded(5.39e8, 2.09e3, exponent));
    }
    laws.into_iter().map(|law| law.expect("a law")).collect()
}

/// Deflections on both sides of all edges, edges included, ascending.
fn deflections(law: &Law) -> Vec<f64> {
    let mut all: Vec<f64> = (-60..=60).map(|i| f64::from(i) * 1e-6).collect();
    all.extend_from_slice(law.edges());
    all.sort_by(f64::total_cmp);
    all
}

/// The integral of the force over an interval without edges inside: ten Gauss points.
fn integral(law: &Law, a: f64, b: f64) -> f64 {
    let nodes = [
        (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
        (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
        (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
        (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
        (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    ];
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    nodes.iter().map(|(x, w)| w * half * (law.force(middle - half * x) + law.force(middle + half * x))).sum()
}

#[test]
fn energy_is_the_integral_of_the_force() {
    for law in laws() {
        let all = deflections(&law);
        let scale = law.energy(6e-5) + law.energy(-6e-5);
        for pair in all.windows(2) {
            close(law.energy(pair[1]) - law.energy(pair[0]), integral(&law, pair[0], pair[1]), 1e-9, scale);
        }
        assert_eq!(law.energy(0.0), 0.0);
    }
    // Away from the edges, where the integrand is smooth, to rounding.
    for exponent in [BALL, ROLLER, 2.0] {
        let law = Law::preloaded(5.39e8, 2.09e3, exponent).unwrap();
        let d0 = law.edges()[1];
        for (a, b) in [
            (0.0, 0.3 * d0),
            (0.0, 1e-3 * d0),
            (0.45 * d0, 0.55 * d0),
            (d0, 2.0 * d0),
            (-4.0 * d0, -3.0 * d0),
        ] {
            close(law.energy(b) - law.energy(a), integral(&law, a, b), 1e-14, law.energy(a) + law.energy(b));
        }
    }
}

#[test]
fn tangent_is_the_slope_of_the_force_and_never_negative() {
    for law in laws() {
        for d in deflections(&law) {
            let (h, k) = (1e-10, law.tangent(d));
            assert!(k >= 0.0);
            // To the right, because an edge belongs to the segment on its right. Not at the edges of a preloaded law, where the slope
            // behaves like a square root.
            let (margin, bend) = if law.is_piecewise_linear() { (0.0, 1e-5) } else { (1e-7, 1e-4) };
            if law.edges().iter().any(|&edge| d + h >= edge - margin && d - margin < edge) {
                continue;
            }
            let slope = (law.force(d + h) - law.force(d)) / h;
            close(slope, k, bend, law.nominal());
        }
    }
}

#[test]
fn forces_never_fall_nor_jump() {
    for law in laws() {
        for pair in deflections(&law).windows(2) {
            assert!(law.force(pair[1]) >= law.force(pair[0]));
        }
        for &edge in law.edges() {
            let (below, above) = (law.force(edge.next_down()), law.force(edge.next_up()));
            close(above - below, 0.0, 1e-13, law.nominal() * 1e-6);
        }
    }
}

#[test]
fn segments_are_the_law() {
    for law in laws().into_iter().filter(Law::is_piecewise_linear) {
        for d in deflections(&law) {
            let segment = law.segment_of(d);
            assert_eq!(segment, law.edges().iter().filter(|&&edge| edge <= d).count());
            let (load, stiffness) = law.segment(segment);
            assert_eq!(stiffness, law.tangent(d));
            close(load + stiffness * d, law.force(d), 1e-14, load.abs() + (stiffness * d).abs());
        }
        let last = law.edges().len();
        assert_eq!(law.segment(last + 1), law.segment(last));
        // An edge is where the slope changes.
        for (i, _) in law.edges().iter().enumerate() {
            assert_ne!(law.segment(i).1, law.segment(i + 1).1);
        }
        let steepest = (0..=last).map(|i| law.segment(i).1).fold(0.0, f64::max);
        assert_eq!(law.nominal(), steepest);
    }
}

#[test]
fn a_law_with_clearance_agrees_with_its_formula() {
    let (k, l, c) = (3e8, 5e8, 5e-6);
    let law = Law::sided(k, l, c).unwrap();
    assert_eq!((law.kind(), law.edges(), law.segment(1)), ("sided", [-c, c].as_slice(), (0.0, 0.0)));
    assert_eq!([-c, 0.0, c].map(|d| law.force(d)), [0.0; 3]);
    close(law.force(2e-5), k * 1.5e-5, 1e-15, k * 1.5e-5);
    close(law.force(-2e-5), -l * 1.5e-5, 1e-15, l * 1.5e-5);
    assert_eq!([-2e-5, -c, 0.0, c].map(|d| law.tangent(d)), [l, 0.0, 0.0, k]);
    assert_eq!(Law::sided(k, l, 0.0).unwrap().edges(), [0.0]);
    assert_eq!(Law::sided(k, 0.0, c).unwrap().edges(), [c]);
    assert_eq!(Law::sided(0.0, l, c).unwrap().edges(), [-c]);
    assert_eq!(Law::sided(k, k, 0.0), Law::linear(k));
}

#[test]
fn symmetric_laws_are_odd_to_the_bit() {
    let odd = [
        Law::linear(1e8),
        Law::sided(1e8, 1e8, 5e-6),
        Law::preloaded(5.39e8, 2.09e3, BALL),
        Law::preloaded(5.39e8, 2.09e3, ROLLER),
        Law::curve(&[[-2e-5, -9e3], [-1e-5, -1e3], [0.0, 0.0], [1e-5, 1e3], [2e-5, 9e3]]),
    ];
    for law in odd.map(|law| law.expect("a law")) {
        let mut random = Random::new(3);
        for _ in 0..1000 {
            let d = random.between(0.0, 5e-5);
            assert_eq!(law.force(-d), -law.force(d));
            assert_eq!(law.energy(-d), law.energy(d));
        }
        assert_eq!(law.force(0.0), 0.0);
    }
}

#[test]
fn a_preloaded_carriage_opens_at_the_load_in_catalogues() {
    for (exponent, d0, times) in [(BALL, 11.633e-6, 2.8284), (ROLLER, 8.617e-6, 2.1601)] {
        let (k0, preload) = (5.39e8, 2.09e3);
        let law = Law::preloaded(k0, preload, exponent).unwrap();
        assert_eq!((law.kind(), law.nominal(), law.is_piecewise_linear()), ("preloaded", k0, false));
        let opening = law.edges()[1];
        assert_eq!(law.edges(), [-opening, opening]);
        close(opening, d0, 1e-4, d0);
        close(law.tangent(0.0), k0, 1e-15, k0);
        close(law.force(opening) / preload, times, 1e-4, times);
        close(law.tangent(opening), 0.5 * k0 * 2.0_f64.powf(exponent - 1.0), 1e-15, k0);
    }
    let ball = Law::preloaded(5.39e8, 2.09e3, BALL).unwrap();
    close(ball.force(ball.edges()[1]), 5.9e3, 5e-3, 5.9e3);
    close(ball.tangent(ball.edges()[1]), 381e6, 1e-3, 381e6);
}

/// `2 Σ (n over j) x^j` over odd j, or `2 Σ (m over j) x^j` over even j > 0.
fn binomial(power: f64, first: usize, x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 0.0);
    for j in 1..60 {
        term *= (power - (j - 1) as f64) / j as f64 * x;
        if j % 2 == first % 2 {
            sum += 2.0 * term;
        }
    }
    sum
}

#[test]
fn small_deflections_of_preloaded_laws_keep_their_digits() {
    for exponent in [BALL, ROLLER, 1.3, 2.0] {
        let (k0, preload) = (5.39e8, 2.09e3);
        let law = Law::preloaded(k0, preload, exponent).unwrap();
        let d0 = law.edges()[1];
        for x in [1e-300, 1e-12, 1e-8, 1e-5, 1e-3, 0.03, 0.1, 0.3, 0.49] {
            let (d, n) = (x * d0, exponent);
            let force = preload * binomial(n, 1, x);
            close(law.force(d), force, 8.0 * f64::EPSILON, force);
            let energy = preload * d0 / (n + 1.0) * binomial(n + 1.0, 2, x);
            close(law.energy(d), energy, 16.0 * f64::EPSILON, energy);
        }
    }
}

#[test]
fn balls_by_roots_and_balls_by_powers_are_the_same() {
    let (k0, preload) = (5.39e8, 2.09e3);
    let balls = Law::preloaded(k0, preload, BALL).unwrap();
    let nearly = Law::preloaded(k0, preload, BALL.next_up()).unwrap();
    for d in deflections(&balls) {
        close(balls.force(d), nearly.force(d), 1e-14, balls.force(d).abs());
        close(balls.energy(d), nearly.energy(d), 1e-14, balls.energy(d));
        // The second derivative is unbounded at the edge.
        close(balls.tangent(d), nearly.tangent(d), 1e-7, k0);
    }
}

#[test]
fn preloads_of_any_size_work() {
    for preload in [1e-12, 1e-3, 1e12] {
        for exponent in [BALL, ROLLER] {
            let law = Law::preloaded(5.39e8, preload, exponent).unwrap();
            for d in [1e-9, 1e-5, 1.0] {
                assert!(law.force(d) > 0.0 && law.force(d).is_finite());
                assert!(law.energy(d) > 0.0 && law.tangent(d) > 0.0);
                assert!(law.energy(d) <= d * law.force(d));
            }
        }
    }
    assert!(matches!(Law::preloaded(5.39e8, 1e-306, BALL), Err(SceneError::OutOfRange { .. })));
}

#[test]
fn scaled_laws_have_the_same_edges_and_scaled_forces() {
    for law in laws() {
        let half = law.scaled(0.5).unwrap();
        assert_eq!((half.edges(), half.kind()), (law.edges(), law.kind()));
        let third = law.scaled(1.0 / 3.0).unwrap();
        for d in deflections(&law) {
            assert_eq!(
                [half.force(d), half.tangent(d), half.energy(d)],
                [law.force(d), law.tangent(d), law.energy(d)].map(|x| 0.5 * x)
            );
            close(third.force(d), law.force(d) / 3.0, 1e-14, law.nominal() * d.abs() + law.force(d).abs());
        }
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e301, 1e-320] {
            assert!(matches!(law.scaled(factor), Err(SceneError::Factor { .. })), "{law:?} {factor}");
        }
    }
    assert_eq!(Law::linear(0.0).unwrap().scaled(2.0), Law::linear(0.0));
}

#[test]
fn a_curve_passes_through_its_points_and_continues_with_the_end_slopes() {
    let law = Law::curve(&BENT).unwrap();
    assert_eq!(law.kind(), "curve");
    assert_eq!(law.edges(), BENT[1..5].iter().map(|[d, _]| *d).collect::<Vec<_>>());
    for [d, load] in BENT {
        close(law.force(d), load, 1e-14, load.abs());
    }
    close(law.force(-4e-5), -1.5e4, 1e-14, 1.5e4);
    close(law.force(3e-5), 7.9e3, 1e-14, 7.9e3);
    close(law.force(0.0), 1e2, 0.0, 1.0);
}

#[test]
fn points_on_a_line_are_no_edges() {
    let straight: Vec<_> = (-7..=7).map(|i| [f64::from(i) * 1.3e-6, f64::from(i) * 1.3e-6 * 7.7e8]).collect();
    let law = Law::curve(&straight).unwrap();
    assert!(law.is_linear());
    close(law.nominal(), 7.7e8, 1e-14, 7.7e8);
    // An odd curve with a point in the middle of its gap.
    let law = Law::curve(&[[-2e-5, -9e3], [-1e-5, 0.0], [0.0, 0.0], [1e-5, 0.0], [2e-5, 9e3]]).unwrap();
    assert_eq!((law.edges(), law.segment(1)), ([-1e-5, 1e-5].as_slice(), (0.0, 0.0)));
    let offset = Law::curve(&[[0.0, 5.0], [1e-5, 1e3]]).unwrap();
    assert_eq!((offset.kind(), offset.edges().len(), offset.force(0.0)), ("curve", 0, 5.0));
    assert!(!offset.is_linear());
}

#[test]
fn invalid_laws_are_refused_with_their_numbers() {
    let many: Vec<_> = (0..17).map(|i| [f64::from(i), f64::from(i * i)]).collect();
    let refused = [
        (Law::linear(-1.0), "stiffness: expected >= 0 N/m, got -1"),
        (Law::sided(0.0, 0.0, 1e-6), "got positive 0, negative 0"),
        (Law::sided(1e8, -2.0, 0.0), "got positive 100000000, negative -2"),
        (Law::sided(1e8, 1e8, -0.5), "clearance: expected >= 0 m to either side, got -0.5"),
        (Law::sided(1e8, 1e8, f64::NAN), "clearance"),
        (Law::preloaded(0.0, 1.0, BALL), "stiffness: expected > 0 N/m beside a preload"),
        (Law::preloaded(1e8, 0.0, BALL), "preload: expected > 0 N, got 0"),
        (Law::preloaded(1e8, 1.0, 1.0), "exponent: expected > 1 and <= 2, got 1"),
        (Law::preloaded(1e8, 1.0, 2.5), "balls have 3/2, rollers 10/9"),
        (
            Law::preloaded(1e8, 1e-310, BALL),
            "law: preload over stiffness is too large or too small: check the units",
        ),
        (Law::curve(&[[0.0, 0.0]]), "curve: expected 2 to 16 points, got 1"),
        (Law::curve(&many), "got 17; it is linear in between"),
        (Law::curve(&[[0.0, 0.0], [1.0, f64::NAN]]), "curve: expected finite numbers"),
        (Law::curve(&[[0.0, 0.0], [1.0, 1.0], [1.0, 2.0]]), "curve[2]: expected a deflection > 1 m"),
        (Law::curve(&[[0.0, 0.0], [1.0, -1.0]]), "curve[1]: expected a force >= 0 N"),
        (Law::curve(&[[0.0, 3.0], [1.0, 3.0]]), "got 3 N at all points"),
        (Law::curve(&[[0.0, 0.0], [1e-300, 1e300]]), "curve: its slope is too large or too small"),
        (Law::curve(&[[-1e308, 0.0], [1e308, 1e300]]), "curve: its slope is too large or too small"),
    ];
    for (law, words) in refused {
        let message = law.expect_err(words).to_string();
        assert!(message.contains(words), "{message}");
    }
    assert!(Law::linear(0.0).is_ok() && Law::curve(&many[..16]).is_ok());
}
