//! The exponential method: its order, its tolerance, what it leaves as it is, and what it refuses.

use guideload::{
    Control, Exact, Excitation, Exponential, Link, NamedMethod, Output, Radau, Rk45, RunError, Start, State,
    Summary, position, velocity,
};
use nalgebra::Vector6;

use crate::common::{
    ADAPTIVE, BALL, CURVE, Machine, ROLLER, Random, adaptive, cart, cart_clear, cart_stiff, curve, cycle,
    difference, largest, linear, noise, one_dof, preloaded, random_machine, sided, wrenches,
};
use crate::long_steps::{Needless, compare_with};

/// The machine with preloaded links of the same stiffness, except every `spring`th one, which stays a spring.
fn pressed(machine: Machine, preload: f64, exponent: f64, spring: usize) -> Machine {
    machine.with_laws(|i, k| match (i + 1) % spring {
        0 => linear(k),
        _ => preloaded(k, preload * (1.0 + 0.1 * i as f64), exponent),
    })
}

/// No spring among the links.
const NONE: usize = usize::MAX;

fn shaken(count: usize, seed: u64) -> Vec<[f64; 3]> {
    noise(&mut Random::new(seed), count)
}

/// Time stamps with intervals from 10 us to 5 ms, no two of them alike, and a jump in between.
fn jittered(random: &mut Random, count: usize) -> Vec<f64> {
    let mut time = vec![0.0];
    for k in 1..count {
        let interval = if k == count / 2 { 0.0 } else { 10f64.powf(random.between(-5.0, -2.3)) };
        time.push(time[k - 1] + interval);
    }
    time
}

fn loads(machine: &Machine, run: (Vec<State>, Summary)) -> (Vec<f64>, Summary) {
    (machine.loads_of(&run.0), run.1)
}

#[track_caller]
fn assert_within_tolerance(name: &str, machine: &Machine, excitation: &Excitation) {
    let truth = machine.loads_of(&machine.states(&Radau, adaptive(1e-12), excitation).0);
    for rtol in [1e-4, 1e-6, 1e-8, 1e-10] {
        let run = machine.states(&Exponential, adaptive(rtol), excitation);
        let (found, summary) = loads(machine, run);
        let off = difference(&found, &truth) / summary.load_scale;
        println!(
            "{name} {rtol:e}: {:.3} x, {} + {} steps, {} changes",
            off / rtol,
            summary.steps,
            summary.rejected,
            summary.contact_changes
        );
        assert!(off <= 10.0 * rtol, "{name} at {rtol:e}: off by {} x the tolerance", off / rtol);
    }
}

