//! Invariance under the choice of axes, origin, order and units.

use guideload::{Body, Exact, Excitation, Free, Link, Part, group_load, position};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::common::{
    ADAPTIVE, Machine, Random, alike, any_machine, cart, cart_stiff, cycle, difference, largest, noise,
    random_machine, remade, ticks,
};

const STEP: f64 = 1e-3;

/// Rounding of the modes and of a few hundred steps, times the condition of ill-conditioned random supports.
const ROUNDING: f64 = 1e-11;

/// As [`ROUNDING`], where rounding also moves the instants of contact changes.
fn rounding(machine: &Machine) -> f64 {
    if is_linear(machine) { ROUNDING } else { 1e-9 }
}

fn is_linear(machine: &Machine) -> bool {
    machine.links.iter().all(|link| link.law().is_linear())
}

/// Machines whose links have any piecewise linear law, and those of [`linear_machines`].
fn machines(random: &mut Random) -> Vec<Machine> {
    let mut machines: Vec<_> = (0..3).map(|_| any_machine(random)).collect();
    machines.extend(linear_machines(random));
    machines
}

/// Linear machines with six free degrees of freedom.
fn linear_machines(random: &mut Random) -> Vec<Machine> {
    let mut machines: Vec<_> = (0..6).map(|_| random_machine(random)).collect();
    for mut guided in [cart(), cart_stiff()] {
        let drive = Link::new(Vector3::new(0.0, -0.1, 0.0), Vector3::x(), 2e7, 1e4).expect("a drive");
        guided.links.push(drive);
        machines.push(guided.with_free(Free::ALL));
    }
    machines
}

fn history(random: &mut Random, count: usize) -> (Vec<f64>, Vec<[f64; 3]>, Vec<[f64; 6]>) {
    let time = ticks(count, STEP);
    let wrench = (0..count)
        .map(|_| {
            let (f, m) = (random.vector(500.0), random.vector(100.0));
            [f.x, f.y, f.z, m.x, m.y, m.z]
        })
        .collect();
    (time, noise(random, count), wrench)
}

fn halves(wrench: &[f64; 6]) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::from_column_slice(&wrench[..3]), Vector3::from_column_slice(&wrench[3..]))
}

fn input_from(force: Vector3<f64>, moment: Vector3<f64>) -> [f64; 6] {
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}

#[test]
fn turning_the_whole_scene_turns_its_loads() {
    let mut random = Random::new(21);
    let quarter = core::f64::consts::FRAC_PI_2;
    let mut turns: Vec<_> = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()]
        .map(|axis| Rotation3::from_axis_angle(&axis, quarter))
        .to_vec();
    turns.push(Rotation3::from_axis_angle(&Unit::new_normalize(random.vector(1.0)), 2.1));
    for machine in machines(&mut random) {
        let (time, acceleration, wrench) = history(&mut random, 120);
        let excitation = Excitation::new(&time, &acceleration, Some(&wrench)).expect("sound");
        let loads = machine.exact_loads(&excitation);
        let (states, _) = machine.states(&Exact, ADAPTIVE, &excitation);
        let system = machine.system();
        let group = group_load(&system, 0..4, Vector3::new(0.1, 0.2, 0.3), Part::Total);
        for turn in &turns {
            let body = &machine.body;
            let inertia = turn * body.inertia() * turn.inverse();
            let turned = Machine {
                body: Body::new(body.mass(), turn * body.center_of_mass(), inertia).expect("a body"),
                links: machine
                    .links
                    .iter()
                    .map(|l| remade(l, turn * l.point(), turn * l.direction(), *l.law(), l.damping()))
                    .collect(),
                gravity: turn * machine.gravity,
                free: Free::ALL,
            };
            let acceleration: Vec<[f64; 3]> =
                acceleration.iter().map(|&a| (turn * Vector3::from(a)).into()).collect();
            let wrench: Vec<_> =
                wrench.iter().map(halves).map(|(f, m)| input_from(turn * f, turn * m)).collect();
            let excitation = Excitation::new(&time, &acceleration, Some(&wrench)).expect("sound");
            alike(&turned.exact_loads(&excitation), &loads, rounding(&machine));

            let (turned_states, _) = turned.states(&Exact, ADAPTIVE, &excitation);
            let center = turn * Vector3::new(0.1, 0.2, 0.3);
            let turned_system = turned.system();
            let turned_group = group_load(&turned_system, 0..4, center, Part::Total);
            for (state, turned_state) in states.iter().zip(&turned_states) {
                let (f, m) = halves(&group.at(state, &[0.0; 9]));
                let got = turned_group.at(turned_state, &[0.0; 9]);
                assert!(
                    difference(&got, &input_from(turn * f, turn * m)) <= rounding(&machine) * largest(&loads)
                );
            }
        }
    }
}

#[test]
fn link_loads_do_not_depend_on_the_origin() {
    let mut random = Random::new(22);
    for machine in machines(&mut random) {
        let (time, acceleration, wrench) = history(&mut random, 120);
        let excitation = Excitation::new(&time, &acceleration, Some(&wrench)).expect("sound");
        let loads = machine.exact_loads(&excitation);
        let by = random.vector(1.0);
        let moved = machine.clone().moved(-by);
        let wrench: Vec<_> =
            wrench.iter().map(halves).map(|(f, m)| input_from(f, m - by.cross(&f))).collect();
        let excitation = Excitation::new(&time, &acceleration, Some(&wrench)).expect("sound");
        alike(&moved.exact_loads(&excitation), &loads, rounding(&machine));
    }
}

