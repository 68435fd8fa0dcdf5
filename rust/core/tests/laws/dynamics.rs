//! Motion: energy, and the closed forms of one degree of freedom.

use guideload::{Body, Dof, Exact, Excitation, Free, Link, Output, State, position, velocity};
use nalgebra::{Matrix3, Vector3};

use crate::common::{
    ADAPTIVE, GRAVITY, Machine, Random, alike, at, cart, close, largest, one_dof, random_machine, ticks,
};

/// Energy of the motion about the static position, from the matrices and not from the state's own norm.
fn energy(machine: &Machine, states: &[State]) -> Vec<f64> {
    let system = machine.system();
    let (place, speed) = (position(&system), velocity(&system));
    let (m, k) = (system.matrices().mass, system.matrices().stiffness);
    let of = |state: &State| {
        let (q, v) = (at(&place, state) - system.static_position(), at(&speed, state));
        0.5 * v.dot(&(m * v)) + 0.5 * q.dot(&(k * q))
    };
    states.iter().map(of).collect()
}

/// Nodes and weights of Gauss and Legendre on (0, 1), exact up to degree nine.
const GAUSS: [(f64, f64); 5] = [
    (0.046910077030668004, 0.11846344252809454),
    (0.23076534494715845, 0.23931433524968324),
    (0.5, 0.28444444444444444),
    (0.7692346550528415, 0.23931433524968324),
    (0.953089922969332, 0.11846344252809454),
];

#[test]
fn energy_falls_at_exactly_the_dissipated_power() {
    let mut random = Random::new(31);
    let mut machines: Vec<_> = (0..3).map(|_| random_machine(&mut random)).collect();
    machines.push(cart());
    for machine in machines {
        // A push of 20 ms, then 20 ms without excitation.
        let push = [2.2, 0.7, -1.0];
        let time = [0.0, 0.02, 0.02, 0.04];
        let samples = [push, push, [0.0; 3], [0.0; 3]];
        let excitation = Excitation::new(&time, &samples, None).expect("sound");
        let system = machine.system();
        let panel = f64::min(1e-3, 0.3 / system.frequencies().iter().copied().fold(0.0, f64::max));
        let panels = (0.02 / panel).ceil();
        let starts: Vec<f64> = (0..panels as usize).map(|k| 0.02 + 0.02 * k as f64 / panels).collect();
        let times: Vec<f64> =
            starts.iter().flat_map(|t| GAUSS.map(|(node, _)| t + node * 0.02 / panels)).collect();
        let (states, outcome) = machine.run(&Exact, ADAPTIVE, &excitation, Output::Times(&times));
        outcome.expect("a run that succeeds");
        let (ends, outcome) = machine.run(&Exact, ADAPTIVE, &excitation, Output::Times(&[0.02, 0.04]));
        outcome.expect("a run that succeeds");
        let speed = velocity(&system);
        let power = |state: &State| -> f64 {
            let v = at(&speed, state);
            machine.links.iter().map(|l| l.damping() * l.row().dot(&v).powi(2)).sum()
        };
        let lost: f64 = states
            .iter()
            .zip(GAUSS.iter().cycle())
            .map(|(state, (_, weight))| power(state) * weight * 0.02 / panels)
            .sum();
        let energies = energy(&machine, &ends);
        // Gauss quadrature on panels of 0.6 rad of the energy's oscillation has an error of 1e-13; the rest is rounding.
        close(energies[0] - energies[1], lost, 1e-11, energies[0]);
        assert!(lost > 0.1 * energies[0]);
    }
}

