//! Static equilibrium, and bodies without it.

use guideload::{Body, Dof, Free, Law, Link, SceneError, System, assemble, carriage_ends};
use nalgebra::{Matrix3, Rotation3, Vector3, Vector6};

use crate::common::{GRAVITY, Machine, Random, at, cart, close, paper, random_machine, sided};

#[test]
fn stiffness_times_static_position_is_the_weight() {
    let mut random = Random::new(11);
    let mut machines: Vec<_> = (0..20).map(|_| random_machine(&mut random)).collect();
    machines.extend([cart(), paper()]);
    for machine in machines {
        let system = machine.system();
        let (k, weight) = (system.matrices().stiffness, system.matrices().weight);
        let missing = k * system.static_position() - weight;
        for dof in machine.free.iter() {
            // Backward stable: the residual is the rounding of K q, for any stiffness of a direction.
            let size = k.amax() * system.static_position().amax() + weight.amax();
            close(missing[dof as usize], 0.0, 1e-14, size);
        }
    }
}

fn unsupported(machine: &Machine) -> (Vector6<f64>, usize, String) {
    match System::new(&machine.scene()) {
        Err(error @ SceneError::Unsupported { motion, count }) => (motion, count, error.to_string()),
        other => panic!("expected Unsupported, got {other:?}"),
    }
}

/// No link resists the motion, and it moves no held degree of freedom.
#[track_caller]
fn assert_unresisted(machine: &Machine, motion: &Vector6<f64>) {
    close(motion.amax(), 1.0, 1e-15, 1.0);
    for link in &machine.links {
        // Entries below 1e-9 of the motion are rounded to zero for print.
        close(link.row().dot(motion), 0.0, 1e-8, 1.0);
    }
    for dof in Dof::ALL.into_iter().filter(|&dof| !machine.free.contains(dof)) {
        assert_eq!(motion[dof as usize], 0.0);
    }
}

fn links(rows: &[([f64; 3], [f64; 3])]) -> Vec<Link> {
    rows.iter()
        .map(|&(point, direction)| Link::new(point.into(), direction.into(), 6e7, 5e4).expect("a link"))
        .collect()
}

#[test]
fn one_rail_leaves_a_rotation_about_it() {
    let rail = links(&[
        ([-0.5, 0.05, 0.35], [0.0, 1.0, 0.0]),
        ([-0.5, 0.05, 0.35], [0.0, 0.0, 1.0]),
        ([0.5, 0.05, 0.35], [0.0, 1.0, 0.0]),
        ([0.5, 0.05, 0.35], [0.0, 0.0, 1.0]),
    ]);
    let machine = Machine { links: rail, ..cart() };
    let (motion, count, text) = unsupported(&machine);
    assert_unresisted(&machine, &motion);
    assert_eq!(count, 1);
    assert!(
        text.contains("nothing resists rotation about x near the point (0.000, 0.050, 0.350) m"),
        "{text}"
    );
}

#[test]
fn links_across_a_direction_leave_its_translation_free() {
    let mut machine = cart();
    machine.links.retain(|link| link.direction().z == 0.0);
    machine.links.push(Link::new(Vector3::new(0.0, 0.0, 1.0), Vector3::x(), 6e7, 0.0).expect("a link"));
    let (motion, count, text) = unsupported(&machine);
    assert_unresisted(&machine, &motion);
    assert_eq!((motion, count), (Vector6::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), 1));
    assert!(text.contains("nothing resists translation along z;"), "{text}");
}

#[test]
fn several_motions_are_counted() {
    let machine = Machine { links: links(&[([0.1, 0.2, 0.3], [0.0, 1.0, 0.0])]), ..cart() };
    let (motion, count, text) = unsupported(&machine);
    assert_unresisted(&machine, &motion);
    assert_eq!(count, 4);
    assert!(text.contains("(one of 4 such motions)"), "{text}");

    let mut dampers = cart();
    for link in &mut dampers.links {
        *link = Link::new(link.point(), link.direction(), 0.0, 5e4).expect("a damper");
    }
    assert_eq!(unsupported(&dampers).1, 5); // A damper supports nothing at rest.
}

/// A nut on its thread: the links do not resist the screw motion `u = pitch φ`.
#[test]
fn an_oblique_screw_is_named_with_its_travel() {
    let mut random = Random::new(13);
    for spread in [1.0, 1e4, 1e8] {
        for light in [1.0, 1e-3, 1e-6] {
            let (axis, point) = (random.vector(1.0).normalize(), random.vector(0.5));
            let pitch = 0.1;
            let screw = [axis * pitch + point.cross(&axis), axis];
            let mut machine = random_machine(&mut random);
            let inertia = machine.body.inertia() * light;
            machine.body =
                Body::new(machine.body.mass(), machine.body.center_of_mass(), inertia).expect("a body");
            for link in &mut machine.links {
                // A direction perpendicular to the velocity of the point in the screw motion.
                let velocity = screw[0] + screw[1].cross(&link.point());
                let k = link.stiffness() * f64::powf(spread, random.between(-0.5, 0.5));
                let across = velocity.cross(&random.vector(1.0));
                *link = Link::new(link.point(), across, k, 0.0).expect("a link");
            }
            let (motion, count, text) = unsupported(&machine);
            assert_unresisted(&machine, &motion);
            assert_eq!(count, 1);
            assert!(text.contains("with a travel of 0.100 m/rad along it"), "{text}");
            let turn = motion.fixed_rows::<3>(3).into_owned();
            close(turn.normalize().dot(&axis).abs(), 1.0, 1e-9, 1.0);
        }
    }
}

