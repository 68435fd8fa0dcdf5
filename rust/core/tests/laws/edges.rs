//! Contacts at extremes of rounding, size or shape, and compared with integration that does not locate contact changes.

use guideload::{
    Body, Control, Dof, Exact, Excitation, Free, Link, Output, Part, Radau, Rk45, State, acceleration,
    link_load, position, velocity,
};
use nalgebra::{DVector, Matrix3, Vector3, Vector6};

use crate::common::{
    ADAPTIVE, Machine, Random, alike, any_machine, at, cart, close, curve, cycle, free_block, noise, one_dof,
    sided,
};

/// Load of a link, by the definition in its documentation.
fn load(link: &Link, d: f64, rate: f64) -> f64 {
    let elastic = link.law().force(d);
    let idle = link.is_damped_in_contact() && elastic == 0.0;
    elastic + if idle { 0.0 } else { link.damping() * rate }
}

/// Link loads at the samples from `M q'' = Q - Σ loads - M_u a` by the classical Runge-Kutta method, without modes or contact changes.
fn brute_loads(machine: &Machine, excitation: &Excitation, parts: usize) -> Vec<f64> {
    let system = machine.system();
    let matrices = system.matrices();
    let free: Vec<usize> = machine.free.iter().map(|dof| dof as usize).collect();
    let inverse = free_block(&matrices.mass, machine.free).try_inverse().expect("a mass matrix");
    let rows: Vec<_> = machine.links.iter().map(Link::row).collect();
    let loads = |q: &Vector6<f64>, v: &Vector6<f64>| -> Vec<f64> {
        machine.links.iter().zip(&rows).map(|(link, row)| load(link, row.dot(q), row.dot(v))).collect()
    };
    let accelerate = |q: &Vector6<f64>, v: &Vector6<f64>, [x, y, z]: [f64; 3]| {
        let mut force = matrices.weight - matrices.mass * Vector6::new(x, y, z, 0.0, 0.0, 0.0);
        for (row, load) in rows.iter().zip(loads(q, v)) {
            force -= row * load;
        }
        let moved = &inverse * DVector::from_fn(free.len(), |i, _| force[free[i]]);
        let mut out = Vector6::zeros();
        for (i, &dof) in free.iter().enumerate() {
            out[dof] = moved[i];
        }
        out
    };
    let (mut q, mut v) = (system.static_position(), Vector6::zeros());
    let mut out = loads(&q, &v);
    for k in 0..excitation.count() - 1 {
        let h = (excitation.time(k + 1) - excitation.time(k)) / parts as f64;
        let (from, to) = (excitation.input(k), excitation.input(k + 1));
        for part in 0..parts {
            let drive = |theta: f64| {
                let theta = (part as f64 + theta) / parts as f64;
                [0, 1, 2].map(|i| (1.0 - theta) * from[i] + theta * to[i])
            };
            let k1 = accelerate(&q, &v, drive(0.0));
            let v2 = v + k1 * (h / 2.0);
            let k2 = accelerate(&(q + v * (h / 2.0)), &v2, drive(0.5));
            let v3 = v + k2 * (h / 2.0);
            let k3 = accelerate(&(q + v2 * (h / 2.0)), &v3, drive(0.5));
            let v4 = v + k3 * h;
            let k4 = accelerate(&(q + v3 * h), &v4, drive(1.0));
            q += (v + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
            v += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        }
        out.extend(loads(&q, &v));
    }
    out
}

#[test]
fn the_exact_solution_is_that_of_the_equations_of_motion() {
    let mut random = Random::new(401);
    for _ in 0..2 {
        let machine = any_machine(&mut random);
        let samples = noise(&mut random, 12).into_iter().map(|a| a.map(|a| 10.0 * a)).collect::<Vec<_>>();
        let excitation = Excitation::uniform(0.0, 3e-3, &samples).expect("sound");
        let (states, summary) = machine.states(&Exact, ADAPTIVE, &excitation);
        assert!(summary.contact_changes > 5, "{summary:?}");
        // Steps across a change of slope have order 2, steps across a jump of a damper order 1.
        alike(&machine.loads_of(&states), &brute_loads(&machine, &excitation, 800), 1e-4);
    }
}

/// Without excitation no machine moves, to the last bit, and no method mistakes rounding for divergence.
#[test]
fn rest_is_rest_on_any_segment() {
    let mut random = Random::new(402);
    for _ in 0..20 {
        let machine = any_machine(&mut random);
        let excitation = Excitation::uniform(0.0, 1e-3, &[[0.0; 3]; 6]).expect("sound");
        let fixed = Control::Fixed { step: 2e-4 };
        for (states, summary) in [
            machine.states(&Exact, ADAPTIVE, &excitation),
            machine.states(&Rk45, fixed, &excitation),
            machine.states(&Radau, fixed, &excitation),
            machine.states(&Rk45, ADAPTIVE, &excitation),
        ] {
            assert_eq!(summary.contact_changes, 0);
            assert!(states.iter().flatten().all(|entry| *entry == 0.0));
        }
    }
}

/// This holds also for a clearance without stiffness beyond it, where no contact is possible.
#[test]
fn a_damper_in_contact_rests_on_the_side_without_stiffness() {
    for side in [1.0, -1.0] {
        let law = if side > 0.0 { sided(0.0, 1e8, 1e-5) } else { sided(1e8, 0.0, 1e-5) };
        let mut machine = one_dof(1000.0, 0.1).with_laws(|_, _| law);
        machine.links[0] = machine.links[0].damped_in_contact().expect("a clearance");
        machine.gravity = Vector3::new(0.0, -9.80665 * side, 0.0);
        // Pushed off its stop with 2 g for 5 ms, it flies 0.3 mm beyond the other end of its clearance.
        let time: Vec<f64> = (0..30).map(|k| f64::from(k) * 1e-3).collect();
        let thrown = |k: usize| [0.0, if k < 6 { -30.0 * side } else { 0.0 }, 0.0];
        let samples: Vec<_> = (0..30).map(thrown).collect();
        let excitation = Excitation::new(&time, &samples, None).expect("sound");
        let (states, _) = machine.states(&Exact, ADAPTIVE, &excitation);
        let system = machine.system();
        let loads = [Part::Total, Part::Damping].map(|part| link_load(&system, 0, part));
        let (moves, moved) = (acceleration(&system), position(&system));
        let mut flown = 0;
        for (k, state) in states.iter().enumerate() {
            let input = excitation.input(k);
            if side * moved.at(state, &input)[1] > 1e-5 {
                flown += 1;
                assert!(loads.iter().all(|load| load.at(state, &input) == [0.0]));
                close(moves.at(state, &input)[1], machine.gravity.y - input[1], 1e-12, 30.0);
            }
        }
        assert!(flown > 5, "{flown}");
    }
}

/// Links that are very soft at rest: the state is scaled by the stiffness at rest, the work is not.
#[test]
fn softness_at_rest_costs_neither_digits_nor_work() {
    let mut last: Option<Vec<f64>> = None;
    for soft in [1e-8, 1e-10, 1e-14, 1e-25] {
        let mut machine = cart().with_laws(|_, k| {
            let d = 1e-5;
            let points = [[-2.0, -1.0 - soft], [-1.0, -soft], [1.0, soft], [2.0, 1.0 + soft]];
            curve(&points.map(|[x, f]| [x * d, f * k * d]))
        });
        machine.gravity = Vector3::zeros();
        let samples = noise(&mut Random::new(403), 30);
        let excitation = Excitation::uniform(0.0, 4e-3, &samples).expect("sound");
        let loads = machine.exact_loads(&excitation);
        // These stiffnesses are too small to change the loads.
        if let Some(last) = &last {
            alike(&loads, last, 1e-6);
        }
        last = Some(loads);
    }
}

/// Numbers near the limits of their range give a result or an error, in bounded time.
#[test]
fn a_run_ends_for_numbers_of_any_size() {
    for size in [1e-300, 1e-160, 1e160, 1e306, 1e308] {
        for law in [sided(1e8, 1e8, 1e-5), sided(1e8, 2e7, 0.0), sided(0.0, 1e8, 1e-3)] {
            let machine = one_dof(1000.0, 0.1).with_laws(|_, _| law);
            let samples = [size, size, -size, size].map(|a| [0.0, a, 0.0]);
            for step in [1e-3, 0.05] {
                let excitation = Excitation::uniform(0.0, step, &samples).expect("sound");
                let (states, outcome) = machine.run(&Exact, ADAPTIVE, &excitation, Output::Samples);
                assert!(outcome.is_err() || states.iter().flatten().all(|entry| entry.is_finite()));
                machine.run(&Rk45, Control::Fixed { step: step / 10.0 }, &excitation, Output::Samples).1.ok();
                machine
                    .run(&Radau, Control::Fixed { step: step / 10.0 }, &excitation, Output::Samples)
                    .1
                    .ok();
            }
        }
    }
}

/// All fourteen edges of the longest table within one step, forth and back.
#[test]
fn many_edges_in_one_step() {
    let machine = one_dof(500.0, 0.02).with_laws(|_, k| {
        let points: [[f64; 2]; 16] = core::array::from_fn(|i| {
            let x = i as f64 - 7.5;
            [x * 1e-5, k * 1e-5 * (x + 0.02 * x * x * x)]
        });
        curve(&points)
    });
    let samples = [[0.0; 3], [0.0, 60.0, 0.0], [0.0, -60.0, 0.0], [0.0; 3]];
    let coarse = Excitation::uniform(0.0, 0.02, &samples).expect("sound");
    let times: Vec<f64> = (0..=300).map(|k| f64::min(f64::from(k) * 2e-4, coarse.time(3))).collect();
    let (states, outcome) = machine.run(&Exact, ADAPTIVE, &coarse, Output::Times(&times));
    assert!(outcome.expect("a run that succeeds").contact_changes >= 28);
    let fine: Vec<_> = times.iter().map(|&time| coarse.input_at(time)).map(|u| [u[0], u[1], u[2]]).collect();
    let fine = Excitation::new(&times, &fine, None).expect("sound");
    alike(&machine.exact_loads(&fine), &machine.loads_of(&states), 1e-11);
}

/// The energy of body and links falls by exactly the energy that the dampers dissipate.
#[test]
fn energy_falls_by_the_work_of_the_dampers() {
    let mut random = Random::new(404);
    let machine = any_machine(&mut random);
    let system = machine.system();
    let mass = system.matrices().mass;
    let parts = 10_000;
    let mut time = vec![0.0, 5e-3];
    time.extend((0..=parts).map(|k| 5e-3 + f64::from(k) * 2e-6));
    let kick = [80.0, -50.0, 60.0];
    let mut samples = vec![kick; 2];
    samples.resize(time.len(), [0.0; 3]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (states, summary) = machine.states(&Exact, ADAPTIVE, &excitation);
    assert!(summary.contact_changes > 10, "{summary:?}");
    let (moved, moving) = (position(&system), velocity(&system));
    let energy = |state: &State| {
        let (q, v) = (at(&moved, state), at(&moving, state));
        let links: f64 = machine.links.iter().map(|link| link.law().energy(link.row().dot(&q))).sum();
        links - system.matrices().weight.dot(&q) + 0.5 * v.dot(&(mass * v))
    };
    let power = |state: &State| -> f64 {
        let (q, v) = (at(&moved, state), at(&moving, state));
        let pairs = machine.links.iter().map(|link| (link, link.row().dot(&q), link.row().dot(&v)));
        pairs.map(|(link, d, rate)| (load(link, d, rate) - link.law().force(d)) * rate).sum()
    };
    let powers: Vec<f64> = states[2..].iter().map(power).collect();
    let work: f64 = powers.windows(2).map(|pair| 1e-6 * (pair[0] + pair[1])).sum();
    let (start, end) = (energy(&states[2]), energy(&states[states.len() - 1]));
    // Error of the trapezoidal rule where the power of dampers jumps: a step times the sum of the jumps.
    close(start - end, work, 1e-4, work);
    assert!(work > 0.1 * (start - energy(&states[0])));
}

/// A link with clearance that never opens equals a linear link with a shifted frame.
#[test]
fn a_clearance_that_stays_closed_only_shifts_the_body() {
    let machine = one_dof(200.0, 0.05);
    let samples: Vec<_> = cycle()[500..1500].iter().map(|a| [0.0, a[0], 0.0]).collect();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let linear = machine.exact_loads(&excitation);
    assert!(linear.iter().all(|load| *load < 0.0));
    let shut = machine.with_laws(|_, k| sided(k, k, 1e-4));
    let (states, summary) = shut.states(&Exact, ADAPTIVE, &excitation);
    assert_eq!(summary.contact_changes, 0);
    alike(&shut.loads_of(&states), &linear, 1e-14);
}

/// Under a constant push, the time of the first contact is that of free flight.
#[test]
fn the_first_contact_is_at_the_end_of_free_flight() {
    let (gap, push, omega): (f64, f64, f64) = (2e-4, 3.0, 800.0);
    let body = Body::new(100.0, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let law = sided(100.0 * omega * omega, 0.0, gap);
    let links = vec![Link::with_law(Vector3::zeros(), Vector3::y(), law, 0.0).expect("a link")];
    let machine = Machine { body, links, gravity: Vector3::zeros(), free: Free::only(&[Dof::Y]) };
    assert_eq!(machine.system().free_at_rest().len(), 1);
    let (touch, rate) = ((2.0 * gap / push).sqrt(), (2.0 * gap * push).sqrt());
    let (time, samples) = ([0.0, touch + 1e-3], [[0.0, -push, 0.0]; 2]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let after: Vec<f64> = (0..=10).map(|k| touch + f64::from(k) * 1e-4).collect();
    let after = &after[..10];
    let (states, outcome) = machine.run(&Exact, ADAPTIVE, &excitation, Output::Times(after));
    assert_eq!(outcome.expect("a run that succeeds").contact_changes, 1);
    for (load, time) in machine.loads_of(&states).iter().zip(after) {
        let t = time - touch;
        let want = 100.0 * (push * (1.0 - (omega * t).cos()) + omega * rate * (omega * t).sin());
        close(*load, want, 1e-11, 100.0 * omega * rate);
    }
}
