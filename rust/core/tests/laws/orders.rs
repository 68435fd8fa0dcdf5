//! Observed orders: of the results, of dense output and of the error estimates.

use guideload::{Control, Exact, Excitation, Method, Output, Radau, Rk45, State};

use crate::common::{ADAPTIVE, Machine, adaptive, cart, difference, largest, one_dof};

/// One long interval with a step of the acceleration and then a slope.
const SAMPLES: [[f64; 3]; 2] = [[1.0, 2.0, -1.0], [-2.0, 1.0, 2.0]];

/// Error of the last state after `steps` equal steps over `length` s, relative to the exact one.
fn error_at_end<M: Method>(method: &M, machine: &Machine, length: f64, steps: u32) -> f64 {
    let time = [0.0, length];
    let excitation = Excitation::new(&time, &SAMPLES, None).expect("sound");
    let exact = machine.states(&Exact, ADAPTIVE, &excitation).0[1];
    let control = Control::Fixed { step: length / f64::from(steps) };
    let (states, summary) = machine.states(method, control, &excitation);
    assert_eq!(summary.steps, steps as usize);
    difference(&states[1], &exact) / largest(&exact)
}

/// The slope of the errors between two numbers of steps.
#[track_caller]
fn assert_order<M: Method>(method: &M, machine: &Machine, length: f64, steps: [u32; 2], nominal: f64) {
    let [coarse, fine] = steps.map(|steps| error_at_end(method, machine, length, steps));
    let order = (coarse / fine).ln() / (f64::from(steps[1]) / f64::from(steps[0])).ln();
    println!("order {order:.3} of {nominal} (errors {coarse:.1e} {fine:.1e})");
    assert!(fine > 2e-13, "{fine:e}: rounding, not order");
    assert!((order - nominal).abs() <= 0.1, "{order}"); // Asked in issue 2.
}

#[test]
fn rk45_has_order_five() {
    // ω h = 0.1 and less: the next term of the error is below 1 % of it.
    assert_order(&Rk45, &one_dof(100.0, 0.0), 1.0, [2000, 4000], 5.0);
    assert_order(&Rk45, &one_dof(100.0, 0.05), 0.1, [100, 200], 5.0);
    assert_order(&Rk45, &cart(), 0.05, [500, 1000], 5.0);
}

#[test]
fn radau_has_order_nine() {
    // ω h of about 1 and 0.5; at smaller steps rounding exceeds the error.
    assert_order(&Radau, &one_dof(100.0, 0.0), 1.0, [100, 200], 9.0);
    assert_order(&Radau, &one_dof(100.0, 0.05), 0.2, [20, 40], 9.0);
    assert_order(&Radau, &cart(), 0.05, [20, 36], 9.0);
}

/// Error of one step from rest at the fraction `theta` of it, relative to the exact state.
fn error_inside<M: Method>(method: &M, machine: &Machine, h: f64, theta: f64) -> f64 {
    // The slope is the same for any length of the step.
    let (time, samples) = ([0.0, h], [[1.0, 2.0, -1.0], [1.0, 2.0 - 50.0 * h, -1.0]]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let times = [theta * h];
    let state = |states: Vec<State>| states[0];
    let exact = state(machine.run(&Exact, ADAPTIVE, &excitation, Output::Times(&times)).0);
    let got = state(machine.run(method, Control::Fixed { step: h }, &excitation, Output::Times(&times)).0);
    difference(&got, &exact)
}

/// The error of one step of a method of order p is proportional to h^(p + 1).
#[track_caller]
fn assert_order_inside<M: Method>(method: &M, theta: f64, steps: [f64; 2], nominal: f64) {
    for machine in [one_dof(100.0, 0.0), one_dof(100.0, 0.3)] {
        let [coarse, fine] = steps.map(|h| error_inside(method, &machine, h, theta));
        let order = (coarse / fine).ln() / (steps[0] / steps[1]).ln() - 1.0;
        println!("order {order:.3} of {nominal} at {theta} (errors {coarse:.1e} {fine:.1e})");
        assert!((order - nominal).abs() <= 0.1, "{order}");
    }
}

#[test]
fn dense_output_has_order_four_in_rk45_and_five_in_radau() {
    for theta in [0.25, 0.5, 0.75] {
        assert_order_inside(&Rk45, theta, [1e-3, 5e-4], 4.0);
    }
    // At fractions that are not near a zero of the collocation's error polynomial.
    for theta in [0.25, 0.5] {
        assert_order_inside(&Radau, theta, [2e-3, 1e-3], 5.0);
    }
    assert_order_inside(&Rk45, 1.0, [1e-3, 5e-4], 5.0);
}

/// The number of steps at a tolerance. If the allowed error of a step is proportional to its length, an estimate proportional to h^(p + 1)
/// makes the number of steps proportional to rtol^(-1 / p). If steps are so long that each may have an error of rtol, it is proportional to
/// rtol^(-1 / (p + 1)).
#[track_caller]
fn assert_order_of_estimate<M: Method>(method: &M, order: f64, tolerances: [f64; 2]) {
    let machine = one_dof(100.0, 0.0);
    let time = [0.0, 20.0];
    let excitation = Excitation::new(&time, &SAMPLES, None).expect("sound");
    let [loose, tight] = tolerances.map(|rtol| {
        let (_, summary) = machine.states(method, adaptive(rtol), &excitation);
        assert!(summary.rejected < summary.steps / 50 + 20, "{summary:?}");
        summary.steps as f64
    });
    let got = (tolerances[0] / tolerances[1]).ln() / (tight / loose).ln();
    println!("steps {loose} {tight}: order of the estimate {got:.3} of {order}");
    assert!((got - order).abs() <= 0.1, "{got}");
}

#[test]
fn error_estimates_have_order_four_in_rk45_and_five_in_radau() {
    assert_order_of_estimate(&Rk45, 4.0, [1e-4, 1e-6]);
    assert_order_of_estimate(&Radau, 5.0, [1e-6, 1e-9]);
}
