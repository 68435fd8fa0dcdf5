//! The state in which a run starts.

use guideload::batch::{Batch, Group, Measure, Motion};
use guideload::{
    Body, Control, Dof, Exact, Excitation, Free, Link, Method, NamedMethod, Output, Radau, Rk45, RunError,
    Start, State, position, run_from, velocity,
};
use nalgebra::{Matrix3, Vector3, Vector6};

use crate::batch::{base, measures_of};
use crate::common::{
    ADAPTIVE, GRAVITY, Machine, Random, adaptive, alike, at, cart, cart_clear, close, curve, largest, noise,
    polynomial_bows, preloaded_cart, random_machine, sided, ticks,
};

const TIGHT: Control = adaptive(1e-12);

fn curved() -> Machine {
    cart().with_laws(|_, k| {
        let points = [(-2e-4, -1.5e-4 * k), (-2e-5, -1e-5 * k), (3e-5, 2e-5 * k), (2e-4, 1.8e-4 * k)];
        curve(&points.map(|(d, f)| [d, f]))
    })
}

fn states<M: Method>(machine: &Machine, method: &M, start: Start, excitation: &Excitation) -> Vec<State> {
    let mut states: Vec<State> = Vec::new();
    let done = run_from(&machine.system(), method, TIGHT, start, excitation, Output::Samples, &mut states);
    assert_eq!(Some(&done.expect("a run").end), states.last());
    states
}

#[test]
fn a_constant_excitation_does_not_move_a_body_that_starts_quasi_statically() {
    let wrench = [[150.0, -900.0, 400.0, 60.0, -80.0, 120.0]; 50];
    let acceleration = [[2.0, 0.3, -0.4]; 50];
    let time = ticks(50, 0.002);
    let excitation = Excitation::new(&time, &acceleration, Some(&wrench)).expect("sound");
    for machine in [cart(), curved(), cart_clear(), preloaded_cart()] {
        let smooth = !machine.links[0].law().is_piecewise_linear();
        let mut runs = vec![
            states(&machine, &Rk45, Start::QuasiStatic, &excitation),
            states(&machine, &Radau, Start::QuasiStatic, &excitation),
        ];
        if !smooth {
            runs.push(states(&machine, &Exact, Start::QuasiStatic, &excitation));
        }
        // The force on the body balances: the guides carry weight, inertia and external load in all free degrees of freedom.
        let system = machine.system();
        let load = at(&machine.guide_load(&system), &runs[0][0]);
        let inertia = system.matrices().mass.fixed_view::<6, 3>(0, 0) * Vector3::from(acceleration[0]);
        let given = system.matrices().weight + Vector6::from(wrench[0]) - inertia;
        for dof in machine.free.iter() {
            close(load[dof as usize], given[dof as usize], 1e-10, given.amax());
        }
        for states in runs {
            assert_eq!(states.len(), 50);
            let loads = machine.loads_of(&states);
            let first = loads[..machine.links.len()].repeat(50);
            alike(&loads, &first, 1e-9);
            assert!(largest(&loads) > 1000.0);
        }
    }
}

#[test]
fn a_run_continues_from_the_state_of_another() {
    let mut random = Random::new(91);
    let mut machines: Vec<_> = (0..3).map(|_| random_machine(&mut random)).collect();
    machines.extend([cart(), curved(), cart_clear(), preloaded_cart()]);
    for machine in machines {
        let acceleration = noise(&mut random, 61);
        let time = ticks(61, 0.001);
        let excitation = |from: usize, to: usize| {
            Excitation::new(&time[from..to], &acceleration[from..to], None).expect("sound")
        };
        let smooth = !machine.links[0].law().is_piecewise_linear();
        let run = |start, excitation: &Excitation| {
            if smooth {
                states(&machine, &Radau, start, excitation)
            } else {
                states(&machine, &Exact, start, excitation)
            }
        };
        let whole = run(Start::AtRest, &excitation(0, 61));
        let first = run(Start::AtRest, &excitation(0, 31));
        let system = machine.system();
        let last = first.last().expect("states");
        let start =
            Start::State { position: at(&position(&system), last), velocity: at(&velocity(&system), last) };
        let rest = run(start, &excitation(30, 61));
        alike(&machine.loads_of(&rest), &machine.loads_of(&whole[30..]), 1e-9);
    }
}

#[test]
fn a_zero_first_sample_changes_no_bit() {
    let mut random = Random::new(92);
    let mut acceleration = noise(&mut random, 40);
    acceleration[0] = [0.0; 3];
    let excitation = Excitation::uniform(0.0, 1e-3, &acceleration).expect("sound");
    for machine in [cart(), curved(), cart_clear()] {
        let [rest, still] =
            [Start::AtRest, Start::QuasiStatic].map(|start| states(&machine, &Exact, start, &excitation));
        assert_eq!(rest, still);
    }
}

