//! Preloaded links beside links with straight segments: every edge is landed on, and the tolerance is kept.

use guideload::{
    Body, Control, Exact, Excitation, Free, Input, Law, Link, ModelLevel, Output, Radau, Record, Rk45,
    RunError, State, Summary, carriage_links, run,
};
use nalgebra::{Matrix3, Vector3};

use crate::common::{
    ADAPTIVE, BALL, GRAVITY, Machine, ROLLER, Random, adaptive, alike, cart, close, curve, difference,
    largest, linear, noise, one_dof, preloaded, random_machine, sided,
};
use crate::contacts::rk45_order;

/// The cart with play, sides and a curve, some dampers in contact only; every fourth link is `other`.
fn mixed_cart(mut other: impl FnMut(f64) -> Law) -> Machine {
    let mut machine = cart().with_laws(|i, k| match i % 4 {
        0 => sided(k, k, 5e-6),
        1 => sided(k, 0.4 * k, 0.0),
        2 => {
            let points = [[-2e-4, -1.5e-4], [-6e-6, -5e-6], [0.0, 0.0], [1e-6, 0.0], [1e-4, 2e-4]];
            curve(&points.map(|[d, f]| [d, f * k]))
        }
        _ => other(k),
    });
    for link in machine.links.iter_mut().step_by(8) {
        *link = link.damped_in_contact().expect("a clearance");
    }
    machine
}

/// Loads and work of a run by rk45, and by implicit.
fn both(machine: &Machine, excitation: &Excitation, rtol: f64) -> [(Vec<f64>, Summary); 2] {
    let loads = |(states, summary): (Vec<State>, Summary)| (machine.loads_of(&states), summary);
    let control = adaptive(rtol);
    [loads(machine.states(&Rk45, control, excitation)), loads(machine.states(&Radau, control, excitation))]
}

/// A preload far beyond the loads is a linear spring, and then the exact solution from contact change to contact change is known.
#[test]
fn beside_a_preload_that_is_never_reached_the_solution_is_the_exact_one() {
    let samples =
        noise(&mut Random::new(502), 60).into_iter().map(|a| a.map(|a| 2.0 * a)).collect::<Vec<_>>();
    let excitation = Excitation::uniform(0.0, 2e-3, &samples).expect("sound");
    let springs = mixed_cart(linear);
    let (states, exact) = springs.states(&Exact, ADAPTIVE, &excitation);
    let truth = springs.loads_of(&states);
    assert!(exact.contact_changes > 50, "{exact:?}");
    for exponent in [BALL, ROLLER] {
        let machine = mixed_cart(|k| preloaded(k, 1e10, exponent));
        assert_eq!(machine.system().model_level(), ModelLevel::SmoothNonlinear);
        for rtol in [1e-4, 1e-6, 1e-8] {
            for (loads, summary) in both(&machine, &excitation, rtol) {
                let off = difference(&loads, &truth) / exact.load_scale;
                assert!(off <= 3.0 * rtol, "{exponent} {rtol:e}: off by {off:e}");
                if rtol < 1e-5 {
                    assert_eq!(summary.contact_changes, exact.contact_changes);
                }
            }
        }
    }
}