/// Error of the last state after so many equal steps of 50 ms, relative to a solution at 1e-13.
fn errors_at_end(machine: &Machine, counts: [u32; 2]) -> [f64; 2] {
    let (time, samples) = ([0.0, 0.05], [[0.0; 3], [15.0, 5.0, 5.0]]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let truth = machine.states(&Radau, adaptive(1e-13), &excitation).0[1];
    counts.map(|steps| {
        let control = Control::Fixed { step: 0.05 / f64::from(steps) };
        let (states, summary) = machine.states(&Exponential, control, &excitation);
        assert_eq!((summary.steps, summary.contact_changes), (steps as usize, 0));
        difference(&states[1], &truth) / largest(&truth)
    })
}

/// With h |λ| far above 1 the collocation loses up to one order (order reduction).
#[test]
fn fixed_steps_have_order_four_where_no_row_opens() {
    for (machine, counts, least) in [
        (pressed(cart(), 2e4, BALL, NONE), [100, 200], 3.85),
        (pressed(cart(), 2e4, ROLLER, 3), [100, 200], 3.85),
        (pressed(one_dof(100.0, 0.0), 2e3, BALL, NONE), [50, 100], 3.85),
        (pressed(cart_stiff(), 4e3, BALL, NONE), [20, 40], 2.85),
    ] {
        let [coarse, fine] = errors_at_end(&machine, counts);
        let order = (coarse / fine).log2();
        println!("order {order:.3} (errors {coarse:.1e} {fine:.1e})");
        assert!(fine > 1e-13, "{fine:e}: rounding, not order");
        assert!((least..4.15).contains(&order), "{order}");
    }
}

#[test]
fn the_tolerance_is_kept_on_preloaded_machines() {
    let cycle = cycle();
    let clean = Excitation::uniform(0.0, 1e-3, &cycle[560..760]).expect("sound");
    let noisy = shaken(120, 901);
    let noisy = Excitation::uniform(0.0, 1e-3, &noisy).expect("sound");
    for (name, excitation) in [("clean", clean), ("noisy", noisy)] {
        assert_within_tolerance(name, &pressed(cart(), 600.0, BALL, NONE), &excitation);
        assert_within_tolerance(name, &pressed(cart(), 30.0, BALL, NONE), &excitation); // rows open in most steps
        assert_within_tolerance(name, &pressed(cart(), 300.0, ROLLER, NONE), &excitation);
        assert_within_tolerance(name, &pressed(cart(), 300.0, BALL, 2), &excitation); // springs beside them
        assert_within_tolerance(name, &pressed(cart_stiff(), 300.0, BALL, NONE), &excitation);
    }
}

/// Where a vibration dies away under a constant acceleration, linearised equations take over: the sooner, the looser the tolerance.
#[test]
fn the_tolerance_is_kept_where_a_body_vibrates_freely_and_moves_again() {
    let cycle = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &cycle[560..1500]).expect("sound");
    for machine in [
        pressed(cart(), 600.0, BALL, NONE),
        pressed(cart(), 600.0, ROLLER, 3),
        pressed(cart().with_damping(0.3), 2000.0, BALL, NONE),
        pressed(cart_stiff(), 600.0, BALL, 2),
    ] {
        let truth = machine.loads_of(&machine.states(&Radau, adaptive(1e-12), &excitation).0);
        let mut last = f64::INFINITY;
        for rtol in [1e-3, 1e-5, 1e-7] {
            let run = machine.states(&Exponential, adaptive(rtol), &excitation);
            let method = (&Exponential, adaptive(rtol));
            let part = compare_with(&mut Needless::default(), &machine, method, &excitation, 1e-12);
            let (found, summary) = loads(&machine, run);
            let off = difference(&found, &truth) / summary.load_scale;
            println!("{rtol:e}: {:.3} x, {part:.2} left out", off / rtol);
            assert!(off <= rtol, "at {rtol:e}: off by {} x the tolerance", off / rtol);
            assert!(part > 0.0 && part < last, "{part}");
            last = part;
        }
    }
}

/// The undamped vibration of a mass: an error of its frequency would add up over thousands of periods.
#[test]
fn an_undamped_free_vibration_keeps_its_phase() {
    let machine = pressed(one_dof(200.0, 0.0), 4e4, BALL, NONE);
    let mut samples = vec![[0.0; 3]; 20_000];
    samples[..40].fill([0.0, 1.0, 0.0]);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let truth = machine.loads_of(&machine.states(&Radau, adaptive(1e-12), &excitation).0);
    let mut parts = Vec::new();
    for rtol in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        let (found, summary) = loads(&machine, machine.states(&Exponential, adaptive(rtol), &excitation));
        let off = difference(&found, &truth) / summary.load_scale;
        let method = (&Exponential, adaptive(rtol));
        let part = compare_with(&mut Needless::default(), &machine, method, &excitation, 1e-11);
        println!("{rtol:e}: {:.3} x, {part:.2} left out", off / rtol);
        assert!(off <= 2.0 * rtol, "at {rtol:e}: off by {} x the tolerance", off / rtol);
        parts.push(part);
    }
    assert!(parts[0] > 0.9 && parts[4] == 0.0, "{parts:?}");
}

/// A change of any component, or of the intervals, ends a free vibration at once.
#[test]
fn a_free_vibration_ends_with_the_constant_excitation() {
    // Exact binary fractions, so that all intervals but one are equal.
    let time = |k: usize| (k + usize::from(k > 1390)) as f64 / 1024.0;
    // The last sample is one at which free vibration is tried.
    let time: Vec<f64> = (0..1698).map(time).collect();
    let machine = pressed(cart(), 600.0, BALL, NONE);
    for first in 300..333 {
        let (mut accelerations, mut loads) = (vec![[0.0; 3]; time.len()], vec![[0.0; 6]; time.len()]);
        for k in 0..time.len() {
            loads[k][1] = 400.0 * f64::from(u8::from((first..700).contains(&k)));
            loads[k][5] = f64::from(u8::from(k == 700 + first));
            accelerations[k][0] = 0.3 * f64::from(u8::from((600..1290).contains(&k)));
        }
        let excitation = Excitation::new(&time, &accelerations, Some(&loads)).expect("sound");
        let truth = machine.loads_of(&machine.states(&Radau, adaptive(1e-10), &excitation).0);
        let (found, summary) = self::loads(&machine, machine.states(&Exponential, ADAPTIVE, &excitation));
        assert!(difference(&found, &truth) <= 1e-6 * summary.load_scale, "{first}");
        let mut record = Needless::refusing(first % 2 == 1);
        let part = compare_with(&mut record, &machine, (&Exponential, ADAPTIVE), &excitation, 1e-12);
        assert!(part > 0.2 && part < 0.9, "{part}");
    }
}