#[test]
fn batches_start_as_single_runs_do() {
    let mut random = Random::new(93);
    let acceleration = noise(&mut random, 200);
    let excitation = Excitation::uniform(0.0, 2e-3, &acceleration).expect("sound");
    for machine in [cart(), curved()] {
        let groups = [Group::new((0..4).collect(), Vector3::zeros())];
        let names = ["start", "max", "min", "rms"];
        let measures: Vec<Measure> =
            names.iter().flat_map(|name| Measure::from_names("resultant", 0, name)).collect();
        let motion = Motion { excitation, speed: None, exponent: 3.0 };
        for start in [Start::AtRest, Start::QuasiStatic] {
            let batch =
                Batch::new(base(&machine, &groups), motion, &[], &measures, None, 1e-6).expect("a batch");
            let mut out = [0.0; 4];
            let failures = batch.with_start(start).at_samples().run(1, &[], 1, &mut out).expect("a run");
            assert!(failures.is_empty());
            let states = states(&machine, &Exact, start, &excitation);
            let want =
                measures_of(&machine, &groups, &motion, &excitation, &states, polynomial_bows, &measures);
            alike(&out, &want, 1e-12);
        }
    }
}

#[test]
fn starts_that_no_machine_has_are_refused() {
    let excitation = Excitation::uniform(0.0, 0.1, &[[0.0, -30.0, 0.0]; 3]).expect("sound");
    let body = Body::new(10.0, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let law = sided(0.0, 1e6, 0.0);
    let links = vec![Link::with_law(Vector3::zeros(), Vector3::y(), law, 100.0).expect("a link")];
    let lifted = Machine { body, links, gravity: GRAVITY, free: Free::only(&[Dof::Y]) };
    let (method, mut states): (_, Vec<State>) = (NamedMethod::Exact, Vec::new());
    let mut refused = |machine: &Machine, start: Start| {
        let run = method.run(&machine.system(), ADAPTIVE, start, &excitation, Output::Samples, &mut states);
        run.expect_err("refused")
    };
    let error = refused(&lifted, Start::QuasiStatic);
    assert!(matches!(error, RunError::NoQuasiStaticState { .. }));
    assert!(error.to_string().contains("translation along y; start at rest"), "{error}");
    let mut velocity = Vector6::zeros();
    velocity[0] = 0.1;
    let error = refused(&cart(), Start::State { position: Vector6::zeros(), velocity });
    assert_eq!(error.to_string(), "start.velocity.x: expected 0, as this degree of freedom is held, got 0.1");
    let position = Vector6::from_element(f64::NAN);
    let error = refused(&cart(), Start::State { position, velocity: Vector6::zeros() });
    assert!(matches!(error, RunError::StartState { component: 0, .. }));
}

/// The cart with a payload, a point mass on a rod of no mass.
fn loaded(mass: f64, place: Vector3<f64>) -> Machine {
    let mut machine = cart();
    let (body, total) = (machine.body, machine.body.mass() + mass);
    let center = (body.mass() * body.center_of_mass() + mass * place) / total;
    let about = |m: f64, arm: Vector3<f64>| {
        m * (Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose())
    };
    let inertia =
        body.inertia() + about(body.mass(), body.center_of_mass() - center) + about(mass, place - center);
    machine.body = Body::new(total, center, inertia).expect("a body");
    machine
}

#[test]
fn a_grip_conserves_momentum_and_a_release_velocity() {
    let (empty, full) = (cart(), loaded(300.0, Vector3::new(0.2, 0.4, -0.3)));
    let mut random = Random::new(94);
    let acceleration = noise(&mut random, 40);
    let excitation = Excitation::uniform(0.0, 1e-3, &acceleration).expect("sound");
    let (e, f) = (empty.system(), full.system());
    let moved =
        |machine: &Machine| *states(machine, &Exact, Start::AtRest, &excitation).last().expect("states");
    for (from, end, to, grips) in [(&e, moved(&empty), &f, true), (&f, moved(&full), &e, false)] {
        let kept = &e;
        let Start::State { position: there, velocity: after } = Start::after_change(from, &end, kept, to)
        else {
            panic!("a state")
        };
        let before = at(&velocity(from), &end);
        assert_eq!(there, at(&position(from), &end));
        if !grips {
            assert_eq!(after, before);
            continue;
        }
        let (m, before_mass) = (to.matrices().mass, from.matrices().mass);
        let momentum = m * after - before_mass * before;
        for dof in Dof::ALL {
            if empty.free.contains(dof) {
                close(momentum[dof as usize], 0.0, 1e-13, (before_mass * before).amax());
            } else {
                assert_eq!(after[dof as usize], 0.0);
            }
        }
        // The loss is the energy of an inelastic impact: half of the joining mass times the square of each velocity that it takes.
        let loss = 0.5 * before.dot(&(before_mass * before)) - 0.5 * after.dot(&(m * after));
        let (slip, joined) = (before - after, m - before_mass);
        let expected = 0.5 * slip.dot(&(before_mass * slip)) + 0.5 * after.dot(&(joined * after));
        close(loss, expected, 1e-12, loss);
        assert!(loss > 0.0);
    }
}
