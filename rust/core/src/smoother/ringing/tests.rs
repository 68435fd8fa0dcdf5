//! Laws of the transition of an axis that rings.

use super::*;
use nalgebra::DMatrix;

const DAMPINGS: [f64; 6] = [0.0, 0.05, 0.7, 1.0, 1.5, 5.0];
const ANGLES: [f64; 8] = [1e-3, 0.06, 0.5, 1.2, 1.9, 2.1, 12.0, 40.0];

/// Order of the derivative that entry i of the state is.
fn derivative(i: usize, a: usize) -> i32 {
    if i < a + 2 { i as i32 } else { i as i32 - 2 }
}

/// Phi by Taylor's series of a small step, squared; w = 1.
fn exponential<const N: usize>(damping: f64, a: usize, angle: f64) -> DMatrix<f64> {
    let mut generator = DMatrix::zeros(N, N);
    for i in (0..N - 1).filter(|&i| i != a + 1) {
        generator[(i, i + 1)] = 1.0;
    }
    for (j, sign) in [(a, -1.0), (a + 2, 1.0)] {
        generator[(a, j)] += sign * 2.0 * damping;
        generator[(a + 1, j)] = sign;
    }
    let squarings = 2 + (angle * (1.0 + damping)).log2().max(0.0) as i32;
    let (mut term, mut sum) = (DMatrix::identity(N, N), DMatrix::identity(N, N));
    for k in 1..20 {
        term = &term * &generator * (angle * 0.5f64.powi(squarings) / f64::from(k));
        sum += &term;
    }
    for _ in 0..squarings {
        sum = &sum * &sum;
    }
    sum
}

fn set<const N: usize>(frequency: f64, damping: f64, acceleration: usize, step: f64) -> Ringing<N> {
    let mut ringing = Ringing::new(Some(Oscillator { frequency, damping, acceleration }));
    ringing.set(step);
    ringing
}

fn is_the_exponential<const N: usize>() {
    for (damping, angle) in DAMPINGS.into_iter().flat_map(|damping| ANGLES.map(|angle| (damping, angle))) {
        for a in 0..N - 2 {
            let wanted = exponential::<N>(damping, a, angle);
            for w in [1e-3f64, 1.0, 300.0] {
                let ringing = set::<N>(w, damping, a, angle / w);
                for i in 0..N {
                    for j in 0..N {
                        let unit = w.powi(derivative(j, a) - derivative(i, a));
                        let (found, wanted) = (ringing.entry(i, j) * unit, wanted[(i, j)]);
                        // Beyond one radian an entry may be the small difference of larger ones.
                        let size = wanted.abs() + if angle * (1.0 + damping) > 1.0 { 1.0 } else { 0.0 };
                        assert!(
                            (found - wanted).abs() <= 1e-12 * size,
                            "D {damping}, w {w}, angle {angle}, {i} of {j} (a {a} of {N}): {found} for {wanted}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn the_transition_is_the_exponential_of_the_generator() {
    is_the_exponential::<4>();
    is_the_exponential::<5>();
    is_the_exponential::<6>();
}

fn is_the_integral<const N: usize>() {
    // Gauss's three nodes in each of many parts.
    let nodes = [(-0.6f64.sqrt(), 5.0 / 18.0), (0.0, 4.0 / 9.0), (0.6f64.sqrt(), 5.0 / 18.0)];
    for (damping, angle) in DAMPINGS.into_iter().flat_map(|damping| ANGLES.map(|angle| (damping, angle))) {
        for a in 0..N - 2 {
            let parts = 300.0 + (30.0 * angle * (1.0 + 2.0 * damping)).round();
            let part = angle / parts;
            let mut wanted = [[0.0; N]; N];
            let mut moment = set::<N>(1.0, damping, a, angle);
            let noise = *moment.noise();
            for k in 0..parts as usize {
                for (node, weight) in nodes {
                    moment.set(part * (k as f64 + 0.5 * (1.0 + node)));
                    for i in 0..N {
                        for j in 0..N {
                            wanted[i][j] += part * weight * moment.entry(i, N - 1) * moment.entry(j, N - 1);
                        }
                    }
                }
            }
            for i in 0..N {
                for j in 0..N {
                    assert_eq!(noise[i][j], noise[j][i]);
                    let size = (wanted[i][i] * wanted[j][j]).sqrt();
                    let relative = (noise[i][j] - wanted[i][j]).abs() / size;
                    assert!(
                        relative < 1e-9,
                        "D {damping}, angle {angle}, {i}, {j} (a {a} of {N}): {relative}"
                    );
                }
            }
            let unit = DMatrix::from_fn(N, N, |i, j| noise[i][j] / (noise[i][i] * noise[j][j]).sqrt());
            assert!(unit.symmetric_eigenvalues().min() > -1e-15 * N as f64);
        }
    }
}

#[test]
fn the_noise_is_the_integral_of_the_squared_response() {
    is_the_integral::<4>();
    is_the_integral::<5>();
    is_the_integral::<6>();
}

#[test]
fn a_fast_oscillator_follows_the_drive() {
    let (w, step) = (1e4, 1.0);
    let ringing = set::<6>(w, 1.0, 2, step);
    for (entry, wanted) in
        [(ringing.entry(2, 4), 1.0), (ringing.entry(2, 5), step), (ringing.entry(1, 4), step)]
    {
        assert!((entry - wanted).abs() < 1e-3);
    }
    assert!(ringing.entry(2, 2).abs() < 1e-3 && (w * ringing.entry(2, 3)).abs() < 1e-3);
    assert!((ringing.noise()[2][2] / ringing.noise()[4][4] - 1.0).abs() < 1e-3);
}

#[test]
fn the_longest_steps_end() {
    for step in [1e18, 1e300, f64::INFINITY] {
        set::<6>(1.0, 0.1, 2, step);
    }
    assert!(set::<6>(1.0, 0.1, 2, 1e18).noise().iter().flatten().all(|x| x.is_finite()));
}
