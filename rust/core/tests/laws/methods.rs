//! The methods: agreement of loads, work, and steps at samples.

use guideload::{
    Control, Exact, Excitation, Exponential, Method, NamedMethod, Output, Radau, Rk45, RunError, Start,
    State, Summary,
};

use crate::common::{
    ADAPTIVE, Machine, Random, adaptive, cart, cart_clear, cart_stiff, close, cycle, difference, largest,
    noise, paper, preloaded_cart, random_machine, wrenches,
};

/// Largest difference of the link loads from the exact ones, relative to the load scale, as a multiple of the tolerance.
fn misses<M: Method>(
    method: &M,
    machine: &Machine,
    excitation: &Excitation,
    exact: &[f64],
    rtol: f64,
) -> (f64, Summary) {
    let (states, summary) = machine.states(method, adaptive(rtol), excitation);
    (difference(&machine.loads_of(&states), exact) / summary.load_scale / rtol, summary)
}

const TOLERANCES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];

/// Tolerances, one per decade where runs are cheap.
const DECADES: [f64; 7] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10];

/// Straight stretches of an excitation along x, between the samples where its slope changes.
fn straights(excitation: &Excitation) -> usize {
    let at = |k: usize| (excitation.time(k), excitation.input(k)[0]);
    let bends = |k: &usize| {
        let ((t0, a0), (t1, a1), (t2, a2)) = (at(k - 1), at(*k), at(k + 1));
        ((a1 - a0) * (t2 - t1) - (a2 - a1) * (t1 - t0)).abs() > 1e-9 * (t2 - t0)
    };
    1 + (1..excitation.count() - 1).filter(bends).count()
}

#[track_caller]
fn assert_agree<M: Method>(
    name: &str,
    method: &M,
    machine: &Machine,
    excitation: &Excitation,
    tolerances: &[f64],
) {
    let exact = machine.exact_loads(excitation);
    for &rtol in tolerances {
        let (times, summary) = misses(method, machine, excitation, &exact, rtol);
        println!("{name} {rtol:e}: {times:.3} x, {} + {} steps", summary.steps, summary.rejected);
        assert!(times <= 10.0, "{name} at {rtol:e}: off by {times} x the tolerance"); // Asked in issue 2.
        assert!(summary.steps >= straights(excitation));
    }
}

/// The motion up to a second after the end of the acceleration: rest, acceleration with both jerks, cruise.
fn start_of_cycle() -> Vec<[f64; 3]> {
    cycle()[500..1700].to_vec()
}

#[test]
fn methods_agree_on_the_cart() {
    let samples = start_of_cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    assert_agree("rk45", &Rk45, &cart(), &excitation, &DECADES);
    assert_agree("radau", &Radau, &cart(), &excitation, &DECADES);
}

#[test]
fn methods_agree_on_the_scene_of_the_paper() {
    let samples = start_of_cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    assert_agree("rk45", &Rk45, &paper(), &excitation, &TOLERANCES);
    assert_agree("radau", &Radau, &paper(), &excitation, &TOLERANCES);
}

#[test]
fn methods_agree_on_the_stiff_cart() {
    let samples = start_of_cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &samples[..500]).expect("sound");
    assert_agree("radau", &Radau, &cart_stiff(), &excitation, &DECADES);
    // Rk45 reaches this accuracy too, but stability requires about 3.6e4 / 3.3 steps per second once the machine moves.
    let excitation = Excitation::uniform(0.0, 1e-3, &samples[80..180]).expect("sound");
    assert_agree("rk45", &Rk45, &cart_stiff(), &excitation, &TOLERANCES);
    let (_, summary) = cart_stiff().states(&Rk45, ADAPTIVE, &excitation);
    assert!((800..2500).contains(&(summary.steps + summary.rejected)), "{summary:?}");
}