/// The same constant excitation in intervals of two lengths.
#[test]
fn free_vibrations_in_intervals_of_two_lengths_are_kept_apart() {
    let time: Vec<f64> = (0..1200).map(|k| (2 * k.min(600) + k.max(600) - 600) as f64 / 2048.0).collect();
    let pulse = |k: usize| f64::from(u8::from((300..320).contains(&k) || (640..660).contains(&k)));
    let samples: Vec<[f64; 3]> = (0..1200).map(|k| [pulse(k), 0.0, 0.0]).collect();
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let machine = pressed(cart(), 600.0, BALL, NONE);
    let truth = machine.loads_of(&machine.states(&Radau, adaptive(1e-10), &excitation).0);
    let (found, summary) = loads(&machine, machine.states(&Exponential, ADAPTIVE, &excitation));
    assert!(difference(&found, &truth) <= 1e-6 * summary.load_scale);
}

/// Intervals of half a period: at every sample the body may be where it rests, and far away in between.
#[test]
fn samples_in_step_with_a_vibration_do_not_hide_it() {
    let frequency = std::f64::consts::TAU * 16.0;
    let machine = pressed(one_dof(frequency, 0.02), 400.0, BALL, NONE);
    let time: Vec<f64> =
        (0..400).map(|k| k.min(65) as f64 / 1024.0 + (k.max(65) - 65) as f64 / 32.0).collect();
    for first in 1..40 {
        let samples: Vec<[f64; 3]> = (0..400)
            .map(|k| [0.0, 20.0 * f64::from(u8::from((first..first + 20).contains(&k))), 0.0])
            .collect();
        let excitation = Excitation::new(&time, &samples, None).expect("sound");
        let truth = machine.loads_of(&machine.states(&Radau, adaptive(1e-11), &excitation).0);
        let (found, summary) = loads(&machine, machine.states(&Exponential, ADAPTIVE, &excitation));
        let off = difference(&found, &truth) / summary.load_scale;
        assert!(off <= 2e-5, "{first}: {off:e}");
    }
}

/// Without weight and excitation there is no load to which an error could be compared.
#[test]
fn a_vibration_without_load_scale_is_not_linear() {
    let mut machine = pressed(one_dof(200.0, 0.0), 400.0, BALL, NONE);
    machine.gravity.y = 0.0;
    let samples = vec![[0.0; 3]; 1500];
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let mut position = Vector6::zeros();
    position.y = 0.6 * machine.links[0].law().edges()[1];
    let start = Start::State { position, velocity: Vector6::zeros() };
    let loads = |method: NamedMethod, control: Control| {
        let (system, mut states): (_, Vec<State>) = (machine.system(), Vec::new());
        let run = method.run(&system, control, start, &excitation, Output::Samples, &mut states);
        assert_eq!(run.expect("a run").load_scale, 0.0);
        machine.loads_of(&states)
    };
    let truth = loads(NamedMethod::Rk45, Control::Fixed { step: 1e-5 });
    let found = loads(NamedMethod::Exponential, adaptive(1e-6));
    assert!(difference(&found, &truth) <= 1e-3 * largest(&truth));
}

/// A body whose weight almost opens a row, so that a small vibration does.
#[test]
fn rows_that_a_small_vibration_opens_are_counted() {
    let free = one_dof(60.0, 0.02);
    let weight = free.body.mass() * free.gravity.norm();
    let samples: Vec<[f64; 3]> = (0..6000).map(|k| [0.0, f64::from(u8::from(k < 20)), 0.0]).collect();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    // A row opens under √8 times the preload.
    for distance in [1e-3, 1e-4, 1e-5] {
        let machine = pressed(free.clone(), weight / 8f64.sqrt() * (1.0 + distance), BALL, NONE);
        let (_, located) = machine.states(&Rk45, adaptive(1e-10), &excitation);
        assert!(located.contact_changes > 20);
        for rtol in [1e-3, 1e-4, 1e-6] {
            let (_, counted) = machine.states(&Exponential, adaptive(rtol), &excitation);
            assert_eq!(counted.contact_changes, located.contact_changes, "{distance:e} {rtol:e}");
        }
    }
}

