//! Offsets of the feet of links: mounting errors and rails of unequal height.

use guideload::batch::{Batch, Measure, Motion, Quantity, Statistic, Target};
use guideload::{Dof, Exact, Excitation, Free, Law, Link, NamedMethod, Radau, Rk45, SceneError, System};
use nalgebra::Vector6;

use crate::batch::{base, by_hand, cart_on, change};
use crate::common::{
    ADAPTIVE, Machine, Random, adaptive, alike, at, cart, close, curve, cycle, largest, linear, preloaded,
    random_machine, sided,
};

fn laws() -> [Law; 4] {
    [
        linear(6e7),
        sided(6e7, 4e7, 3e-6),
        preloaded(6e7, 800.0, 1.5),
        curve(&[[-2e-5, -900.0], [0.0, 0.0], [1e-5, 300.0], [3e-5, 2000.0]]),
    ]
}

/// The machine with its feet moved as a rigid body moves by `q`, plus `extra` at each link.
fn moved(mut machine: Machine, q: &Vector6<f64>, mut extra: impl FnMut(usize) -> f64) -> Machine {
    for (index, link) in machine.links.iter_mut().enumerate() {
        *link = link.with_offset(link.row().dot(q) + extra(index)).expect("a link");
    }
    machine
}

/// Loads of the links at rest, N.
fn loads_at_rest(machine: &Machine) -> Vec<f64> {
    let system = machine.system();
    machine.link_loads(&system).iter().map(|load| load.at_rest()[0]).collect()
}

#[test]
fn feet_that_move_as_a_rigid_body_move_the_body_and_no_load() {
    let q = Vector6::new(0.0, 3e-4, -2e-4, 1e-4, 2e-4, -1e-4);
    for law in laws() {
        let straight = cart_on(law).0;
        let tilted = moved(straight.clone(), &q, |_| 0.0);
        alike(&loads_at_rest(&tilted), &loads_at_rest(&straight), 1e-9);
        let shift = tilted.system().static_position() - straight.system().static_position();
        assert!((shift - q).amax() <= 1e-9 * q.amax(), "{law:?}: {shift}");
    }
}

#[test]
fn two_springs_share_the_offset_of_one_as_springs_in_series() {
    let (mut machine, e) = (cart().with_free(Free::only(&[Dof::Y])), 2e-5);
    let vertical = |stiffness: f64, offset: f64| {
        let link = Link::new(Default::default(), nalgebra::Vector3::y(), stiffness, 1e4).expect("a link");
        link.with_offset(offset).expect("a link")
    };
    machine.gravity.fill(0.0);
    machine.links = vec![vertical(8e7, e), vertical(2e7, 0.0)];
    let force = 8e7 * 2e7 / (8e7 + 2e7) * e;
    let loads = loads_at_rest(&machine);
    close(loads[0], -force, 1e-14, force); // the raised foot pushes the body up
    close(loads[1], force, 1e-14, force);
    close(machine.system().static_position()[1], 0.8 * e, 1e-14, e);
}

#[test]
fn a_moved_clearance_is_a_moved_curve() {
    let (c, k, e) = (3e-6, 6e7, 2e-6);
    let (clear, _) = cart_on(sided(k, k, c));
    // Only motions that the weight decides: across its clearance the body could start at any place.
    let clear = clear.with_free(Free::only(&[Dof::Y, Dof::Rx, Dof::Rz]));
    let clear = moved(clear, &Vector6::zeros(), |index| if index < 8 { e } else { -e });
    let curved = clear.clone().with_laws(|index, _| {
        let by = if index < 8 { e } else { -e };
        let points = [[-1e-4 - c + by, -k * 1e-4], [-c + by, 0.0], [c + by, 0.0], [1e-4 + c + by, k * 1e-4]];
        curve(&points)
    });
    alike(&loads_at_rest(&clear), &loads_at_rest(&curved), 1e-9);
    let motion = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &motion[..1500]).expect("an excitation");
    alike(&clear.exact_loads(&excitation), &curved.exact_loads(&excitation), 1e-8);
}

#[test]
fn loads_balance_the_weight_and_rest_lasts_for_every_law_and_method() {
    let (mut random, motion) = (Random::new(5), [[0.0; 3]; 200]);
    let errors: Vec<f64> = (0..16).map(|_| random.between(-4e-6, 4e-6)).collect();
    let still = Excitation::uniform(0.0, 1e-3, &motion).expect("an excitation");
    for law in laws() {
        let machine = moved(cart_on(law).0, &Vector6::zeros(), |index| errors[index]);
        let system = machine.system();
        let carried = at(&machine.guide_load(&system), &[0.0; 12]);
        let weight = system.matrices().weight;
        for dof in machine.free.iter() {
            close(carried[dof as usize], weight[dof as usize], 1e-11, weight.amax());
        }
        for (link, load) in machine.links.iter().zip(loads_at_rest(&machine)) {
            let deflection = link.row().dot(&system.static_position()) - link.offset();
            close(load, link.law().force(deflection), 1e-9, largest(&loads_at_rest(&machine)));
        }
        let mut runs =
            vec![machine.states(&Rk45, ADAPTIVE, &still).0, machine.states(&Radau, ADAPTIVE, &still).0];
        if law.is_piecewise_linear() {
            runs.push(machine.states(&Exact, ADAPTIVE, &still).0);
        }
        for states in runs {
            alike(&machine.loads_of(&states), &loads_at_rest(&machine).repeat(states.len()), 1e-6);
        }
    }
}