/// Without damping, an error does not decay.
#[test]
fn methods_agree_over_seconds_without_damping() {
    let mut samples = vec![[0.0; 3]; 1500];
    for (k, sample) in samples[..400].iter_mut().enumerate() {
        sample[0] = 2.2 * f64::min(1.0, k as f64 / 88.0);
    }
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let machine = cart().with_damping(0.0);
    assert_agree("rk45", &Rk45, &machine, &excitation, &TOLERANCES);
    assert_agree("radau", &Radau, &machine, &excitation, &TOLERANCES);
    // The same with few samples, so that the control determines the step.
    let time = [0.0, 0.088, 0.4, 0.4, 1.5];
    let samples = [[0.0; 3], [2.2, 0.0, 0.0], [2.2, 0.0, 0.0], [0.0; 3], [0.0; 3]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    assert_agree("rk45, few knots", &Rk45, &machine, &excitation, &[1e-4, 1e-7, 1e-9]);
    assert_agree("radau, few knots", &Radau, &machine, &excitation, &TOLERANCES);
}

#[test]
fn methods_agree_on_any_scene_under_any_load() {
    let mut random = Random::new(71);
    for _ in 0..4 {
        let machine = random_machine(&mut random);
        let samples = noise(&mut random, 100);
        let wrench = wrenches(&mut random, 100, 300.0);
        let mut time = vec![0.0];
        for k in 1..100 {
            time.push(time[k - 1] + 10f64.powf(random.between(-5.0, -2.0)));
        }
        let excitation = Excitation::new(&time, &samples, Some(&wrench)).expect("sound");
        assert_agree("rk45", &Rk45, &machine, &excitation, &TOLERANCES);
        assert_agree("radau", &Radau, &machine, &excitation, &TOLERANCES);
    }
}

/// The yardstick's `pulse`: a half-sine of 20 ms after five seconds of rest, which general adaptive solvers miss.
#[test]
fn a_pulse_after_rest_is_never_missed() {
    let half_sine = |k: u32| [2.2 * (f64::from(k) * core::f64::consts::PI / 20.0).sin(), 0.0, 0.0];
    let mut time = vec![0.0];
    let mut samples = vec![[0.0; 3]];
    time.extend((0..=20).map(|k| 5.0 + f64::from(k) * 1e-3));
    samples.extend((0..20).map(half_sine).chain([[0.0; 3]]));
    time.push(5.1);
    samples.push([0.0; 3]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    for machine in [cart(), cart_stiff(), paper(), cart().with_damping(0.0)] {
        let exact = machine.exact_loads(&excitation);
        let rest = exact[..machine.links.len()].to_vec();
        let peak = |loads: &[f64]| {
            let moved: Vec<f64> = loads.iter().enumerate().map(|(i, x)| x - rest[i % rest.len()]).collect();
            largest(&moved)
        };
        for decade in 2..=10 {
            let rtol = 10f64.powi(-decade);
            let control = adaptive(rtol);
            for (states, summary) in
                [machine.states(&Rk45, control, &excitation), machine.states(&Radau, control, &excitation)]
            {
                assert!(summary.steps >= 22);
                let loads = machine.loads_of(&states);
                let off = difference(&loads, &exact) / summary.load_scale;
                assert!(off <= 10.0 * rtol, "{rtol:e}: off by {off:e} of the load scale");
                // Even at 1e-2 of the load scale, because steps end at every bend and cannot miss the pulse.
                close(peak(&loads), peak(&exact), f64::min(0.05, 10.0 * rtol), peak(&exact));
            }
        }
    }
}

#[test]
fn work_is_bounded() {
    let cycle = cycle();
    let clean = Excitation::uniform(0.0, 1e-3, &cycle[400..2400]).expect("sound");
    let mut random = Random::new(72);
    let noisy: Vec<[f64; 3]> =
        cycle[400..2400].iter().map(|a| [a[0] + random.between(-0.17, 0.17), 0.0, 0.0]).collect();
    let noisy = Excitation::uniform(0.0, 1e-3, &noisy).expect("sound");
    for excitation in [clean, noisy] {
        let control = adaptive(1e-6);
        let least = straights(&excitation);
        let (_, exact) = cart().states(&Exact, control, &excitation);
        assert_eq!((exact.steps, exact.rejected), (1999, 0));
        // One or more steps for each straight stretch, at most one per interval between samples, with and without noise.
        let (_, radau) = cart().states(&Radau, control, &excitation);
        assert!((least..=1999).contains(&radau.steps) && radau.rejected <= 20, "{least} {radau:?}");
        let (_, rk45) = cart().states(&Rk45, control, &excitation);
        assert!((least..=1999 + 20).contains(&rk45.steps), "{least} {rk45:?}");
        // At least one step between two bends, at any tolerance.
        let (_, loose) = cart().states(&Radau, adaptive(0.1), &excitation);
        assert!(loose.steps >= least, "{least} {loose:?}");
    }
}

#[test]
fn times_are_the_samples_and_what_lies_between_is_exact() {
    let samples = &cycle()[590..720];
    let excitation = Excitation::uniform(0.0, 1e-3, samples).expect("sound");
    for machine in [cart(), paper(), cart_stiff()] {
        let at_samples: Vec<f64> = (0..130).map(|k| excitation.time(k)).collect();
        // Roundings of a knot's time move the state by its rate times 1e-17 s; the rest of the step is the same.
        same(&machine, &Exact, ADAPTIVE, &excitation, &at_samples, 1e-11);
        same(&machine, &Radau, adaptive(1e-8), &excitation, &at_samples, 1e-11);
        same(&machine, &Rk45, adaptive(1e-8), &excitation, &at_samples, 1e-11);

        let between: Vec<f64> = (0..500).map(|k| 0.129 * (f64::from(k) + 0.5) / 500.0).collect();
        let output = Output::Times(&between);
        let exact = machine.loads_of(&machine.run(&Exact, ADAPTIVE, &excitation, output).0);
        // The exact state there is that of a trace with samples at these times.
        for (k, &t) in between.iter().enumerate().step_by(50) {
            let mut time = at_samples.clone();
            time.retain(|&sample| sample < t);
            time.push(t);
            let inputs: Vec<[f64; 3]> =
                time.iter().map(|&t| excitation.input_at(t)[..3].try_into().expect("three")).collect();
            let cut = machine.exact_loads(&Excitation::new(&time, &inputs, None).expect("sound"));
            let count = machine.links.len();
            let off = difference(&cut[cut.len() - count..], &exact[k * count..][..count]);
            assert!(off <= 1e-11 * largest(&exact));
        }
        for rtol in [1e-4, 1e-6, 1e-8] {
            let control = adaptive(rtol);
            let radau = machine.loads_of(&machine.run(&Radau, control, &excitation, output).0);
            let rk45 = machine.loads_of(&machine.run(&Rk45, control, &excitation, output).0);
            for (name, loads) in [("radau", radau), ("rk45", rk45)] {
                let off = difference(&loads, &exact) / largest(&exact) / rtol;
                println!("{name} {rtol:e}: between {off:.2} x");
                assert!(off <= 10.0, "{name} {rtol:e}: {off} x the tolerance");
            }
        }
    }
}

/// Steps from sample to sample are made two at a time where their length recurs, those to output times one by one.
#[test]
fn steps_made_two_at_a_time_are_steps_made_one_by_one() {
    let mut random = Random::new(83);
    // Stretches of two interval lengths, which are exact in binary, of odd and even numbers of samples, with jumps between some.
    let mut time = vec![0.0];
    for (turn, count) in [5, 1, 2, 3, 70, 9, 35, 4, 34, 1100].into_iter().enumerate() {
        let (last, step) = (time[time.len() - 1], [1.0 / 1024.0, 1.0 / 4096.0][turn % 2]);
        time.extend((1..=count).map(|k| last + f64::from(k) * step));
        if turn == 4 || turn == 5 {
            time.push(last + f64::from(count) * step);
        }
    }
    let mut samples = noise(&mut random, time.len());
    samples.as_flattened_mut().iter_mut().for_each(|acceleration| *acceleration *= 0.1);
    let wrench = wrenches(&mut random, samples.len(), 30.0);
    let excitation = Excitation::new(&time, &samples, Some(&wrench)).expect("sound");
    for machine in [random_machine(&mut random), cart_stiff(), cart_clear()] {
        same(&machine, &Exact, ADAPTIVE, &excitation, &time, 1e-13);
    }
}

#[test]
fn a_method_by_its_name_equals_the_method() {
    let (machine, motion) = (preloaded_cart(), start_of_cycle());
    let excitation = Excitation::uniform(0.0, 1e-3, &motion).expect("sound");
    let by_name_on = |machine: &Machine, name| {
        let (named, mut states): (_, Vec<State>) = (NamedMethod::from_name(name).expect("known"), Vec::new());
        let done =
            named.run(&machine.system(), ADAPTIVE, Start::AtRest, &excitation, Output::Samples, &mut states);
        (states, done.expect("a run that succeeds"))
    };
    assert!(by_name_on(&machine, "exponential") == machine.states(&Exponential, ADAPTIVE, &excitation));
    let machine = cart();
    let by_name = |name| by_name_on(&machine, name);
    assert!(by_name("exact") == machine.states(&Exact, ADAPTIVE, &excitation));
    assert!(by_name("rk45") == machine.states(&Rk45, ADAPTIVE, &excitation));
    assert!(by_name("implicit") == machine.states(&Radau, ADAPTIVE, &excitation));
    assert_eq!(NamedMethod::from_name("Exact"), None);
}

fn same<M: Method>(
    machine: &Machine,
    method: &M,
    control: Control,
    excitation: &Excitation,
    times: &[f64],
    tolerance: f64,
) {
    let (at_samples, run_over_samples) = machine.states(method, control, excitation);
    let by_samples = machine.loads_of(&at_samples);
    let (states, outcome) = machine.run(method, control, excitation, Output::Times(times));
    let summary = outcome.expect("a run that succeeds");
    assert_eq!((summary.recorded, summary.contact_changes), (times.len(), run_over_samples.contact_changes));
    let off = difference(&machine.loads_of(&states), &by_samples) / largest(&by_samples);
    assert!(off <= tolerance, "{off:e}");
}

/// Counts its instants, and stops the run after a number of them.
struct Until {
    instants: usize,
    most: usize,
}

impl guideload::Record for Until {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        Ok(())
    }

    fn stops(&mut self) -> bool {
        self.instants >= self.most
    }

    fn instant(&mut self, _: f64, _: &State, _: &[f64; 9]) {
        self.instants += 1;
    }
}

#[test]
fn a_record_stops_a_run() {
    let motion = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &motion).expect("a motion");
    let (system, preloaded) = (cart().system(), preloaded_cart().system());
    for &method in NamedMethod::ALL {
        let mut record = Until { instants: 0, most: 2000 };
        let system = if method == NamedMethod::Exponential { &preloaded } else { &system };
        let stopped = method.run(system, ADAPTIVE, Start::AtRest, &excitation, Output::Samples, &mut record);
        let Err(RunError::Interrupted { time }) = stopped else { panic!("{method:?}: {stopped:?}") };
        assert!((2000..motion.len()).contains(&record.instants), "{method:?}: {}", record.instants);
        assert!(time >= 1.9 && time < 1e-3 * motion.len() as f64, "{method:?}: {time}");
    }
}