/// Landing keeps the order 5 of rk45 behind every edge.
#[test]
fn rk45_keeps_its_order_behind_edges_beside_a_preload() {
    let machine =
        cart().with_laws(|i, k| if i % 4 == 3 { preloaded(k, 1e5, BALL) } else { sided(k, k, 5e-6) });
    let time = [0.0, 0.05];
    let samples = [[0.0; 3], [15.0, 5.0, 5.0]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let truth = machine.states(&Radau, adaptive(1e-12), &excitation);
    close(rk45_order(&machine, &excitation, truth), 5.0, 0.3, 1.0);
}

/// Laws of every kind in every mixture, opening rows among them: at each tolerance both methods are within a few times of it.
#[test]
fn the_tolerance_is_kept_on_any_mixture_of_laws() {
    let mut random = Random::new(501);
    let (mut changes, mut worst) = (0, 0.0f64);
    for _ in 0..6 {
        let machine = random_machine(&mut random);
        let weight = machine.body.mass() * machine.gravity.norm();
        let machine = machine.with_laws(|_, k| {
            let (load, size) = (weight * random.between(0.01, 0.3), random.between(0.0, 1.0));
            match (random.between(0.0, 5.0)) as usize {
                0 => sided(k, size * k, load / k),
                1 => sided(k, k, size * load / k),
                2 => sided(k, size * k, 0.0),
                3 => preloaded(k, size * load, BALL),
                _ => preloaded(k, size * load, ROLLER),
            }
        });
        if machine.system().model_level() != ModelLevel::SmoothNonlinear {
            continue;
        }
        let samples: Vec<_> = noise(&mut random, 40).into_iter().map(|a| a.map(|a| 3.0 * a)).collect();
        let excitation = Excitation::uniform(0.0, 4e-3, &samples).expect("sound");
        let [(truth, summary), (other, _)] = both(&machine, &excitation, 1e-11);
        changes += summary.contact_changes;
        assert!(difference(&truth, &other) <= 1e-8 * summary.load_scale);
        for rtol in [1e-4, 1e-7] {
            for (loads, _) in both(&machine, &excitation, rtol) {
                worst = worst.max(difference(&loads, &truth) / summary.load_scale / rtol);
            }
        }
    }
    assert!(changes > 100, "{changes} changes");
    assert!(worst <= 5.0, "off by {worst} x rtol");
}

/// Contact changes of a run, in the order of its samples.
struct Changes {
    /// Samples so far.
    samples: usize,
    interval: f64,
    changes: usize,
    later: usize,
}

impl Record for Changes {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        Ok(())
    }

    fn instant(&mut self, _: f64, _: &State, _: &Input) {
        self.samples += 1;
    }

    fn contact_change(&mut self, (sample, since): (usize, f64), _: &State, _: &[(usize, u8)]) {
        assert_eq!(sample + 1, self.samples);
        assert!((0.0..=self.interval).contains(&since), "{since} s after sample {sample}");
        self.changes += 1;
        self.later += usize::from(sample % PARTS > 0);
    }
}

const PARTS: usize = 5;

/// A step may pass samples that lie on a straight line. The changes are after the last sample before them all the same.
#[test]
fn contact_changes_come_in_the_order_of_the_samples() {
    let machine = mixed_cart(|k| preloaded(k, 600.0, BALL));
    let corners = noise(&mut Random::new(503), 60);
    let samples: Vec<[f64; 3]> = (0..PARTS * (corners.len() - 1))
        .map(|k| {
            let (corner, share) = (k / PARTS, (k % PARTS) as f64 / PARTS as f64);
            core::array::from_fn(|i| {
                corners[corner][i] + share * (corners[corner + 1][i] - corners[corner][i])
            })
        })
        .collect();
    let interval = 4e-4;
    let excitation = Excitation::uniform(0.0, interval, &samples).expect("sound");
    let mut record = Changes { samples: 0, interval, changes: 0, later: 0 };
    run(&machine.system(), &Rk45, adaptive(1e-6), &excitation, Output::Samples, &mut record)
        .expect("solvable");
    assert!(
        record.changes > 20 && record.later > 10,
        "{} changes, {} of them later",
        record.changes,
        record.later
    );
}

/// An overdamped link whose row is about to open when the motion ends: its load bends sharply there, and its velocity follows the load at
/// once. Steps judged as in the middle of nowhere were wrong by 47 times the tolerance.
#[test]
fn a_step_that_ends_just_before_a_row_opens_keeps_the_tolerance() {
    for (exponent, ratio) in [(BALL, 10.0), (BALL, 30.0), (ROLLER, 3.0), (ROLLER, 10.0), (ROLLER, 30.0)] {
        let machine = one_dof(40.0, ratio).with_laws(|_, k| preloaded(k, 2e3, exponent));
        let machine = Machine { gravity: Vector3::zeros(), ..machine };
        let samples = |end: f64| [[0.0; 3], [0.0, -200.0 / 3.0 * end, 0.0]];
        let opens = |end: f64| {
            let (time, samples) = ([0.0, end], samples(end));
            let excitation = Excitation::new(&time, &samples, None).expect("sound");
            machine.states(&Radau, adaptive(1e-9), &excitation).1.contact_changes > 0
        };
        let (mut before, mut after) = (0.0, 3.0);
        assert!(opens(after));
        for _ in 0..30 {
            let middle = 0.5 * (before + after);
            if opens(middle) { after = middle } else { before = middle }
        }
        for gap in [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5] {
            let time = [0.0, before * (1.0 - gap)];
            let samples = samples(time[1]);
            let excitation = Excitation::new(&time, &samples, None).expect("sound");
            let (states, summary) = machine.states(&Radau, adaptive(1e-11), &excitation);
            let truth = machine.loads_of(&states);
            for rtol in [1e-5, 1e-6, 1e-7] {
                for (loads, _) in both(&machine, &excitation, rtol) {
                    let off = difference(&loads, &truth) / summary.load_scale;
                    assert!(off <= 5.0 * rtol, "{exponent} {ratio} {gap:e} {rtol:e}: off by {off:e}");
                }
            }
        }
    }
}