#[test]
fn methods_agree_on_machines_with_mounting_errors() {
    let (mut random, motion) = (Random::new(6), cycle());
    let excitation = Excitation::uniform(0.0, 1e-3, &motion[..1500]).expect("an excitation");
    let machine = moved(cart_on(laws()[1]).0, &Vector6::zeros(), |_| random.between(-4e-6, 4e-6));
    let exact = machine.exact_loads(&excitation);
    let tight = adaptive(1e-10);
    let (states, _) = machine.states(&Rk45, tight, &excitation);
    alike(&machine.loads_of(&states), &exact, 1e-7);
}

#[test]
fn a_batch_varies_offsets_as_single_machines_have_them() {
    let motion = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &motion[..1200]).expect("an excitation");
    for (law, method) in [
        (laws()[0], Some(NamedMethod::Exact)),
        (laws()[0], Some(NamedMethod::Rk45)),
        (laws()[1], Some(NamedMethod::Exact)),
    ] {
        let (machine, groups) = cart_on(law);
        let changes: Vec<_> = (0..8).map(|link| change(Target::Offset(link), 1e-6, &[(0, 1.0)])).collect();
        let measures = [Measure::Load(0, Quantity::Fy, Statistic::Max), Measure::Drive(Statistic::Max)];
        let motion = Motion { excitation, speed: None, exponent: 3.0 };
        let batch = Batch::new(base(&machine, &groups), motion, &changes, &measures, method, 1e-9);
        let (values, mut rows) = ([0.0, -1e-6, 7e-6], [0.0; 6]);
        let failed = batch.expect("a batch").at_samples().run(3, &values, 1, &mut rows).expect("rows");
        assert!(failed.is_empty());
        for (value, row) in values.iter().zip(rows.as_chunks::<2>().0) {
            let one = moved(machine.clone(), &Vector6::zeros(), |i| if i < 8 { 1e-6 + value } else { 0.0 });
            let wanted = by_hand(&one, &groups, &motion, &excitation, &measures, Some(NamedMethod::Exact));
            close(row[0], wanted[0], 1e-7, 3000.0);
            close(row[1], wanted[1], 1e-7, 3000.0);
        }
    }
}

#[test]
fn machines_without_offsets_keep_their_bits() {
    let mut random = Random::new(9);
    let machine = random_machine(&mut random);
    let zero = moved(machine.clone(), &Vector6::zeros(), |_| 0.0);
    assert_eq!(loads_at_rest(&machine), loads_at_rest(&zero));
}

#[test]
fn an_offset_that_is_no_number_is_refused() {
    let link = Link::new(Default::default(), nalgebra::Vector3::y(), 1e7, 0.0).expect("a link");
    assert_eq!(link.with_offset(f64::NAN), Err(SceneError::NotFinite { field: "offset" }));
    let far = moved(cart(), &Vector6::new(0.0, 1e9, 0.0, 0.0, 0.0, 0.0), |_| 0.0);
    assert!(matches!(System::new(&far.scene()), Err(SceneError::FarEquilibrium { .. })));
}

#[test]
fn a_base_is_in_series_with_all_links() {
    let machine = cart().with_free(Free::only(&[Dof::Y]));
    let compliance = nalgebra::Matrix6::from_diagonal(&Vector6::new(0.0, 4e-9, 0.0, 0.0, 0.0, 0.0));
    let scene = machine.scene().on_base(compliance).expect("a base");
    let system = System::new(&scene).expect("a supported body");
    let weight = 1250.0 * 9.80665;
    let sag = weight * (1.0 / 4.8e8 + 4e-9);
    close(system.static_position()[1], -sag, 1e-13, sag);
    let frequency = nalgebra::ComplexField::sqrt(weight / sag / 1250.0);
    close(system.frequencies()[0], frequency, 1e-13, frequency);
    for (i, j, value) in [(1, 1, -1e-9), (0, 4, 1e-9)] {
        let mut impossible = nalgebra::Matrix6::zeros();
        (impossible[(i, j)], impossible[(j, i)]) = (value, value);
        assert!(matches!(machine.scene().on_base(impossible), Err(SceneError::BaseCompliance { .. })));
    }
    let (preloaded, _) = cart_on(laws()[2]);
    let refused = preloaded.scene().on_base(compliance);
    assert!(matches!(refused, Err(SceneError::NonlinearOnBase { link: 0, law: "preloaded" })));
}