#[test]
fn energy_stays_without_damping() {
    let mut random = Random::new(32);
    let mut machines: Vec<_> = (0..2).map(|_| random_machine(&mut random)).collect();
    machines.push(cart());
    for machine in machines.into_iter().map(|machine| machine.with_damping(0.0)) {
        let mut acceleration = vec![[0.0; 3]; 10_000];
        acceleration[..3].copy_from_slice(&[[2.2, 1.0, -0.5]; 3]);
        let excitation = Excitation::uniform(0.0, 1e-3, &acceleration).expect("sound");
        let (states, _) = machine.states(&Exact, ADAPTIVE, &excitation);
        let energies = energy(&machine, &states[4..]);
        let constant = vec![energies[0]; energies.len()];
        // 10 000 steps with the same rounding error of the transition matrix, at most about 2e-15 each.
        alike(&energies, &constant, 2e-11);
    }
}

/// Free motion of `x'' + 2 ζ ω x' + ω² x = 0`, ζ <= 1, from `x0`, `v0`: position and velocity.
fn free_motion(w: f64, z: f64, x0: f64, v0: f64, t: f64) -> [f64; 2] {
    if z < 1.0 {
        let (d, wd) = (z * w, w * (1.0 - z * z).sqrt());
        let (sin, cos, b) = ((wd * t).sin(), (wd * t).cos(), (v0 + d * x0) / wd);
        let decay = (-d * t).exp();
        [decay * (x0 * cos + b * sin), decay * ((b * wd - d * x0) * cos - (x0 * wd + d * b) * sin)]
    } else {
        let (b, decay) = (v0 + w * x0, (-w * t).exp());
        [decay * (x0 + b * t), decay * (b - w * (x0 + b * t))]
    }
}

/// First and second repeated integral of `exp(r t)` from zero on: `(e^z - 1) / r` and `(e^z - 1 - z) / r²`, `z = r t`.
fn repeated_integrals(r: f64, t: f64) -> [f64; 2] {
    let z = r * t;
    let second = if z.abs() > 0.5 {
        z.exp_m1() - z
    } else {
        (2..20).rev().fold(0.0, |sum, k| (sum + 1.0) * z / f64::from(k)) * z
    };
    [z.exp_m1() / r, second / (r * r)]
}

/// Response from rest to `a = step + slope t`: position and velocity, closed form.
fn response(w: f64, z: f64, step: f64, slope: f64, t: f64) -> [f64; 2] {
    if t <= 0.0 {
        return [0.0; 2];
    }
    if z > 1.0 {
        // Integrals of the impulse response (e^pt - e^qt) / (p - q), which lose no digits at any stiffness.
        let q = -w * (z + (z * z - 1.0).sqrt());
        let p = w * w / q;
        let impulse = ((p * t).exp() - (q * t).exp()) / (p - q);
        let (slow, fast) = (repeated_integrals(p, t), repeated_integrals(q, t));
        let integral = |i: usize| (slow[i] - fast[i]) / (p - q);
        return [-step * integral(0) - slope * integral(1), -step * impulse - slope * integral(0)];
    }
    let particular = |t: f64| -(step + slope * t) / (w * w) + 2.0 * z * slope / w.powi(3);
    let rate = -slope / (w * w);
    let [x, v] = free_motion(w, z, -particular(0.0), -rate, t);
    [particular(t) + x, rate + v]
}

/// Response to samples with straight lines between them: a step at the first sample, a change of slope at each.
fn piecewise(w: f64, z: f64, time: &[f64], samples: &[f64], t: f64) -> [f64; 2] {
    let mut sum = response(w, z, samples[0], 0.0, t - time[0]);
    let mut slope = 0.0;
    for k in 0..time.len() - 1 {
        let (rise, length) = (samples[k + 1] - samples[k], time[k + 1] - time[k]);
        let (step, next) = if length == 0.0 { (rise, 0.0) } else { (0.0, rise / length) };
        let [x, v] = response(w, z, step, next - slope, t - time[k]);
        slope = next;
        sum = [sum[0] + x, sum[1] + v];
    }
    sum
}

const RATIOS: [(&str, f64); 6] = [
    ("undamped", 0.0),
    ("underdamped", 0.05),
    ("nearly critical", 1.0 - 1e-9),
    ("critical, a defective matrix", 1.0),
    ("overdamped", 3.0),
    ("stiff", 500.0),
];

