//! Extremes are those of the loads at all times, though most instants are left out, or passed over unevaluated, and few parts between them
//! are searched.

use guideload::batch::{Batch, Group, Measure, Motion, Quantity, Statistic};
use guideload::{
    Control, Exact, Excitation, Exponential, Extremes, Method, NamedMethod, Output, Part, Peaks, Rk45,
    RunError, State, Summary, Wrench, evaluate, group_load, reaction, run,
};

use crate::batch::{base, cart_on, draws, yardstick};
use crate::common::{
    ADAPTIVE, BALL, CART_CENTERS, CURVE, Machine, Random, alike, cart, cart_clear, close, curve, cycle,
    largest, linear, noise, preloaded, rules, sided, ticks,
};
use crate::contacts::refined;

/// Runs with extremes alone, and with histories of samples 16 times as dense, and compares them. `tolerance`: of the method, over the largest
/// load. Returns the outcomes with extremes and with a history, for comparison.
fn compare<M: Method>(
    machine: &Machine,
    method: &M,
    control: Control,
    samples: &[[f64; 3]],
    with_drive: bool,
    tolerance: f64,
) -> [Result<Summary, RunError>; 2] {
    let time = ticks(samples.len(), 1e-3);
    let excitation = Excitation::uniform(0.0, 1e-3, samples).expect("sound");
    let system = machine.system();
    let groups = CART_CENTERS.into_iter().enumerate();
    let mut loads: Vec<Wrench> =
        groups.map(|(g, center)| group_load(&system, 4 * g..4 * g + 4, center.into(), Part::Total)).collect();
    // About a point off the cart, all components and both magnitudes differ.
    loads.push(group_load(&system, 0..machine.links.len(), [0.3, 0.7, -0.4].into(), Part::Total));
    loads.extend(with_drive.then(|| reaction(&system)));
    let extremes_of = |excitation: &Excitation| {
        let mut extremes = vec![Extremes::NONE; loads.len()];
        let mut peaks = Peaks::new(&system, excitation, &loads, &mut extremes);
        let outcome = run(&system, method, control, excitation, Output::Samples, &mut peaks);
        (extremes, outcome)
    };
    let (extremes, outcome) = extremes_of(&excitation);
    let (states, other) = machine.run(method, control, &excitation, Output::Samples);
    if outcome.is_err() {
        return [outcome, other];
    }
    let values_of = |states: &[State], excitation: &Excitation| -> Vec<Vec<[f64; 8]>> {
        let mut history = vec![0.0; states.len() * loads.len() * 6];
        evaluate(&loads, states, |k| excitation.input(k), &mut history);
        let value = |load: &[f64]| {
            let [x, y, z, mx, my, mz]: [f64; 6] = load.try_into().expect("six");
            let moment = mx.mul_add(mx, my.mul_add(my, mz * mz)).sqrt();
            [x, y, z, mx, my, mz, y.mul_add(y, z * z).sqrt(), moment]
        };
        history.chunks(6 * loads.len()).map(|row| row.chunks(6).map(value).collect()).collect()
    };
    let (times, dense) = refined(&time, samples, 16);
    let finer = Excitation::new(&times, &dense, None).expect("sound");
    let (fine_extremes, _) = extremes_of(&finer);
    let coarse = values_of(&states, &excitation);
    let fine = values_of(&machine.run(method, control, &finer, Output::Samples).0, &finer);
    for (l, (extreme, fine_extreme)) in extremes.iter().zip(&fine_extremes).enumerate() {
        let of =
            |values: &[Vec<[f64; 8]>], i: usize| -> Vec<f64> { values.iter().map(|at| at[l][i]).collect() };
        for i in 0..8 {
            // Of forces and of moments the largest; moments are also differences of those of forces at arms of 0.06 m.
            let most =
                |alike: [usize; 3]| alike.map(|j| largest(&of(&fine, j))).into_iter().fold(0.0, f64::max);
            let forces = most([0, 1, 2]);
            let scale = if i < 3 || i == 6 { forces } else { f64::max(most([3, 4, 5]), 0.06 * forces) };
            let fine = of(&fine, i);
            let most = fine.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert!(
                extreme.largest[i] >= most - (tolerance + 1e-12) * scale,
                "{i}: {} {most}",
                extreme.largest[i]
            );
            close(extreme.largest[i], fine_extreme.largest[i], tolerance + 1e-12, scale);
            if i < 6 {
                close(extreme.smallest[i], fine_extreme.smallest[i], tolerance + 1e-12, scale);
            } else {
                // At the samples, and at contact changes.
                let least = of(&coarse, i).into_iter().fold(f64::INFINITY, f64::min);
                assert!(extreme.smallest[i] <= least + (tolerance + 1e-13) * scale);
            }
        }
        // At its time a load has its extreme.
        let mut extremes: Vec<(f64, usize, f64)> =
            (0..8).map(|i| (extreme.time_of_largest[i], i, extreme.largest[i])).collect();
        extremes.extend((0..6).map(|i| (extreme.time_of_smallest[i], i, extreme.smallest[i])));
        extremes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at: Vec<f64> = extremes.iter().map(|extreme| extreme.0).collect();
        let (there, _) = machine.run(method, control, &excitation, Output::Times(&at));
        for ((time, i, value), state) in extremes.into_iter().zip(&there) {
            let load = loads[l].at(state, &excitation.input_at(time));
            let [_, y, z, mx, my, mz] = load;
            let found = match i {
                6 => y.hypot(z),
                7 => mx.hypot(my).hypot(mz),
                i => load[i],
            };
            // Where a damper begins to act, loads jump: the time is beside the jump, by 1e-8 of the time between two instants.
            let beside = if machine.links[0].is_damped_in_contact() { 1e-8 } else { 1e-11 };
            close(found, value, tolerance + beside, largest(&load));
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
fn peaks_are_the_extremes_at_all_times() {
    let mut random = Random::new(61);
    let samples = motion(&mut random);
    let on = |law| cart().with_laws(|_, _| law);
    let play = cart_clear();
    let idle = play.clone().damped_in_contact();
    let mut with_long_steps = 0;
    for machine in [cart(), cart().with_damping(0.1), play, idle, on(curve(&CURVE))] {
        // The drive force depends on the acceleration at every sample, so none is left out.
        for with_drive in [false, true] {
            let outcomes = compare(&machine, &Exact, ADAPTIVE, &samples, with_drive, 0.0);
            let [peaks, history] = outcomes.map(|outcome| outcome.expect("a run"));
            with_long_steps += usize::from(peaks.steps < history.steps);
            assert!(!with_drive || peaks.steps == history.steps);
            let end = if peaks.steps == history.steps { peaks.end } else { history.end };
            assert_eq!(Summary { steps: history.steps, end, ..peaks }, history);
        }
    }
    assert!(with_long_steps >= 3);
    for exponent in [1.5, 10.0 / 9.0] {
        let machine = on(preloaded(6e7, 300.0, exponent));
        let [peaks, history] = compare(&machine, &Rk45, ADAPTIVE, &samples, false, 1e-5);
        assert_eq!(peaks.expect("a run"), history.expect("a run"));
        let outcomes = compare(&machine, &Exponential, ADAPTIVE, &samples, false, 1e-5);
        let [peaks, history] = outcomes.map(|outcome| outcome.expect("a run"));
        assert!(peaks.steps < history.steps);
        assert_eq!(Summary { steps: history.steps, end: history.end, ..peaks }, history);
    }
}

/// Peaks of a run that ends with an error are those of the instants before it.
#[test]
fn peaks_before_an_error_are_kept() {
    let control = Control::Fixed { step: 1e-3 };
    let [outcome, other] = compare(&cart().with_damping(15.0), &Rk45, control, &cycle(), false, 0.0);
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
    let (play, balls) = (sided(6e7, 6e7, 5e-6), preloaded(6e7, 300.0, BALL));
    for (law, always_damped) in [(play, true), (play, false), (balls, true)] {
        let (mut machine, groups) = cart_on(law);
        if !always_damped {
            machine = machine.damped_in_contact();
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
            let batch = Batch::new(base, motion, &changes, measures, None, 1e-6).expect("sound");
            let mut table = vec![0.0; 3 * measures.len()];
            assert_eq!(batch.run(3, &values, 1, &mut table).expect("sizes"), []);
            table
        };
        let (alone, whole) = (table(&few), table(&all));
        for (alone, whole) in alone.chunks(few.len()).zip(whole.chunks(all.len())) {
            alike(alone, &whole[..few.len()], 1e-12); // Long steps round otherwise than steps.
        }
    }
}

/// Of all measures that are extremes, on every way that a study takes: lanes, runs side by side, and single runs.
#[test]
fn studies_find_the_extremes_at_any_time() {
    let mut random = Random::new(63);
    let mut samples = cycle()[550..900].to_vec();
    samples.extend(noise(&mut random, 60));
    samples.extend(vec![[0.0; 3]; 90]);
    let (play, balls) = (sided(6e7, 6e7, 5e-6), preloaded(6e7, 300.0, BALL));
    for (law, method) in [
        (linear(6e7), None),
        (linear(6e7), Some(NamedMethod::Rk45)),
        (play, None),
        (balls, None),
        (balls, Some(NamedMethod::Implicit)),
    ] {
        let (machine, mut groups) = cart_on(law);
        for (group, rule) in groups.iter_mut().zip(rules()) {
            group.peak_rule = rule;
        }
        let mut measures = extremes_of_components(groups.len());
        measures.extend((0..groups.len()).map(Measure::PeakLoad));
        let tolerance = if method.is_none() && law != balls { 1e-11 } else { 1e-6 };
        let study = Study { machine, groups, measures, method, values: draws(&mut random, 4) };
        let [higher, all] = study.compare(1e-3, &samples, tolerance);
        assert!(higher > all / 10, "{higher} of {all} are higher between the samples");
    }
}

/// Where every sample is a kink, slopes change their signs often, and second differences say little of the curvature in between.
#[test]
fn extremes_under_noise_are_not_below_those_of_dense_samples() {
    for seed in 0..30 {
        let mut random = Random::new(100 + seed);
        let law = if seed % 3 == 0 { sided(6e7, 6e7, 5e-6) } else { linear(6e7) };
        let (machine, groups) = cart_on(law);
        let machine = machine.with_damping(random.between(0.02, 3.0));
        let mut samples = noise(&mut random, 150);
        samples.extend(vec![[0.0; 3]; 40]);
        let measures = extremes_of_components(groups.len());
        let study = Study { machine, groups, measures, method: None, values: draws(&mut random, 8) };
        study.compare(8e-4, &samples, 1e-10);
    }
}

/// Smallest and largest drive force and components of the groups, and largest resultants; the smallest ones are those at the samples.
fn extremes_of_components(groups: usize) -> Vec<Measure> {
    let extremes = [Statistic::Min, Statistic::Max];
    let mut measures: Vec<Measure> = extremes.map(Measure::Drive).to_vec();
    for group in 0..groups {
        let all = |quantity| extremes.map(|statistic| Measure::Load(group, quantity, statistic));
        measures.extend(Quantity::ALL.into_iter().flat_map(all));
    }
    measures.retain(|one| !matches!(one, Measure::Load(_, Quantity::Resultant, Statistic::Min)));
    measures
}

struct Study {
    machine: Machine,
    groups: Vec<Group>,
    measures: Vec<Measure>,
    method: Option<NamedMethod>,
    values: Vec<[f64; 14]>,
}

impl Study {
    /// Compares the measures at any time with those of samples 16 times as dense. Returns how many are higher than at the samples, and all.
    fn compare(&self, step: f64, samples: &[[f64; 3]], tolerance: f64) -> [usize; 2] {
        let time = ticks(samples.len(), step);
        let (times, dense) = refined(&time, samples, 16);
        let coarse = Excitation::new(&time, samples, None).expect("sound");
        let fine = Excitation::new(&times, &dense, None).expect("sound");
        let (found, same) = (self.table(coarse, false), self.table(fine, false));
        let (at_samples, between) = (self.table(coarse, true), self.table(fine, true));
        let mut higher = 0;
        for (index, measure) in self.measures.iter().cycle().take(found.len()).enumerate() {
            let scale = match measure {
                Measure::Load(_, Quantity::Mx | Quantity::My | Quantity::Mz, _) => 1000.0,
                _ => 10_000.0,
            };
            let is_least =
                matches!(measure, Measure::Load(_, _, Statistic::Min) | Measure::Drive(Statistic::Min));
            let above = |other: &[f64]| (found[index] - other[index]) / if is_least { -scale } else { scale };
            assert!(above(&same).abs() <= tolerance, "{measure:?}: {} {}", found[index], same[index]);
            assert!(above(&between) >= -tolerance, "{measure:?}: {} {}", found[index], between[index]);
            higher += usize::from(above(&at_samples) > 1e-4);
        }
        [higher, found.len()]
    }

    fn table(&self, excitation: Excitation, at_samples: bool) -> Vec<f64> {
        let motion = Motion { excitation, speed: None, exponent: 3.0 };
        let base = base(&self.machine, &self.groups);
        let batch =
            Batch::new(base, motion, &yardstick(16), &self.measures, self.method, 1e-7).expect("sound");
        let batch = if at_samples { batch.at_samples() } else { batch };
        let mut table = vec![0.0; self.values.len() * self.measures.len()];
        let failures =
            batch.run(self.values.len(), self.values.as_flattened(), 1, &mut table).expect("sizes");
        assert_eq!(failures, []);
        table
    }
}