#[test]
fn the_tolerance_is_kept_at_any_time_stamps_under_any_load() {
    let mut random = Random::new(902);
    for exponent in [BALL, ROLLER, BALL, ROLLER] {
        let machine = random_machine(&mut random);
        let weight = machine.body.mass() * machine.gravity.norm();
        let machine = pressed(machine, weight * random.between(0.02, 0.3), exponent, 5);
        let (samples, time) = (noise(&mut random, 100), jittered(&mut random, 100));
        let wrench = wrenches(&mut random, 100, 300.0);
        let excitation = Excitation::new(&time, &samples, Some(&wrench)).expect("sound");
        assert_within_tolerance("random", &machine, &excitation);
    }
}

/// The undamped vibration of a mass on two rows that open: its energy is that of the first instant.
#[test]
fn an_undamped_vibration_keeps_its_energy() {
    let mut machine = pressed(one_dof(200.0, 0.0), 400.0, BALL, NONE);
    machine.gravity.y = 0.0;
    let mut samples = vec![[0.0; 3]; 1500];
    samples[..40].fill([0.0, 20.0, 0.0]);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let (states, summary) = machine.states(&Exponential, adaptive(1e-9), &excitation);
    assert!(summary.contact_changes > 100, "{summary:?}");
    let (system, mass) = (machine.system(), machine.body.mass());
    let (at, speed) = (position(&system), velocity(&system));
    let energy = |state: &State| {
        let [travel, speed] = [&at, &speed].map(|rows| rows.at(state, &[0.0; 9])[1]);
        0.5 * mass * speed * speed + machine.links[0].law().energy(travel)
    };
    let first = energy(&states[100]);
    for state in states[100..].iter().step_by(97) {
        let off = (energy(state) - first).abs() / first;
        assert!(off < 1e-7, "{off:e}");
    }
}

#[test]
fn without_preload_it_is_the_exact_method_bit_for_bit() {
    let samples = shaken(200, 903);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    for machine in [cart(), cart_stiff(), cart_clear()] {
        let exact = machine.states(&Exact, ADAPTIVE, &excitation);
        assert!(machine.states(&Exponential, ADAPTIVE, &excitation) == exact);
    }
}

/// A preload far beyond the loads is a spring: only the remainder of the law's curvature is left.
#[test]
fn a_preload_far_beyond_the_loads_is_a_spring() {
    let samples = shaken(200, 904);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    for machine in [cart(), cart_stiff(), cart().with_damping(0.0)] {
        let exact = machine.exact_loads(&excitation);
        let spring = pressed(machine, 1e8, BALL, NONE);
        let run = spring.states(&Exponential, adaptive(1e-6), &excitation);
        let (found, summary) = loads(&spring, run);
        let (got, size) = (difference(&found, &exact), largest(&exact));
        assert!(got <= 1e-9 * size, "{got} of {size}");
        assert_eq!((summary.steps, summary.rejected, summary.contact_changes), (199, 0, 0));
    }
}

/// To the last bit on rollers; up to rounding of the preload on balls, whose loads are computed by another sum.
#[test]
fn a_body_at_rest_stays_at_rest() {
    let samples = vec![[0.0; 3]; 2000];
    let time = jittered(&mut Random::new(905), 2000);
    for excitation in [
        Excitation::uniform(0.0, 1e-3, &samples).expect("sound"),
        Excitation::new(&time, &samples, None).expect("sound"),
    ] {
        for (machine, allowed) in
            [(pressed(cart(), 300.0, ROLLER, 2), 0.0), (pressed(cart(), 300.0, BALL, NONE), 1e-12)]
        {
            for control in [adaptive(1e-10), Control::Fixed { step: 3e-4 }] {
                let (states, summary) = machine.states(&Exponential, control, &excitation);
                let rest = machine.loads_of(&[[0.0; 12]]);
                for state in &states {
                    assert!(difference(&machine.loads_of(&[*state]), &rest) <= allowed * largest(&rest));
                }
                assert_eq!((summary.rejected, summary.contact_changes), (0, 0));
            }
        }
    }
}