#[track_caller]
fn assert_closed_form(time: &[f64], samples: &[f64], tolerance: f64) {
    let w = 300.0;
    for (name, z) in RATIOS {
        let machine = one_dof(w, z);
        let acceleration: Vec<[f64; 3]> = samples.iter().map(|&a| [0.0, a, 0.0]).collect();
        let excitation = Excitation::new(time, &acceleration, None).expect("sound");
        let got = machine.exact_loads(&excitation);
        let m = machine.body.mass();
        let load = |t: f64, passed: usize| {
            // At a jump only the samples up to here count.
            let [x, v] = piecewise(w, z, &time[..=passed.max(1)], &samples[..=passed.max(1)], t);
            m * w * w * x + 2.0 * z * m * w * v - m * 9.80665
        };
        let want: Vec<f64> = time.iter().enumerate().map(|(k, &t)| load(t, k)).collect();
        // Near critical the closed form itself loses digits: sin(ω_d t) / ω_d at ω_d = 4e-5 ω.
        let off = alike(&got, &want, if z == 1.0 - 1e-9 { 1e-9 } else { tolerance });
        println!("{name}: {off:e}");
    }
}

#[test]
fn one_dof_answers_a_step_in_closed_form() {
    // Roundings of a hundred steps and of the closed form.
    assert_closed_form(&ticks(101, 2e-3), &[2.2; 101], 1e-13);
}

#[test]
fn one_dof_answers_a_ramp_in_closed_form() {
    let ramp: Vec<f64> = ticks(101, 2e-3).iter().map(|t| 25.0 * t).collect();
    assert_closed_form(&ticks(101, 2e-3), &ramp, 1e-13);
}

#[test]
fn one_dof_answers_straight_lines_and_jumps_in_closed_form() {
    let mut random = Random::new(33);
    let mut time = vec![0.0];
    for k in 1..80 {
        let last = time[k - 1];
        time.push(if k % 9 == 0 { last } else { last + random.between(1e-4, 8e-3) });
    }
    let samples: Vec<f64> = time.iter().map(|_| random.between(-3.0, 3.0)).collect();
    // The closed form is a sum of eighty responses that nearly cancel.
    assert_closed_form(&time, &samples, 1e-12);
}

/// Two links at right angles with the same stiffness, one critically and one lightly damped: the modes are not unique, the modal
/// damping is full, the matrix is defective, and along each link the closed form holds.
#[test]
fn a_coupled_defective_scene_is_exact() {
    let (m, w) = (100.0, 300.0);
    let body = Body::new(m, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let (sin, cos) = 0.7_f64.sin_cos();
    let along = [Vector3::new(0.0, cos, sin), Vector3::new(0.0, -sin, cos)];
    let ratio = [1.0, 0.03];
    let link =
        |i: usize| Link::new(Vector3::zeros(), along[i], m * w * w, 2.0 * ratio[i] * m * w).expect("a link");
    let free = Free::only(&[Dof::Y, Dof::Z]);
    let machine = Machine { body, links: vec![link(0), link(1)], gravity: GRAVITY, free };
    let mut random = Random::new(34);
    let time = ticks(100, 1e-3);
    let acceleration: Vec<Vector3<f64>> = (0..100).map(|_| random.vector(3.0)).collect();
    let samples: Vec<[f64; 3]> = acceleration.iter().map(|&a| a.into()).collect();
    let got = machine.exact_loads(&Excitation::new(&time, &samples, None).expect("sound"));
    let mut want = Vec::new();
    for &t in &time {
        for i in 0..2 {
            let along_link: Vec<f64> = acceleration.iter().map(|a| a.dot(&along[i])).collect();
            let [x, v] = piecewise(w, ratio[i], &time, &along_link, t);
            want.push(m * w * w * x + 2.0 * ratio[i] * m * w * v + m * GRAVITY.dot(&along[i]));
        }
    }
    assert!(largest(&want) > 1e3);
    alike(&got, &want, 1e-12); // A hundred responses that cancel.
}
