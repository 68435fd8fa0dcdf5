//! Contact changes: piecewise linear links, and preloaded links whose rows open.

use core::f64::consts::PI;

use guideload::{
    Body, Control, Dof, Exact, Excitation, Extremes, Free, Law, Link, ModelLevel, Output, Part, Peaks, Radau,
    Rk45, SceneError, State, Summary, System, group_load, position, run, velocity,
};
use nalgebra::{Matrix3, Vector3};

use crate::common::{
    ADAPTIVE, GRAVITY, Machine, Random, adaptive, alike, any_machine, at, cart, cart_clear, close, curve,
    cycle, difference, largest, linear, noise, one_dof, preloaded, sided, ticks,
};

/// A sudden push from rest, where every link is far from its edges: bounds from the time before do not hold any more.
#[test]
fn a_jump_is_seen_by_the_search_for_contact_changes() {
    let (omega, c) = (2000.0, 2e-5);
    let mut machine = one_dof(omega, 0.0).with_laws(|_, k| sided(k, k, c));
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
    let (states, summary) = machine.states(&Exact, ADAPTIVE, &fine);
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
        let (states, summary) = machine.states(&Exact, ADAPTIVE, &excitation);
        assert!(summary.contact_changes > 10, "{summary:?}");
        let loads = machine.loads_of(&states);
        for parts in [2, 7, 40] {
            let (times, finer) = refined(&time, &samples, parts);
            let finer = Excitation::new(&times, &finer, None).expect("sound");
            let (states, changes) = machine.states(&Exact, ADAPTIVE, &finer);
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
        let control = adaptive(1e-11);
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
    let truth = machine.states(&Exact, ADAPTIVE, &excitation);
    close(rk45_order(&machine, &excitation, truth), 5.0, 0.1, 1.0);
}

/// Observed order of rk45 over some contact changes, given the states of the true solution.
pub(crate) fn rk45_order(
    machine: &Machine,
    excitation: &Excitation,
    (states, summary): (Vec<State>, Summary),
) -> f64 {
    assert!(summary.contact_changes >= 6, "{summary:?}");
    let truth = machine.loads_of(&states[1..]);
    let error = |steps: f64| {
        let control = Control::Fixed { step: excitation.duration() / steps };
        let (states, _) = machine.states(&Rk45, control, excitation);
        difference(&machine.loads_of(&states[1..]), &truth)
    };
    (error(400.0) / error(800.0)).ln() / 2f64.ln()
}

/// Where a preloaded row opens, the force has a term of power 3/2, so its slope is Hölder continuous with exponent 1/2. A step across the
/// opening has an error of `h^(5/2)`, and so has the run: between order 2 of a kink and order 5 of smooth equations.
#[test]
fn across_the_opening_of_a_preload_the_order_is_two_and_a_half_or_more() {
    let mut machine = one_dof(200.0, 0.02).with_laws(|_, k| preloaded(k, 60.0, 1.5));
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
    let mut machine = one_dof(omega, 0.0).with_laws(|_, k| sided(k, k, c));
    machine.gravity = Vector3::zeros();
    // A push of 1 ms, then no excitation for some hundred periods.
    let v = -0.01;
    let (kick, mass) = (1e-3, machine.body.mass());
    let period = 2.0 * (2.0 * c / 0.01 + PI / omega);
    let time = [0.0, kick, kick, kick + 200.0 * period, kick + 200.25 * period];
    let on = [0.0, -v / kick, 0.0];
    let samples = [on, on, [0.0; 3], [0.0; 3], [0.0; 3]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (states, summary) = machine.states(&Exact, ADAPTIVE, &excitation);
    assert!(summary.contact_changes.abs_diff(800) <= 2, "{summary:?}");
    let system = machine.system();
    let [place, rate] = [position(&system), velocity(&system)]
        .map(|motion| states.iter().map(|state| at(&motion, state)[1]).collect::<Vec<f64>>());
    for k in [2, 3, 4] {
        let energy = machine.links[0].law().energy(place[k]) + 0.5 * mass * rate[k] * rate[k];
        close(energy, 0.5 * mass * v * v, 1e-9, 0.5 * mass * v * v);
    }
    close(place[3], place[2], 1e-6, c);
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
        let mut machine = one_dof(omega, 0.0).with_laws(|_, _| law.expect("a law"));
        machine.gravity = Vector3::zeros();
        let samples = vec![[0.0, -push, 0.0]; 200];
        let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
        let (states, summary) = machine.states(&Exact, ADAPTIVE, &excitation);
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
    let link = |b| Link::with_law(Vector3::zeros(), Vector3::y(), sided(k, k, c), b).expect("a link");
    let body = Body::new(mass, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let links = vec![link(5e3).damped_in_contact().expect("a clearance")];
    let machine = Machine { body, links, gravity: GRAVITY, free: Free::only(&[Dof::Y]) };
    // Lifted off its stop by 2 g for 5 ms, then in free fall.
    let time = [0.0, 0.005, 0.005, 2.0];
    let lift = [0.0, -2.0 * 9.80665, 0.0];
    let samples = [lift, lift, [0.0; 3], [0.0; 3]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (states, summary) = machine.states(&Exact, ADAPTIVE, &excitation);
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
    let machine = cart().with_laws(|_, _| curve(&far));
    assert_eq!(machine.system().model_level(), ModelLevel::PiecewiseLinear);
    alike(&machine.exact_loads(&excitation), &linear, 1e-12);
    // With a preload of a thousand times the loads, the law is its tangent at zero deflection.
    let machine = cart().with_laws(|_, k| preloaded(k, 1e7, 1.5));
    let (states, _) = machine.states(&Radau, adaptive(1e-11), &excitation);
    alike(&machine.loads_of(&states), &linear, 1e-8);
}

#[test]
fn parts_of_a_load_add_up_and_dampers_rest_out_of_contact() {
    let machine = cart_clear().damped_in_contact();
    let samples = cycle()[580..700].to_vec();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let (states, _) = machine.states(&Exact, ADAPTIVE, &excitation);
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
    let time = ticks(samples.len(), 1e-3);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (times, finer) = refined(&time, &samples, 5);
    let finer = Excitation::new(&times, &finer, None).expect("sound");
    let fine = machine.exact_loads(&finer);
    let (states, outcome) = machine.run(&Exact, ADAPTIVE, &excitation, Output::Times(&times));
    outcome.expect("a run that succeeds");
    alike(&machine.loads_of(&states), &fine, 1e-11);

    let system = machine.system();
    let loads = [group_load(&system, 0..4, Vector3::zeros(), Part::Total)];
    let mut extremes = [Extremes::NONE];
    run(
        &system,
        &Exact,
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
    // Links that resist to one side only; gravity points up, or down.
    let one_sided = cart().with_laws(|_, _| sided(0.0, 6e7, 0.0));
    let hanging = Machine { gravity: -GRAVITY, free: Free::only(&[Dof::Y]), ..one_sided };
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
    let machine = cart().with_laws(|i, k| match i {
        3 => preloaded(k, 600.0, 10.0 / 9.0),
        _ => linear(k),
    });
    let excitation = Excitation::uniform(0.0, 1e-3, &[[0.0; 3]; 2]).expect("sound");
    let (_, outcome) = machine.run(&Exact, ADAPTIVE, &excitation, Output::Samples);
    let error = outcome.expect_err("no exact solution");
    assert!(error.to_string().contains("links[3]"), "{error}");
}
