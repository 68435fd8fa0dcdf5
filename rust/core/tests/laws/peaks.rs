//! Running extremes are those of the history, though most instants are left out, or passed over unevaluated.

use guideload::batch::{Batch, Measure, Motion, Quantity, Solver, Statistic};
use guideload::{
    Control, Exact, Excitation, Exponential, Extremes, Law, Method, Output, Part, Peaks, Rk45, RunError,
    Summary, Wrench, evaluate, group_load, reaction, run,
};

use crate::batch::{base, cart_on, yardstick};
use crate::common::{ADAPTIVE, CART_CENTERS, Machine, Random, alike, cart, close, cycle, largest, noise};

/// Runs twice, with a history and with running extremes, and compares them: bit for bit, or to 1e-13 after leaps and contact changes. Leaps
/// round otherwise than steps, and contact changes decide which steps are made two at a time. Returns the outcomes, the latter first.
fn compare<M: Method>(
    machine: &Machine,
    method: &M,
    control: Control,
    excitation: &Excitation,
    with_drive: bool,
) -> [Result<Summary, RunError>; 2] {
    let system = machine.system();
    let groups = CART_CENTERS.into_iter().enumerate();
    let mut loads: Vec<Wrench> =
        groups.map(|(g, center)| group_load(&system, 4 * g..4 * g + 4, center.into(), Part::Total)).collect();
    // About a point off the cart, all components and both magnitudes differ.
    loads.push(group_load(&system, 0..machine.links.len(), [0.3, 0.7, -0.4].into(), Part::Total));
    loads.extend(with_drive.then(|| reaction(&system)));
    let mut extremes = vec![Extremes::NONE; loads.len()];
    let mut peaks = Peaks::new(&loads, &mut extremes);
    let outcome = run(&system, method, control, excitation, Output::Samples, &mut peaks);

    let (states, other) = machine.run(method, control, excitation, Output::Samples);
    let mut history = vec![0.0; states.len() * loads.len() * 6];
    evaluate(&loads, &states, |k| excitation.input(k), &mut history);
    let scale = largest(&history);
    let leapt = matches!((&outcome, &other), (Ok(peaks), Ok(history)) if peaks.steps < history.steps);
    let changed = matches!(&other, Ok(history) if history.contact_changes > 0);
    let tolerance = if leapt || changed { 1e-13 } else { 0.0 };
    for (l, extreme) in extremes.iter().enumerate() {
        // Force and moment, the y-z resultant of the force, and the magnitude of the moment.
        let values: Vec<[f64; 8]> = history
            .chunks(6 * loads.len())
            .map(|row| {
                let load: [f64; 6] = row[6 * l..6 * l + 6].try_into().expect("six");
                let [x, y, z, mx, my, mz] = load;
                let moment = mx.mul_add(mx, my.mul_add(my, mz * mz)).sqrt();
                [x, y, z, mx, my, mz, y.mul_add(y, z * z).sqrt(), moment]
            })
            .collect();
        for i in 0..8 {
            let trace: Vec<f64> = values.iter().map(|values| values[i]).collect();
            let most = trace.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = trace.iter().copied().fold(f64::INFINITY, f64::min);
            close(extreme.largest[i], most, tolerance, scale);
            close(extreme.smallest[i], least, tolerance, scale);
            // The first sample at which it is reached.
            let when = |reaches: &dyn Fn(f64) -> bool| {
                excitation.time(trace.iter().position(|&y| reaches(y)).expect("it is there"))
            };
            let margin = tolerance * scale;
            assert!(extreme.time_of_largest[i] >= when(&|y| y >= most - margin));
            assert!(extreme.time_of_smallest[i] >= when(&|y| y <= least + margin));
            if tolerance == 0.0 || most - least > 1e-3 * scale {
                assert_eq!(extreme.time_of_largest[i], when(&|y| y == most));
                assert_eq!(extreme.time_of_smallest[i], when(&|y| y == least));
            }
        }
    }
    [outcome, other]
}

/// Quiet parts between lively ones, of a length that is no multiple of a block.
fn motion(random: &mut Random) -> Vec<[f64; 3]> {
    let mut samples = cycle()[550..1150].to_vec();
    samples.extend(vec![[0.0; 3]; 200]);
    samples.extend(noise(random, 77));
    samples.extend(vec![[0.0; 3]; 900]);
    samples
}

#[test]
fn peaks_are_the_extremes_of_the_history() {
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
    let mut with_leaps = 0;
    for machine in [cart(), cart().with_damping(0.1), play, idle, on(Law::curve(&curve))] {
        // The drive force depends on the acceleration at every sample, so none is left out.
        for with_drive in [false, true] {
            let outcomes = compare(&machine, &Exact::<4>, ADAPTIVE, &excitation, with_drive);
            let [peaks, history] = outcomes.map(|outcome| outcome.expect("a run"));
            with_leaps += usize::from(peaks.steps < history.steps);
            assert!(!with_drive || peaks.steps == history.steps);
            let end = if peaks.steps == history.steps { peaks.end } else { history.end };
            assert_eq!(Summary { steps: history.steps, end, ..peaks }, history);
        }
    }
    assert!(with_leaps >= 3);
    for exponent in [1.5, 10.0 / 9.0] {
        let machine = on(Law::preloaded(6e7, 300.0, exponent));
        let [peaks, history] = compare(&machine, &Rk45, ADAPTIVE, &excitation, false);
        assert_eq!(peaks.expect("a run"), history.expect("a run"));
        let outcomes = compare(&machine, &Exponential::<16>, ADAPTIVE, &excitation, false);
        let [peaks, history] = outcomes.map(|outcome| outcome.expect("a run"));
        assert!(peaks.steps < history.steps);
        assert_eq!(Summary { steps: history.steps, end: history.end, ..peaks }, history);
    }
}

/// Peaks of a run that ends with an error are those of the instants before it.
#[test]
fn peaks_before_an_error_are_kept() {
    let samples = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let control = Control::Fixed { step: 1e-3 };
    let [outcome, other] = compare(&cart().with_damping(15.0), &Rk45, control, &excitation, false);
    assert!(matches!(outcome, Err(RunError::Diverged { .. })), "{outcome:?}");
    assert_eq!(outcome, other);
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
    let (play, preloaded) = (Law::sided(6e7, 6e7, 5e-6), Law::preloaded(6e7, 300.0, 1.5));
    for (law, always_damped) in [(play, true), (play, false), (preloaded, true)] {
        let (mut machine, groups) = cart_on(law.expect("a law"));
        if !always_damped {
            for link in &mut machine.links {
                *link = link.damped_in_contact().expect("a clearance");
            }
        }
        let mut changes = yardstick(machine.links.len());
        changes.truncate(changes.len() - 2);
        let values: Vec<f64> = (0..3)
            .flat_map(|_| {
                let ([a, b, c], mass) = (<[f64; 3]>::from(random.vector(0.05)), random.between(0.9, 1.1));
                // Soft springs beside strong dampers in contact, whose force decides the peaks.
                let sizes = if always_damped { [1.0; 2] } else { [0.01, 20.0] };
                let factors = std::array::from_fn::<f64, 8, _>(|k| sizes[k / 4] * random.between(0.7, 1.4));
                [mass, a, b, c].into_iter().chain(factors)
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
            alike(alone, &whole[..few.len()], 1e-12); // Leaps round otherwise than steps.
        }
    }
}
