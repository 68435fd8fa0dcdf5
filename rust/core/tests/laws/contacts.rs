//! Contact changes: piecewise linear links, and preloaded links whose rows open.

use core::f64::consts::PI;

use guideload::{
    Body, Control, Dof, Exact, Excitation, Extremes, Free, Law, Link, ModelLevel, Output, Part, Peaks, Radau,
    Rk45, SceneError, State, System, group_load, run,
};
use guideload::{acceleration, reaction};
use nalgebra::{Matrix3, Vector3};

use crate::common::{
    ADAPTIVE, GRAVITY, Machine, Random, alike, body, cart, close, cycle, difference, largest, noise, one_dof,
    random_machine,
};

/// The machine with other laws; `law` receives the index and the stiffness of each link.
fn with_laws(mut machine: Machine, mut law: impl FnMut(usize, f64) -> Law) -> Machine {
    for (i, link) in machine.links.iter_mut().enumerate() {
        let law = law(i, link.stiffness());
        *link = Link::with_law(link.point(), link.direction(), law, link.damping()).expect("a sound link");
    }
    machine
}

fn clear(k: f64, clearance: f64) -> Law {
    Law::sided(k, k, clearance).expect("a law")
}

fn cart_clear() -> Machine {
    with_laws(cart(), |_, k| clear(k, 5e-6))
}

/// Clearance, sides and curves in turn, some dampers in contact only.
fn any_machine(random: &mut Random) -> Machine {
    let mut machine = random_machine(random);
    let weight = machine.body.mass() * machine.gravity.norm();
    machine = with_laws(machine, |i, k| {
        let sag = weight / k;
        match i % 4 {
            0 => clear(k, sag * random.between(0.05, 0.5)),
            1 => Law::sided(k, 0.4 * k, 0.0).expect("a law"),
            2 => {
                let points = [[-2.0, -1.5], [-0.5, -0.6], [0.0, 0.0], [0.3, 0.5], [1.0, 2.0]];
                Law::curve(&points.map(|[d, f]| [d * sag, f * k * sag])).expect("a law")
            }
            _ => Law::linear(k).expect("a law"),
        }
    });
    for (i, link) in machine.links.iter_mut().enumerate().filter(|(i, _)| i % 8 == 4) {
        *link = link.damped_in_contact().unwrap_or_else(|error| panic!("link {i}: {error}"));
    }
    machine
}