#[test]
fn loads_between_the_samples_are_as_accurate_as_at_them() {
    let samples = shaken(150, 906);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let times: Vec<f64> = (0..600).map(|k| 0.149 * (f64::from(k) + 0.5) / 600.0).collect();
    let at_samples: Vec<f64> = (0..150).map(|k| excitation.time(k)).collect();
    for machine in [
        pressed(cart(), 3e4, BALL, NONE),
        pressed(cart(), 100.0, BALL, NONE),
        pressed(cart_stiff(), 600.0, ROLLER, 3),
    ] {
        let truth =
            machine.loads_of(&machine.run(&Radau, adaptive(1e-12), &excitation, Output::Times(&times)).0);
        for rtol in [1e-4, 1e-8] {
            let (states, outcome) =
                machine.run(&Exponential, adaptive(rtol), &excitation, Output::Times(&times));
            let off = difference(&machine.loads_of(&states), &truth) / outcome.expect("a run").load_scale;
            println!("{rtol:e}: between {:.2} x", off / rtol);
            assert!(off <= 10.0 * rtol, "{rtol:e}: {} x the tolerance", off / rtol);
        }
        // Roundings of a sample's time move the state by its rate times 1e-17 s.
        let (states, _) = machine.states(&Exponential, adaptive(1e-8), &excitation);
        let (again, _) = machine.run(&Exponential, adaptive(1e-8), &excitation, Output::Times(&at_samples));
        let (states, again) = (machine.loads_of(&states), machine.loads_of(&again));
        assert!(difference(&states, &again) <= 1e-7 * largest(&states));
    }
}

/// Each row that opens closes again: rk45 ends a step at every change.
#[test]
fn changes_of_contact_are_those_that_rk45_locates() {
    let cycle = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &cycle[..3000]).expect("sound");
    for (preload, exponent) in [(600.0, BALL), (150.0, BALL), (600.0, ROLLER)] {
        let machine = pressed(cart(), preload, exponent, NONE);
        let (_, located) = machine.states(&Rk45, adaptive(1e-9), &excitation);
        assert!(located.contact_changes > 0);
        for rtol in [1e-5, 1e-8] {
            let (_, counted) = machine.states(&Exponential, adaptive(rtol), &excitation);
            assert_eq!(counted.contact_changes, located.contact_changes);
        }
    }
}

/// One step for each interval where the samples are short enough, at any overdamping: no limit of stability.
#[test]
fn a_stiff_machine_takes_one_step_per_sample() {
    let cycle = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &cycle).expect("sound");
    for damping in [1.0, 100.0, 1e4] {
        let machine = pressed(cart().with_damping(damping), 3000.0, BALL, NONE);
        let (_, summary) = machine.states(&Exponential, ADAPTIVE, &excitation);
        assert!(summary.steps + summary.rejected < cycle.len() + 100, "{damping}: {summary:?}");
    }
}

#[test]
fn edges_beside_preload_and_wrong_settings_are_refused() {
    let samples = shaken(5, 909);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let mut machine = pressed(cart(), 600.0, BALL, NONE);
    let outcome = |machine: &Machine, control: Control| {
        machine.run(&Exponential, control, &excitation, Output::Samples).1
    };
    for rtol in [1e-14, 0.2, -1e-6] {
        assert_eq!(outcome(&machine, adaptive(rtol)), Err(RunError::Tolerance { got: rtol }));
    }
    for step in [0.0, f64::INFINITY] {
        assert_eq!(outcome(&machine, Control::Fixed { step }), Err(RunError::Step { got: step }));
    }
    let short = outcome(&machine, Control::Fixed { step: 1e-17 });
    assert!(matches!(short, Err(RunError::ShortSteps { step: 1e-17, .. })), "{short:?}");
    for law in [sided(6e7, 6e7, 5e-6), sided(6e7, 3e7, 0.0), curve(&CURVE)] {
        let link = machine.links[3];
        machine.links[3] = Link::with_law(link.point(), link.direction(), law, 5e4).expect("a link");
        let error = outcome(&machine, ADAPTIVE).expect_err("refused");
        assert_eq!(error, RunError::NotExponential { link: 3 });
        assert!(error.to_string().contains("expected \"rk45\", \"implicit\" or \"auto\""));
    }
}