/// A well damped machine of 1.1 kg whose stiffness spreads over three hundred. Steps that pass its edges unseen gave 4.53 N with implicit,
/// the same at 1e-4, 1e-6 and 1e-8; it is 3.07 N.
#[test]
fn tolerances_that_agree_with_each_other_are_right() {
    let (machine, time, samples) = light_machine();
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let [(truth, summary), (other, _)] = both(&machine, &excitation, 1e-11);
    alike(&other, &truth, 1e-9);
    close(largest(&truth), 3.071, 1e-3, 1.0);
    for rtol in [1e-4, 1e-6, 1e-8] {
        for (loads, work) in both(&machine, &excitation, rtol) {
            let off = difference(&loads, &truth) / summary.load_scale;
            assert!(off <= 3.0 * rtol, "{rtol:e}: off by {off:e}");
            assert_eq!(work.contact_changes, summary.contact_changes);
        }
    }
}

/// A machine that stands still before it moves: with steps of a fixed length too it stays at rest, up to rounding of its preloads.
#[test]
fn a_machine_that_stands_still_does_not_diverge() {
    let mut samples = vec![[0.0; 3]; 30];
    samples.extend([[2.2, 0.0, 0.0]; 10]);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    for preload in [1.0, 1e3, 1e9] {
        let machine = cart().with_laws(|_, k| preloaded(k, preload, BALL));
        let still = Excitation::uniform(0.0, 1e-3, &samples[..30]).expect("sound");
        let [(rest, _), _] = both(&machine, &still, 1e-6);
        for (loads, _) in [Control::Fixed { step: 1e-5 }, adaptive(1e-9)].map(|control| {
            let (states, summary) = machine.states(&Rk45, control, &excitation);
            (machine.loads_of(&states), summary)
        }) {
            let dwell = &loads[..rest.len()];
            assert!(difference(dwell, &rest) <= 1e-9 * (preload + largest(&rest)), "{preload:e}");
        }
        let (states, _) = machine.states(&Radau, Control::Fixed { step: 1e-5 }, &excitation);
        let [(truth, summary), _] = both(&machine, &excitation, 1e-9);
        assert!(difference(&machine.loads_of(&states), &truth) <= 1e-6 * summary.load_scale, "{preload:e}");
    }
}

/// The error falls as the step to the power of 5 or 6, so a thousandth of the tolerance takes four times the steps; not millions, because
/// steps behind an edge are so short that the tolerance of each is below rounding.
#[test]
fn the_tightest_tolerances_take_a_few_times_more_steps() {
    let samples = [0.0, 2.0, -1.0, 3.0, -3.0, 1.0].map(|a| [a, 0.0, 0.5 * a]);
    let excitation = Excitation::uniform(0.0, 2e-2, &samples).expect("sound");
    for preload in [1e2, 3e3] {
        let machine = mixed_cart(|k| preloaded(k, preload, BALL));
        let loose = both(&machine, &excitation, 1e-9);
        for rtol in [1e-11, 1e-12, 1e-13] {
            for ((loads, work), (same, less)) in both(&machine, &excitation, rtol).iter().zip(&loose) {
                assert!(difference(loads, same) <= 1e-8 * work.load_scale, "{preload} {rtol:e}");
                let steps = work.steps + work.rejected;
                assert!(steps <= 20 * (less.steps + less.rejected), "{preload} {rtol:e}: {steps} steps");
            }
        }
    }
}