/// A sudden push from rest, where every link is far from its edges: bounds from the time before do not hold any more.
#[test]
fn a_jump_is_seen_by_the_search_for_contact_changes() {
    let (omega, c) = (2000.0, 2e-5);
    let mut machine = with_laws(one_dof(omega, 0.0), |_, k| clear(k, c));
    machine.gravity = Vector3::zeros();
    // 4 ms at 10 m/s2 lead to the stop and back into the gap, and after the end of the jump once to the other side.
    let time = [0.0, 1.0, 1.0, 1.006, 1.006, 1.016];
    let samples =
        [[0.0; 3], [0.0; 3], [0.0, -10.0, 0.0], [0.0, -10.0, 0.0], [0.0, 60.0, 0.0], [0.0, 60.0, 0.0]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let coarse = machine.exact_loads(&excitation);
    let mut times = vec![0.0];
    let mut finer = vec![[0.0; 3]];
    let mut at = vec![0];
    for (k, parts) in [1, 0, 600, 0, 1000].into_iter().enumerate() {
        if parts == 0 {
            times.push(time[k + 1]);
            finer.push(samples[k + 1]);
        }
        for part in 1..=parts {
            let theta = f64::from(part) / f64::from(parts);
            times.push((1.0 - theta) * time[k] + theta * time[k + 1]);
            finer.push(samples[k + 1]);
        }
        at.push(times.len() - 1);
    }
    let fine = Excitation::new(&times, &finer, None).expect("sound");
    let (states, summary) = machine.states(&Exact::<16>, ADAPTIVE, &fine);
    assert!(summary.contact_changes >= 4, "{summary:?}");
    let states: Vec<State> = at.into_iter().map(|k| states[k]).collect();
    alike(&coarse, &machine.loads_of(&states), 1e-10);
}

/// Each interval between samples divided into `parts`.
pub(crate) fn refined(time: &[f64], samples: &[[f64; 3]], parts: usize) -> (Vec<f64>, Vec<[f64; 3]>) {
    let (mut times, mut refined) = (vec![time[0]], vec![samples[0]]);
    for k in 1..time.len() {
        for part in 1..=parts {
            let theta = part as f64 / parts as f64;
            let between = |a: f64, b: f64| (1.0 - theta) * a + theta * b;
            times.push(between(time[k - 1], time[k]));
            refined.push(core::array::from_fn(|i| between(samples[k - 1][i], samples[k][i])));
        }
    }
    (times, refined)
}

#[test]
fn the_exact_solution_does_not_depend_on_the_choice_of_samples() {
    let mut random = Random::new(301);
    for _ in 0..6 {
        let machine = any_machine(&mut random);
        assert_eq!(machine.system().model_level(), ModelLevel::PiecewiseLinear);
        let samples = noise(&mut random, 60);
        let mut time = vec![0.0];
        for k in 1..60 {
            time.push(time[k - 1] + random.between(1e-4, 6e-3));
        }
        let excitation = Excitation::new(&time, &samples, None).expect("sound");
        let (states, summary) = machine.states(&Exact::<16>, ADAPTIVE, &excitation);
        assert!(summary.contact_changes > 10, "{summary:?}");
        let loads = machine.loads_of(&states);
        for parts in [2, 7, 40] {
            let (times, finer) = refined(&time, &samples, parts);
            let finer = Excitation::new(&times, &finer, None).expect("sound");
            let (states, changes) = machine.states(&Exact::<16>, ADAPTIVE, &finer);
            let states: Vec<State> = states.into_iter().step_by(parts).collect();
            // Rounding decides on which side of a sample a change counts, and whether two grazing changes count. The loads are the same.
            assert!(changes.contact_changes.abs_diff(summary.contact_changes) <= 2);
            alike(&machine.loads_of(&states), &loads, 1e-10);
        }
    }
}

#[test]
fn step_methods_land_on_contact_changes() {
    let mut random = Random::new(302);
    for machine in [cart_clear(), any_machine(&mut random), any_machine(&mut random)] {
        let samples = cycle()[580..780].to_vec();
        let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
        let exact = machine.exact_loads(&excitation);
        let control = Control::Adaptive { rtol: 1e-11 };
        for loads in [
            machine.loads_of(&machine.states(&Rk45, control, &excitation).0),
            machine.loads_of(&machine.states(&Radau, control, &excitation).0),
        ] {
            alike(&loads, &exact, 1e-9);
        }
    }
}

/// Steps that end at contact changes keep the order 5 of the method; steps over a change of slope would have order 2.
#[test]
fn rk45_keeps_its_order_where_contacts_change() {
    let machine = cart_clear();
    let time = [0.0, 0.05];
    let samples = [[0.0; 3], [1.5, 0.0, 0.0]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let end = |states: Vec<State>| machine.loads_of(&states[1..]);
    let (states, summary) = machine.states(&Exact::<16>, ADAPTIVE, &excitation);
    let exact = end(states);
    assert!(summary.contact_changes >= 6, "{summary:?}");
    let error = |steps: f64| {
        let (states, _) = machine.states(&Rk45, Control::Fixed { step: 0.05 / steps }, &excitation);
        difference(&end(states), &exact)
    };
    let order = (error(400.0) / error(800.0)).ln() / 2f64.ln();
    close(order, 5.0, 0.1, 1.0);
}

/// Where a preloaded row opens, the force has a term of power 3/2, so its slope is Hölder continuous with exponent 1/2. A step across the
/// opening has an error of `h^(5/2)`, and so has the run: between order 2 of a kink and order 5 of smooth equations.
#[test]
fn across_the_opening_of_a_preload_the_order_is_two_and_a_half_or_more() {
    let mut machine = with_laws(one_dof(200.0, 0.02), |_, k| Law::preloaded(k, 60.0, 1.5).expect("a law"));
    machine.gravity = Vector3::zeros();
    let (time, samples) = ([0.0, 0.3], [[0.0, 1.5, 0.0]; 2]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let end = |control| machine.loads_of(&machine.states(&Rk45, control, &excitation).0[1..])[0];
    let truth = end(Control::Fixed { step: 0.3 / 50_000.0 });
    // The constant depends on the position of the edge within a step, hence an envelope over neighbouring numbers of steps.
    let error = |steps: usize| {
        (0..12)
            .map(|i| (end(Control::Fixed { step: 0.3 / (steps + 7 * i) as f64 }) - truth).abs())
            .fold(0.0, f64::max)
    };
    let order = (error(300) / error(2400)).ln() / 8f64.ln();
    assert!((2.4..3.6).contains(&order), "order {order}");
}

/// Between two elastic walls a body without damping and weight flies freely, and each contact lasts half a sine: `T = 2 (2 c / v + π / ω)`.
#[test]
fn a_body_bounces_between_its_stops_without_loss() {
    let (omega, c): (f64, f64) = (2000.0, 2e-5);
    let mut machine = with_laws(one_dof(omega, 0.0), |_, k| clear(k, c));
    machine.gravity = Vector3::zeros();
    // A push of 1 ms, then no excitation for some hundred periods.
    let v = -0.01;
    let (kick, mass) = (1e-3, machine.body.mass());
    let period = 2.0 * (2.0 * c / 0.01 + PI / omega);
    let time = [0.0, kick, kick, kick + 200.0 * period, kick + 200.25 * period];
    let on = [0.0, -v / kick, 0.0];
    let samples = [on, on, [0.0; 3], [0.0; 3], [0.0; 3]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (states, summary) = machine.states(&Exact::<16>, ADAPTIVE, &excitation);
    assert!(summary.contact_changes.abs_diff(800) <= 2, "{summary:?}");
    let energy = |state: &State| {
        let system = machine.system();
        let q = guideload::position(&system).at(state, &[0.0; 9])[1];
        let rate = guideload::velocity(&system).at(state, &[0.0; 9])[1];
        machine.links[0].law().energy(q) + 0.5 * mass * rate * rate
    };
    for k in [2, 3, 4] {
        close(energy(&states[k]), 0.5 * mass * v * v, 1e-9, 0.5 * mass * v * v);
    }
    let position = |state: &State| {
        let system = machine.system();
        guideload::position(&system).at(state, &[0.0; 9])[1]
    };
    close(position(&states[3]), position(&states[2]), 1e-6, c);
}

/// A path that just reaches an edge, or just misses it, costs no more than others, and the loads are right in both cases.
#[test]
fn grazing_is_nothing_special() {
    for miss in [-1e-6, -1e-9, -1e-12, 0.0, 1e-12, 1e-9, 1e-6] {
        let (mass, k) = (100.0, 1e7);
        let omega = f64::sqrt(k / mass);
        // Under a constant push the body moves to twice its static deflection, exactly the edge of the stiffer side.
        let push = 2.0;
        let edge = 2.0 * push / (omega * omega) * (1.0 + miss);
        let law =
            Law::curve(&[[-edge, -k * edge], [0.0, 0.0], [edge, k * edge], [2.0 * edge, 5.0 * k * edge]]);
        let mut machine = with_laws(one_dof(omega, 0.0), |_, _| law.expect("a law"));
        machine.gravity = Vector3::zeros();
        let samples = vec![[0.0, -push, 0.0]; 200];
        let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
        let (states, summary) = machine.states(&Exact::<16>, ADAPTIVE, &excitation);
        assert!(summary.steps <= 199 + 2 * 14 && summary.contact_changes <= 2 * 14, "{miss:e} {summary:?}");
        let loads = machine.loads_of(&states);
        for (i, load) in loads.iter().enumerate() {
            let smooth = mass * push * (1.0 - (omega * i as f64 * 1e-3).cos());
            close(*load, smooth, 1e-9 + 20.0 * miss.abs(), 2.0 * mass * push);
        }
    }
}

/// A body dropped onto a stiff stop that damps only in contact bounces lower each time and comes to rest; the force jumps at every contact.
#[test]
fn a_dropped_body_chatters_and_comes_to_rest() {
    let (mass, k, c) = (100.0, 1e8, 1e-4);
    let link = |b| Link::with_law(Vector3::zeros(), Vector3::y(), clear(k, c), b).expect("a link");
    let body = Body::new(mass, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let links = vec![link(5e3).damped_in_contact().expect("a clearance")];
    let machine = Machine { body, links, gravity: GRAVITY, free: Free::only(&[Dof::Y]) };
    // Lifted off its stop by 2 g for 5 ms, then in free fall.
    let time = [0.0, 0.005, 0.005, 2.0];
    let lift = [0.0, -2.0 * 9.80665, 0.0];
    let samples = [lift, lift, [0.0; 3], [0.0; 3]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (states, summary) = machine.states(&Exact::<16>, ADAPTIVE, &excitation);
    assert!((6..2000).contains(&summary.contact_changes), "{summary:?}");
    let load = machine.loads_of(&states[3..])[0];
    close(load, -mass * 9.80665, 1e-6, mass * 9.80665);
}

#[test]
fn laws_without_edges_give_the_linear_scene() {
    let samples = cycle()[500..1500].to_vec();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let linear = cart().exact_loads(&excitation);
    let far = [[-1.0, -6e7], [0.0, 0.0], [1.0, 6e7], [2.0, 18e7]];
    let machine = with_laws(cart(), |_, _| Law::curve(&far).expect("a law"));
    assert_eq!(machine.system().model_level(), ModelLevel::PiecewiseLinear);
    alike(&machine.exact_loads(&excitation), &linear, 1e-12);
    // With a preload of a thousand times the loads, the law is its tangent at zero deflection.
    let machine = with_laws(cart(), |_, k| Law::preloaded(k, 1e7, 1.5).expect("a law"));
    let (states, _) = machine.states(&Radau, Control::Adaptive { rtol: 1e-11 }, &excitation);
    alike(&machine.loads_of(&states), &linear, 1e-8);
}

/// Force and moment of the guides and the reactions balance weight and inertia.
#[test]
fn momentum_balances_whatever_the_laws() {
    let mut random = Random::new(303);
    let preloaded = with_laws(cart(), |i, k| match i % 2 {
        0 => Law::preloaded(k, 600.0, 1.5).expect("a law"),
        _ => clear(k, 3e-6),
    });
    for machine in [cart_clear(), preloaded, any_machine(&mut random).with_free(Free::PAPER)] {
        let samples = noise(&mut random, 50);
        let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
        let system = machine.system();
        let (states, _) = match system.model_level() {
            ModelLevel::SmoothNonlinear => machine.states(&Rk45, ADAPTIVE, &excitation),
            _ => machine.states(&Exact::<16>, ADAPTIVE, &excitation),
        };
        let guides = group_load(&system, 0..machine.links.len(), Vector3::zeros(), Part::Total);
        let (held, moves) = (reaction(&system), acceleration(&system));
        let matrices = system.matrices();
        for (k, state) in states.iter().enumerate() {
            let input = excitation.input(k);
            let wrench = |of: &guideload::Wrench| nalgebra::Vector6::from(of.at(state, &input));
            let drive = nalgebra::Vector6::new(input[0], input[1], input[2], 0.0, 0.0, 0.0);
            let inertia = matrices.mass * (wrench(&moves) + drive);
            let left = wrench(&held) + matrices.weight - wrench(&guides) - inertia;
            assert!(left.amax() <= 1e-11 * wrench(&guides).amax().max(inertia.amax()), "{k}: {left}");
        }
    }
}

#[test]
fn parts_of_a_load_add_up_and_dampers_rest_out_of_contact() {
    let mut machine = cart_clear();
    for link in &mut machine.links {
        *link = link.damped_in_contact().expect("a clearance");
    }
    let samples = cycle()[580..700].to_vec();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let (states, _) = machine.states(&Exact::<16>, ADAPTIVE, &excitation);
    let system = machine.system();
    let (mut open, mut shut) = (0, 0);
    for link in 0..machine.links.len() {
        let load = |part| guideload::link_load(&system, link, part);
        let [total, elastic, damping] = [Part::Total, Part::Elastic, Part::Damping].map(load);
        for state in &states {
            let at = |load: &guideload::Axial| load.at(state, &[0.0; 9])[0];
            close(at(&total), at(&elastic) + at(&damping), 1e-15, at(&total).abs().max(1.0));
            if at(&elastic) == 0.0 {
                assert_eq!(at(&damping), 0.0);
                open += 1;
            } else {
                shut += 1;
            }
        }
    }
    assert!(open > 100 && shut > 100);
}

#[test]
fn peaks_and_instants_between_samples_are_those_of_a_finer_run() {
    let machine = cart_clear();
    let samples = cycle()[580..700].to_vec();
    let time: Vec<f64> = (0..samples.len()).map(|k| k as f64 * 1e-3).collect();
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (times, finer) = refined(&time, &samples, 5);
    let finer = Excitation::new(&times, &finer, None).expect("sound");
    let fine = machine.exact_loads(&finer);
    let (states, outcome) = machine.run(&Exact::<16>, ADAPTIVE, &excitation, Output::Times(&times));
    outcome.expect("a run that succeeds");
    alike(&machine.loads_of(&states), &fine, 1e-11);

    let system = machine.system();
    let loads = [group_load(&system, 0..4, Vector3::zeros(), Part::Total)];
    let mut extremes = [Extremes::NONE];
    run(
        &system,
        &Exact::<16>,
        ADAPTIVE,
        &finer,
        Output::Samples,
        &mut Peaks::new(&system, &finer, &loads, &mut extremes),
    )
    .expect("a run that succeeds");
    let history: Vec<f64> = states.iter().map(|state| loads[0].at(state, &[0.0; 9])[1]).collect();
    close(
        extremes[0].smallest[1],
        history.iter().copied().fold(f64::INFINITY, f64::min),
        1e-11,
        largest(&history),
    );
}

#[test]
fn the_error_names_the_motion_of_a_body_unsupported_on_one_side() {
    let body = body();
    let law = Law::sided(0.0, 6e7, 0.0).expect("a law");
    // A link that resists to one side only; gravity points down, or up.
    let links: Vec<_> = cart()
        .links
        .iter()
        .map(|link| Link::with_law(link.point(), link.direction(), law, link.damping()).expect("a link"))
        .collect();
    let hanging = Machine { body, links, gravity: -GRAVITY, free: Free::only(&[Dof::Y]) };
    let error = System::new(&hanging.scene()).expect_err("nothing holds it");
    let SceneError::NoEquilibrium { motion } = error else { panic!("{error:?}") };
    assert_eq!(motion.as_slice(), [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let lying = Machine { gravity: GRAVITY, ..hanging };
    close(lying.system().static_position()[1], -1250.0 * 9.80665 / (8.0 * 6e7), 1e-13, 1e-5);
}

/// Within its clearance the cart can move in z and rotate: it rests at the most central position, and `free_at_rest` lists these motions.
#[test]
fn a_loose_body_rests_centred() {
    let system = cart_clear().system();
    assert_eq!(system.free_at_rest().len(), 2);
    for motion in system.free_at_rest() {
        let loose = cart_clear().links.iter().all(|link| {
            link.direction().y != 0.0 && link.row().dot(&motion).abs() < 1e-9 * motion.norm()
                || link.direction().z != 0.0
        });
        assert!(loose, "{motion}");
    }
    for link in cart_clear().links.iter().filter(|link| link.direction().z != 0.0) {
        close(link.row().dot(&system.static_position()), 0.0, 1e-12, 5e-6);
    }
}

#[test]
fn the_exact_method_refuses_preloaded_links() {
    let machine = with_laws(cart(), |i, k| match i {
        3 => Law::preloaded(k, 600.0, 10.0 / 9.0).expect("a law"),
        _ => Law::linear(k).expect("a law"),
    });
    let excitation = Excitation::uniform(0.0, 1e-3, &[[0.0; 3]; 2]).expect("sound");
    let (_, outcome) = machine.run(&Exact::<16>, ADAPTIVE, &excitation, Output::Samples);
    let error = outcome.expect_err("no exact solution");
    assert!(error.to_string().contains("links[3]"), "{error}");
}
