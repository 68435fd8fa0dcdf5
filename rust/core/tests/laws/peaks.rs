//! Running extremes are those of the history, though most blocks of instants are passed over unevaluated.

use guideload::batch::{Batch, Measure, Motion, Quantity, Solver, Statistic};
use guideload::{
    Control, Exact, Excitation, Exponential, Extremes, Law, Method, Output, Part, Peaks, Rk45, RunError,
    Summary, Wrench, evaluate, group_load, reaction, run,
};

use crate::batch::{base, cart_on, yardstick};
use crate::common::{ADAPTIVE, CART_CENTERS, Machine, Random, cart, close, cycle, noise};

/// Runs twice, with a history and with running extremes, and compares them bit for bit; returns the outcome.
fn compare<M: Method>(
    machine: &Machine,
    method: &M,
    control: Control,
    excitation: &Excitation,
    with_drive: bool,
) -> Result<Summary, RunError> {
    let system = machine.system();
    let groups = CART_CENTERS.into_iter().enumerate();
    let mut loads: Vec<Wrench> =
        groups.map(|(g, center)| group_load(&system, 4 * g..4 * g + 4, center.into(), Part::Total)).collect();
    loads.extend(with_drive.then(|| reaction(&system)));
    let mut extremes = vec![Extremes::NONE; loads.len()];
    let mut peaks = Peaks::new(&loads, &mut extremes);
    let outcome = run(&system, method, control, excitation, Output::Samples, &mut peaks);

    let (states, other) = machine.run(method, control, excitation, Output::Samples);
    assert_eq!(outcome, other);
    let mut history = vec![0.0; states.len() * loads.len() * 6];
    evaluate(&loads, &states, |k| excitation.input(k), &mut history);
    for (l, extreme) in extremes.iter().enumerate() {
        let trace = |axis: usize| -> Vec<f64> {
            history.chunks(6 * loads.len()).map(|row| row[6 * l + axis]).collect()
        };
        for axis in 0..6 {
            let trace = trace(axis);
            let most = trace.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = trace.iter().copied().fold(f64::INFINITY, f64::min);
            assert_eq!((extreme.largest[axis], extreme.smallest[axis]), (most, least));
            let when = |x: f64| excitation.time(trace.iter().position(|&y| x == y).expect("it is there"));
            assert_eq!(extreme.time_of_largest[axis], when(most));
            assert_eq!(extreme.time_of_smallest[axis], when(least));
        }
        let pairs = trace(1).into_iter().zip(trace(2));
        let across: Vec<f64> = pairs.map(|(y, z)| y.hypot(z)).collect();
        let (most, least) =
            across.iter().fold((0.0, f64::INFINITY), |(a, b), &x| (f64::max(a, x), f64::min(b, x)));
        // `hypot` rounds otherwise than a root of squares.
        close(extreme.largest[6], most, 1e-15, most);
        close(extreme.smallest[6], least, 1e-15, most);
    }
    outcome
}

/// Quiet parts between lively ones, of a length that is no multiple of a block.
fn motion(random: &mut Random) -> Vec<[f64; 3]> {
    let mut samples = cycle()[550..1150].to_vec();
    samples.extend(vec![[0.0; 3]; 200]);
    samples.extend(noise(random, 77));
    samples.extend(vec![[0.0; 3]; 300]);
    samples
}

#[test]
fn peaks_are_the_extremes_of_the_history_bit_for_bit() {
    let mut random = Random::new(61);
    let samples = motion(&mut random);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let on = |law: Result<Law, _>| cart_on(law.expect("a law")).0;
    let play = on(Law::sided(6e7, 6e7, 5e-6));
    let mut idle = play.clone();
    for link in &mut idle.links {
        *link = link.damped_in_contact().expect("a clearance");
    }
    let curve = [[-3e-5, -2000.0], [-4e-6, 0.0], [3e-6, 0.0], [2e-5, 900.0], [4e-5, 3000.0]];
    for machine in [cart(), cart().with_damping(0.1), play, idle, on(Law::curve(&curve))] {
        for with_drive in [false, true] {
            compare(&machine, &Exact::<4>, ADAPTIVE, &excitation, with_drive).expect("a run");
        }
    }
    for exponent in [1.5, 10.0 / 9.0] {
        let machine = on(Law::preloaded(6e7, 300.0, exponent));
        compare(&machine, &Rk45, ADAPTIVE, &excitation, false).expect("a run");
        compare(&machine, &Exponential::<16>, ADAPTIVE, &excitation, false).expect("a run");
    }
}

/// Peaks of a run that ends with an error are those of the instants before it.
#[test]
fn peaks_before_an_error_are_kept() {
    let samples = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let control = Control::Fixed { step: 1e-3 };
    let outcome = compare(&cart().with_damping(15.0), &Rk45, control, &excitation, false);
    assert!(matches!(outcome, Err(RunError::Diverged { .. })), "{outcome:?}");
}

/// A study that asks for extremes only finds the same numbers as one that evaluates every load at every sample.
#[test]
fn extremes_of_a_study_do_not_depend_on_what_else_is_asked() {
    let mut random = Random::new(62);
    let samples = motion(&mut random);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let speed = vec![1.0; samples.len()];
    let motion = Motion { excitation, speed: Some(&speed), exponent: 3.0 };
    let extremes = [Statistic::Min, Statistic::TimeOfMin, Statistic::Max, Statistic::TimeOfMax];
    let few: Vec<Measure> = (0..4)
        .flat_map(|g| Quantity::ALL.map(|quantity| extremes.map(|of| Measure::Load(g, quantity, of))))
        .flatten()
        .collect();
    let squares = few.chunks(4).map(|some| match some[0] {
        Measure::Load(g, quantity, _) => Measure::Load(g, quantity, Statistic::Rms),
        other => other,
    });
    let all: Vec<Measure> = few.iter().copied().chain(squares).collect();
    for law in [Law::sided(6e7, 6e7, 5e-6), Law::preloaded(6e7, 300.0, 1.5)] {
        let (machine, groups) = cart_on(law.expect("a law"));
        let mut changes = yardstick(machine.links.len());
        changes.truncate(changes.len() - 2);
        let values: Vec<f64> = (0..3)
            .flat_map(|_| {
                let ([a, b, c], mass) = (<[f64; 3]>::from(random.vector(0.05)), random.between(0.9, 1.1));
                [mass, a, b, c].into_iter().chain([0; 8].map(|_| random.between(0.7, 1.4)))
            })
            .collect();
        let table = |measures: &[Measure]| {
            let base = base(&machine, &groups);
            let batch = Batch::new(base, motion, &changes, measures, Solver::Auto, 1e-6).expect("sound");
            let mut table = vec![0.0; 3 * measures.len()];
            assert_eq!(batch.run(3, &values, 1, &mut table).expect("sizes"), []);
            table
        };
        let (alone, whole) = (table(&few), table(&all));
        for (alone, whole) in alone.chunks(few.len()).zip(whole.chunks(all.len())) {
            assert_eq!(alone, &whole[..few.len()]);
        }
    }
}