/// On many links a unit of work takes longer, but steps of a given length are as many.
#[test]
fn steps_that_were_asked_for_are_made() {
    let mut machine = one_dof(100.0, 0.05);
    let share = machine.links[0].stiffness() / 200.0;
    let link =
        Link::with_law(Vector3::zeros(), Vector3::y(), preloaded(share, 5.0, BALL), 0.1).expect("a link");
    machine.links = vec![link; 200];
    let (time, samples) = ([0.0, 0.01, 0.02], [[0.0, 1.0, 0.0], [0.0, -2.0, 0.0], [0.0; 3]]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let (_, summary) = machine.states(&Radau, Control::Fixed { step: 0.02 / 6000.0 }, &excitation);
    assert_eq!(summary.steps - summary.contact_changes, 6000);
}

/// Machine, stamps [s] and accelerations [m/s²] of [`tolerances_that_agree_with_each_other_are_right`].
fn light_machine() -> (Machine, Vec<f64>, Vec<[f64; 3]>) {
    let inertia = Matrix3::new(1.55, 0.173, 0.084, 0.173, 1.52, -0.11, 0.084, -0.11, 1.32);
    let body = Body::new(1.1, Vector3::new(-0.383, 0.193, -0.934), inertia).expect("a body");
    let half = [
        [5.18e-7, 0.0],
        [6.36e-7, 64.9],
        [1.23e-6, 106.0],
        [1.8e-6, 135.0],
        [2.01e-6, 199.0],
        [2.38e-6, 211.0],
        [2.68e-6, 233.0],
    ];
    let mut points: Vec<[f64; 2]> = half.iter().rev().map(|[d, f]| [-d, -f]).collect();
    points.push([0.0, 0.0]);
    points.extend(half);
    let (left, right) = ([0.117, -1.17], [0.0, 1.17]);
    let carriages = [
        (-1.12, left, 0.192, [7340.0, 6610.0], linear(4.16e7), curve(&points)),
        (-1.03, right, 0.317, [428.0, 386.0], preloaded(1.42e5, 0.0752, ROLLER), sided(8.3e6, 1.42e5, 0.0)),
        (
            0.764,
            left,
            0.536,
            [3690.0, 3320.0],
            preloaded(1.05e7, 79.2, ROLLER),
            sided(1.05e7, 1.05e7, 1.42e-6),
        ),
        (0.837, right, 0.226, [673.0, 606.0], sided(3.5e5, 3.5e5, 2.25e-10), preloaded(3.5e5, 2.79, BALL)),
    ];
    let mut links = Vec::new();
    for (x, [y, z], length, damping, law_y, law_z) in carriages {
        let ends = carriage_links(Vector3::new(x, y, z), length, [1.0; 2], damping).expect("a carriage");
        for (link, law) in ends.iter().zip([&law_y, &law_z].into_iter().cycle()) {
            let law = law.scaled(0.5).expect("a law");
            links.push(
                Link::with_law(link.point(), link.direction(), law, link.damping()).expect("a sound link"),
            );
        }
    }
    let along_x = [
        -0.66, -0.35, -0.38, 0.39, -0.26, -0.31, -0.27, 0.36, -0.13, -0.22, -1.14, -1.53, -0.46, -0.45,
        -0.12, 0.26, 0.34, 0.55, 0.7, 0.52, 0.47, 0.7, 0.65, 0.96, 0.86, 1.04, 2.0, 1.48, 1.1, 1.58, 1.71,
        1.3, 1.12, 0.51, 0.51, 1.12, 1.17, 1.65, 0.88, 1.58, 1.49, 1.22, 0.92, 1.68, 1.56, 2.1, 1.45, 1.4,
        1.03, 0.34, 0.92, 0.7, 0.92, 0.57, 1.43, 0.85, 0.64, 0.16, -0.41, -0.61, -0.03, 0.66, 0.58, 0.9,
        0.52, 0.69, 0.41, 0.44, 0.23, 0.03, -1.05, -0.73, -0.45, -0.75, -0.15, 0.43, 0.15, -0.06, -0.06,
        -0.65, -0.03,
    ];
    // Two samples at one time after numbers 25, 35 and 70.
    let jumps = |k: usize| [26, 36, 71].iter().filter(|&&jump| jump <= k).count();
    let time = (0..along_x.len()).map(|k| 0.0085749284123658 * (k - jumps(k)) as f64).collect();
    let samples = along_x.iter().map(|&a| [a, 0.0, 0.0]).collect();
    (Machine { body, links, gravity: GRAVITY, free: Free::PAPER }, time, samples)
}