/// A soft direction counts as supported: a stiffness spread of 1e8, and an axis with hardly any inertia.
#[test]
fn a_softly_supported_body_is_supported() {
    let light = Matrix3::from_diagonal(&Vector3::new(1e-6, 1.0, 1.0));
    let body = Body::new(1250.0, Vector3::new(0.12, -0.65, 0.18), light).expect("a body");
    let mut random = Random::new(14);
    for _ in 0..20 {
        let turn = Rotation3::from_scaled_axis(random.vector(3.0));
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| turn * axis);
        let mut soft = Vec::new();
        for (i, k) in [1e9, 10.0, 1e5, 1e9, 1e3, 10.0].into_iter().enumerate() {
            soft.push(Link::new(random.vector(0.5), axes[i % 3], k, 0.0).expect("a link"));
            soft.push(Link::new(random.vector(0.5), axes[i % 3], k, 0.0).expect("a link"));
        }
        let machine = Machine { body, links: soft, gravity: GRAVITY, free: Free::ALL };
        let system = System::new(&machine.scene()).expect("soft, not loose");
        // The links share the weight, so the loads of soft links must be as accurate as those of stiff links.
        let carried = at(&machine.guide_load(&system), &[0.0; 12]);
        let weight = system.matrices().weight;
        assert!((carried - weight).amax() <= 1e-10 * weight.amax(), "{}", (carried - weight).amax());
    }
}

/// Two carriages that hold the body to one side each bear no moment about the line through them: the body turned 1e14 m away, where loads
/// of 1e15 N balanced up to their rounding.
#[test]
fn a_body_that_falls_between_one_sided_carriages_is_refused() {
    let body = Body::new(800.0, Vector3::new(-0.009, 1.592, -1.442), Matrix3::from_diagonal_element(90.0));
    let play = sided(1e8, 1e8, 4.1e-6);
    let machine = |front: Law, rear: Law| {
        let mut links = Vec::new();
        for (center, law) in [([0.3, 0.0, -0.25], front), ([-0.3, 0.0, 0.25], rear)] {
            for (point, direction) in carriage_ends(center.into(), 0.04) {
                let law = if direction.y > 0.0 { law } else { play };
                links.push(Link::with_law(point, direction, law, 4e3).expect("a link"));
            }
        }
        Machine { body: body.expect("a body"), links, gravity: GRAVITY, free: Free::GUIDED }
    };
    let falls = machine(sided(0.0, 1e8, 0.0), sided(1e8, 0.0, 0.0));
    let error = System::new(&falls.scene()).expect_err("nothing holds it");
    let SceneError::NoEquilibrium { motion } = error else { panic!("{error:?}") };
    assert!(error.to_string().contains("rotation about (-0.7"), "{error}");
    // The weight does work, and no link resists.
    assert!(motion.dot(&assemble(&falls.scene()).weight) > 0.0);
    for link in &falls.links {
        let along = link.row().dot(&motion);
        assert!(if link.law().segment(2).1 > 0.0 { along <= 1e-9 } else { along >= -1e-9 }, "{along}");
        assert!(link.direction().y > 0.0 || along.abs() <= 1e-9);
    }
    let holds = machine(sided(1e7, 1e8, 0.0), sided(1e8, 1e7, 0.0));
    let carried = at(&holds.guide_load(&holds.system()), &[0.0; 12]);
    assert!((carried - holds.system().matrices().weight).amax() <= 1e-9 * 8e3);
}

/// Springs a billionth as stiff as any of a machine let it rest thousands of kilometres away.
#[test]
fn a_body_that_rests_far_away_is_refused_with_its_travel() {
    let machine = |k: f64| {
        let soft = cart().links;
        let links =
            soft.iter().map(|link| Link::new(link.point(), link.direction(), k, 1.0).expect("a link"));
        Machine { links: links.collect(), ..cart() }
    };
    machine(1.0).system();
    let error = System::new(&machine(1e-4).scene()).expect_err("far away");
    assert!(matches!(error, SceneError::FarEquilibrium { travel, .. } if travel > 1e6), "{error:?}");
    assert!(error.to_string().contains("rotation about"), "{error}");
}