#[test]
fn the_order_of_the_links_changes_nothing() {
    let mut random = Random::new(23);
    for machine in machines(&mut random) {
        let (time, acceleration, wrench) = history(&mut random, 120);
        let excitation = Excitation::new(&time, &acceleration, Some(&wrench)).expect("sound");
        let loads = machine.exact_loads(&excitation);
        let count = machine.links.len();
        // Backwards, then from the middle on.
        let order: Vec<usize> = (0..count).rev().map(|i| (i + count / 2) % count).collect();
        let mixed = Machine { links: order.iter().map(|&i| machine.links[i]).collect(), ..machine };
        let got = mixed.exact_loads(&excitation);
        let mut sorted = vec![0.0; got.len()];
        for (row, values) in got.chunks(count).enumerate() {
            for (slot, &i) in order.iter().enumerate() {
                sorted[row * count + i] = values[slot];
            }
        }
        alike(&sorted, &loads, rounding(&machine));
    }
}

/// The machine with mass, stiffness, damping, lengths and gravity times these; not the deflections at which laws have edges.
pub fn scaled(machine: &Machine, mass: f64, k: f64, b: f64, length: f64, gravity: f64) -> Machine {
    let body = &machine.body;
    let inertia: Matrix3<f64> = body.inertia() * (mass * length * length);
    Machine {
        body: Body::new(body.mass() * mass, body.center_of_mass() * length, inertia).expect("a body"),
        links: machine
            .links
            .iter()
            .map(|l| {
                let law = l.law().scaled(k).expect("a law");
                remade(l, l.point() * length, l.direction(), law, l.damping() * b)
            })
            .collect(),
        gravity: machine.gravity * gravity,
        free: machine.free,
    }
}

#[test]
fn loads_scale_as_their_units_do() {
    let mut random = Random::new(24);
    for machine in machines(&mut random) {
        let acceleration = noise(&mut random, 120);
        let still = Excitation::uniform(0.0, STEP, &acceleration).expect("sound");
        let loads = machine.exact_loads(&still);
        let agree = |scaled: Machine, excitation: &Excitation, times: f64| {
            let want: Vec<f64> = loads.iter().map(|x| x * times).collect();
            alike(&scaled.exact_loads(excitation), &want, rounding(&machine));
        };

        // Mass: k, b and m alike; 1024 is a power of two and only moves exponents, 1000 rounds.
        for factor in [1024.0, 1e3] {
            agree(scaled(&machine, factor, factor, factor, 1.0, 1.0), &still, factor);
        }
        // Length in millimetres instead of metres, force in newtons.
        if is_linear(&machine) {
            let faster: Vec<_> = acceleration.iter().map(|a| a.map(|a| a * 1e3)).collect();
            let excitation = Excitation::uniform(0.0, STEP, &faster).expect("sound");
            agree(scaled(&machine, 1e-3, 1e-3, 1e-3, 1e3, 1e3), &excitation, 1.0);
        }
        // A tenth of the time, a hundred times the acceleration.
        let faster: Vec<_> = acceleration.iter().map(|a| a.map(|a| a * 100.0)).collect();
        let excitation = Excitation::uniform(0.0, STEP / 10.0, &faster).expect("sound");
        agree(scaled(&machine, 1.0, 100.0, 10.0, 1.0, 100.0), &excitation, 100.0);
    }
}

/// Reciprocity (Maxwell, Betti) over time: a force history at A along a causes the same displacement at B along b as the force history at B
/// along b causes at A along a.
#[test]
fn displacements_are_reciprocal() {
    let mut random = Random::new(25);
    for machine in linear_machines(&mut random) {
        let system = machine.system();
        let place = position(&system);
        let ends = [0, 1].map(|_| (random.vector(0.8), random.vector(1.0).normalize()));
        let force: Vec<f64> = (0..200).map(|_| random.between(-1e3, 1e3)).collect();
        let rest = vec![[0.0; 3]; force.len()];
        let time = ticks(force.len(), STEP);
        let [there, back] = [[0, 1], [1, 0]].map(|[at, seen]| {
            let ((a, along_a), (b, along_b)) = (ends[at], ends[seen]);
            let wrench: Vec<_> =
                force.iter().map(|f| input_from(along_a * *f, a.cross(&along_a) * *f)).collect();
            let excitation = Excitation::new(&time, &rest, Some(&wrench)).expect("sound");
            let (states, _) = machine.states(&Exact, ADAPTIVE, &excitation);
            let sag = halves(&place.at_rest());
            let moved = |state| {
                let (u, phi) = halves(&place.at(state, &[0.0; 9]));
                (u - sag.0 + (phi - sag.1).cross(&b)).dot(&along_b)
            };
            states.iter().map(moved).collect::<Vec<f64>>()
        });
        assert!(largest(&there) > 1e-6); // It moves at all, micrometres.
        alike(&there, &back, ROUNDING);
    }
}

#[test]
fn the_cycle_is_that_of_the_yardstick() {
    let cycle = cycle();
    assert_eq!(cycle.len(), 7062);
    let sum: f64 = cycle.iter().map(|a| a[0]).sum();
    assert!(sum.abs() < 1e-9 * 7062.0); // It ends at rest: there and back cancel but for the sampling of kinks.
    let speed = cycle[..1500].iter().map(|a| a[0] * 1e-3).sum::<f64>();
    assert!((speed - 1.6).abs() < 1e-4, "{speed}");
}
