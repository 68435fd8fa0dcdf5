//! Tests of the implicit method on nonlinear equations.

use core::cell::Cell;

use super::newton::SHARES;
use super::tangent::COUNTS;
use super::*;
use crate::excitation::{Forcing, Instant};
use crate::integrate::Rk45;
use crate::system::{Force, NO_FORCE, Square, System};
use crate::yardstick::{cart_links, cart_on};

/// Force and stiffness of a spring at a deflection.
type Law = fn(f64) -> (f64, f64);

/// Springs of any law along rows in the coordinates η, with parallel dampers.
struct Springs {
    frequency: [f64; 6],
    /// Deflection per unit of each η, and deflection at the start, whose force is balanced.
    rows: Vec<([f64; 6], f64)>,
    law: Law,
    damping: Square,
    /// Calls of `rate`.
    calls: Cell<usize>,
}

impl Springs {
    fn new(frequency: [f64; 6], rows: &[([f64; 6], f64)], law: Law, damping: Square) -> Self {
        Self { frequency, rows: rows.to_vec(), law, damping, calls: Cell::new(0) }
    }

    /// Mean number of iterations per step.
    fn iterations(&self, steps: u32) -> f64 {
        (self.calls.get() as f64 / f64::from(steps) - 1.0) / 5.0
    }

    fn deflection(&self, row: &[f64; 6], state: &State) -> f64 {
        (0..6)
            .map(|i| if self.frequency[i] > 0.0 { row[i] * state[i] / self.frequency[i] } else { 0.0 })
            .sum()
    }
}

impl Equations for Springs {
    const PIECEWISE: bool = false;
    const LINEAR: bool = false;

    fn key(&self) -> u32 {
        0
    }

    fn frequency(&self) -> &[f64; 6] {
        &self.frequency
    }

    fn linear(&self, _: &State, _: &Force) -> State {
        unreachable!("for linear equations")
    }

    fn constant(&self) -> &Force {
        &NO_FORCE
    }

    fn rate(&self, state: &State, force: &Force, _: (&StageData, usize)) -> State {
        self.calls.set(self.calls.get() + 1);
        let mut rate = [0.0; 12];
        for i in 0..6 {
            rate[i] = self.frequency[i] * state[6 + i];
            rate[6 + i] = force[i];
            for j in 0..6 {
                rate[6 + i] -= self.damping[j][i] * state[6 + j];
            }
        }
        for (row, start) in &self.rows {
            let pull = (self.law)(start + self.deflection(row, state)).0 - (self.law)(*start).0;
            for i in 0..6 {
                rate[6 + i] -= row[i] * pull;
            }
        }
        rate
    }

    fn tangent(&self, state: &State, _: Instant) -> (Square, Square) {
        let mut stiffness = [[0.0; 6]; 6];
        for (row, start) in &self.rows {
            let slope = (self.law)(start + self.deflection(row, state)).1;
            for j in (0..6).filter(|&j| self.frequency[j] > 0.0) {
                for i in 0..6 {
                    stiffness[j][i] += row[i] * slope * row[j] / self.frequency[j];
                }
            }
        }
        (stiffness, self.damping)
    }
}

/// `steps` equal steps without excitation from `state`.
fn coast<M: Method>(method: &M, springs: &Springs, mut state: State, length: f64, steps: u32) -> State {
    let h = length / f64::from(steps);
    let forcing = no_drive();
    let ramp = Ramp {
        h,
        start: &[0.0; 9],
        end: &[0.0; 9],
        forcing: &forcing,
        spans_interval: true,
        begin: Instant::FIRST,
    };
    let mut memory = method.memory();
    for _ in 0..steps {
        let (next, error) = method.step(springs, &mut memory, &ramp, &state);
        assert!(next.iter().chain(&error).all(|x| x.is_finite()));
        state = next;
    }
    state
}

fn no_drive() -> Forcing {
    Forcing::new(&cart(), &[0.0; 9], [1.0; 2])
}

fn cart() -> System {
    cart_on(&cart_links(1e5))
}

/// Preloaded ball contact, k0 = 6e7 N/m and 600 N: one row opens at 30 µm.
fn preloaded(deflection: f64) -> (f64, f64) {
    let (k0, preload): (f64, f64) = (6e7, 600.0);
    let d0 = 3.0 * preload / k0;
    let scale = preload / (d0 * d0.sqrt());
    let [push, pull] = [d0 + deflection, d0 - deflection].map(|x| x.max(0.0).sqrt());
    (scale * (push.powi(3) - pull.powi(3)), scale * 1.5 * (push + pull))
}

/// The links of a system with another law.
fn carried(system: &System, law: Law) -> Springs {
    let rows: Vec<_> = system.rows().iter().map(|row| (row.rate, row.rest)).collect();
    Springs::new(system.frequency, &rows, law, system.damping)
}

fn preloaded_cart() -> Springs {
    carried(&cart(), preloaded)
}

const NO_DAMPING: Square = [[0.0; 6]; 6];

/// Energy coordinates of one mode.
fn one(elastic: f64, velocity: f64) -> State {
    let mut state = [0.0; 12];
    (state[0], state[6]) = (elastic, velocity);
    state
}

/// x'' + 100² x + 100² x³ = 0: a hardening spring, stiffness doubled at x = 0.58.
fn duffing() -> Springs {
    let law = |x: f64| (1e4 * (x + x.powi(3)), 1e4 * (1.0 + 3.0 * x * x));
    Springs::new([100.0, 0.0, 0.0, 0.0, 0.0, 0.0], &[([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.0)], law, NO_DAMPING)
}

/// Jacobi's elliptic functions sn, cn, dn of the parameter m by descending Landen transformation (Abramowitz & Stegun 16.4).
fn jacobi(u: f64, m: f64) -> [f64; 3] {
    let (mut a, mut c) = ([1.0; 8], [m.sqrt(); 8]);
    let mut b = (1.0 - m).sqrt();
    for n in 1..8 {
        (a[n], c[n]) = ((a[n - 1] + b) / 2.0, (a[n - 1] - b) / 2.0);
        b = (a[n - 1] * b).sqrt();
    }
    let mut phi = 128.0 * a[7] * u;
    for n in (1..8).rev() {
        phi = (phi + (c[n] / a[n] * phi.sin()).asin()) / 2.0;
    }
    [phi.sin(), phi.cos(), (1.0 - m * phi.sin().powi(2)).sqrt()]
}

/// The closed solution of [`duffing`] from the amplitude at rest: x = a cn(Ω t, m), Ω² = 100² (1 + a²), m = a² / 2 (1 + a²).
fn duffing_at(time: f64, amplitude: f64) -> State {
    let omega = 100.0 * (1.0 + amplitude * amplitude).sqrt();
    let m = amplitude * amplitude / (2.0 * (1.0 + amplitude * amplitude));
    let [sn, cn, dn] = jacobi(omega * time, m);
    one(100.0 * amplitude * cn, -amplitude * omega * sn * dn)
}

fn distance(a: &State, b: &State) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[test]
fn shares_resolve_right_hand_sides_into_the_parts() {
    // The shares are the inverse of the eigenvectors, so the parts of each stage add up to that stage.
    for stage in 0..5 {
        for row in 0..5 {
            let mut sum = 0.0;
            for (index, part) in RADAU.parts.iter().enumerate() {
                let ([a, b], [c, d]) = (part.vector[row], SHARES[index][stage]);
                sum += COUNTS[index] * (a * c - b * d);
            }
            assert!((sum - if row == stage { 1.0 } else { 0.0 }).abs() < 1e-13, "{stage} {row}: {sum}");
        }
    }
}

#[test]
fn duffing_has_order_nine_against_its_closed_solution() {
    for (amplitude, steps) in [(0.3, [100, 140]), (1.0, [200, 280])] {
        let start = one(100.0 * amplitude, 0.0);
        let [coarse, fine] = steps.map(|steps| {
            let springs = duffing();
            let got = coast(&Radau, &springs, start, 0.5, steps);
            assert!(springs.iterations(steps) <= 4.0, "{}", springs.iterations(steps));
            distance(&got, &duffing_at(0.5, amplitude))
        });
        let order = (coarse / fine).ln() / (f64::from(steps[1]) / f64::from(steps[0])).ln();
        assert!((order - 9.0).abs() <= 0.1, "{order} (errors {coarse:.1e} {fine:.1e})");
        assert!(fine > 1e-11, "{fine:e}: rounding, not order");
    }
}

/// A state of the cart in which its links are well beyond the deflection at which a row opens.
fn shaken() -> State {
    [3.0, -5.0, 4.0, 3.0, -6.0, 0.0, 5.0, 3.0, -2.0, 4.0, 2.0, 0.0]
}

#[test]
fn links_that_open_and_close_converge_and_agree_with_rk45() {
    let springs = preloaded_cart();
    let deflection = |state: &State| {
        springs
            .rows
            .iter()
            .map(|(row, rest)| (rest + springs.deflection(row, state)).abs())
            .fold(0.0, f64::max)
    };
    assert!(deflection(&shaken()) > 60e-6, "{:e}", deflection(&shaken()));
    let want = coast(&Rk45, &springs, shaken(), 0.05, 20_000);
    // The second derivative of the force is unbounded where a row opens, so the order is below nine there.
    for (steps, allowed) in [(50, 1e-3), (200, 1e-4), (800, 1e-5), (3200, 1e-6)] {
        springs.calls.set(0);
        let off =
            distance(&coast(&Radau, &springs, shaken(), 0.05, steps), &want) / distance(&want, &[0.0; 12]);
        assert!(off <= allowed, "{steps} steps: {off:e}");
        assert!(springs.iterations(steps) <= 4.5, "{steps} steps: {} iterations", springs.iterations(steps));
    }
}

#[test]
fn linear_springs_give_the_steps_of_the_linear_system() {
    let system = cart();
    let springs = carried(&system, |x| (6e7 * x, 6e7));
    let forcing = Forcing::new(&system, &[1.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0], [1.0; 2]);
    let (start, end) = ([1.0, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [-2.0; 9]);
    let ramp = Ramp {
        h: 1e-3,
        start: &start,
        end: &end,
        forcing: &forcing,
        spans_interval: true,
        begin: Instant::FIRST,
    };
    let (mut direct, mut iterated) = (Radau.memory(), Radau.memory());
    let mut state = shaken();
    for _ in 0..20 {
        let (want, want_error) = Radau.step(&system, &mut direct, &ramp, &state);
        let (got, error) = Radau.step(&springs, &mut iterated, &ramp, &state);
        assert!(distance(&got, &want) <= 1e-13 * distance(&want, &[0.0; 12]));
        assert!(distance(&error, &want_error) <= 1e-13 * distance(&want, &[0.0; 12]));
        let there = [0.3, 0.9].map(|theta| {
            [
                Radau.between(&system, &mut direct, &ramp, &state, theta),
                Radau.between(&springs, &mut iterated, &ramp, &state, theta),
            ]
        });
        assert!(there.iter().all(|[a, b]| distance(a, b) <= 1e-13 * distance(&want, &[0.0; 12])));
        state = want;
    }
}

#[test]
fn stiff_damping_needs_no_additional_iterations() {
    // Coupled to a mode that is damped 1e6 1/s, with a hardening spring across both.
    let mut damping = NO_DAMPING;
    (damping[0][0], damping[1][1], damping[0][1], damping[1][0]) = (5.0, 1e6, 300.0, 300.0);
    let rows = [([1.0, 0.5, 0.0, 0.0, 0.0, 0.0], 0.0), ([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], 0.1)];
    let law = |x: f64| (4e5 * (x + x.powi(3)), 4e5 * (1.0 + 3.0 * x * x));
    let springs = Springs::new([600.0, 900.0, 0.0, 0.0, 0.0, 0.0], &rows, law, damping);
    let mut start = one(100.0, 50.0);
    (start[1], start[7]) = (80.0, -30.0);
    let want = coast(&Radau, &springs, start, 0.02, 2000);
    for (steps, allowed) in [(20, 1e-5), (80, 1e-9)] {
        springs.calls.set(0);
        let off = distance(&coast(&Radau, &springs, start, 0.02, steps), &want) / distance(&want, &[0.0; 12]);
        assert!(off <= allowed, "{steps} steps: {off:e}");
        assert!(springs.iterations(steps) <= 4.5, "{} iterations", springs.iterations(steps));
    }
}

#[test]
fn motion_below_the_rounding_of_the_static_load_is_no_failure() {
    // Also at rest at the opening of a row, where the law is least smooth.
    for start in [0.0, 29e-6, 30e-6] {
        for size in [0.0, 1e-300, 1e-30, 1e-18, 1e-14, 1e-12, 1e-9, 1e-6] {
            let springs = Springs::new(
                cart().frequency,
                &[([0.03, 0.02, 0.0, 0.0, 0.0, 0.0], start)],
                preloaded,
                NO_DAMPING,
            );
            let mut state = one(3.0 * size, 4.0 * size);
            (state[1], state[7]) = (-5.0 * size, 3.0 * size);
            let got = coast(&Radau, &springs, state, 0.05, 50);
            // The rounding error of the force is 1e-16 of the spring forces, some 1e3 N.
            assert!(distance(&got, &[0.0; 12]) <= 10.0 * size + 1e-13, "{start} {size}: {got:?}");
            assert!(springs.iterations(50) <= 6.0, "{start} {size}: {}", springs.iterations(50));
        }
    }
}

#[test]
fn a_step_without_convergence_is_infinite_after_bounded_work_and_a_shorter_step_converges() {
    let springs = duffing();
    let forcing = no_drive();
    let ramp = |h| Ramp {
        h,
        start: &[0.0; 9],
        end: &[0.0; 9],
        forcing: &forcing,
        spans_interval: false,
        begin: Instant::FIRST,
    };
    let mut memory = Radau.memory();
    let state = one(3e2, 0.0);
    let (first, _) = Radau.step(&springs, &mut memory, &ramp(1e-4), &state);
    for start in [first, one(f64::NAN, 0.0), one(0.0, f64::INFINITY), one(1e200, 0.0)] {
        springs.calls.set(0);
        let (next, error) = Radau.step(&springs, &mut memory, &ramp(1.0), &start);
        assert!(next.iter().chain(&error).all(|x| *x == f64::INFINITY), "{next:?}");
        assert!(springs.calls.get() <= 1 + 5 * 20, "{}", springs.calls.get());
    }
    // The failed step has no effect on the next.
    let (got, error) = Radau.step(&springs, &mut memory, &ramp(1e-4), &first);
    assert!(distance(&got, &coast(&Radau, &springs, first, 1e-4, 1)) <= 1e-10 * distance(&got, &[0.0; 12]));
    assert!(distance(&error, &[0.0; 12]) <= 1e-6 * distance(&got, &[0.0; 12]));
    // The same for a shorter step that starts where the last step started.
    let (again, _) = Radau.step(&springs, &mut memory, &ramp(5e-5), &first);
    assert!(distance(&again, &coast(&Radau, &springs, first, 5e-5, 1)) <= 1e-10 * distance(&got, &[0.0; 12]));
}
