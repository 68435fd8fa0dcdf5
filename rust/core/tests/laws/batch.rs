//! A batch equals many single runs: each sample has the same numbers on any thread and beside any other samples.

use guideload::batch::{
    Base, Batch, Change, Group, Measure, Motion, NominalBody, Quantity, Statistic, Target, time_weights,
};
use guideload::{
    Body, Dof, Exact, Excitation, Free, Law, LawParameter, Link, ModelLevel, NamedMethod, Output, Part,
    SampleError, SceneError, Start, State, System, Wrench, group_load, reaction,
};
use nalgebra::Vector3;

use crate::common::{
    ADAPTIVE, CART_CENTERS, CURVE, Machine, Random, adaptive, at, cart, close, curve, cycle, exact_bows,
    linear, mean_and_largest, polynomial_bows, preloaded, rules, sided,
};

/// `cart` with other laws, and its carriages.
pub fn cart_on(law: Law) -> (Machine, Vec<Group>) {
    let groups = CART_CENTERS.iter().enumerate();
    let groups = groups.map(|(i, center)| {
        let [mean_rule, peak_rule] = [rules()[[0, 1, 4, 5][i]], rules()[[0, 1, 5, 4][3 - i]]];
        Group { mean_rule, peak_rule, ..Group::new((4 * i..4 * i + 4).collect(), (*center).into()) }
    });
    (cart().with_laws(|_, _| law), groups.collect())
}

pub fn base<'a>(machine: &'a Machine, groups: &'a [Group]) -> Base<'a> {
    Base {
        body: NominalBody {
            mass: machine.body.mass(),
            center_of_mass: machine.body.center_of_mass(),
            inertia: machine.body.inertia(),
            inertia_about_reference: false,
        },
        links: &machine.links,
        gravity: machine.gravity,
        free: machine.free,
        base_compliance: None,
        groups,
        payloads: &[],
    }
}

pub fn change(target: Target, constant: f64, terms: &[(usize, f64)]) -> Change {
    Change { target, constant, terms: terms.to_vec() }
}

/// Mass, centre of mass, and a factor on stiffness and one on damping of each carriage; then factors on the motion.
pub fn yardstick(links: usize) -> Vec<Change> {
    let mut changes = vec![change(Target::Mass, 0.0, &[(0, 1250.0)])];
    for (axis, at) in [0.12, -0.65, 0.18].into_iter().enumerate() {
        changes.push(change(Target::CenterOfMass(axis), at, &[(1 + axis, 1.0)]));
    }
    for link in 0..links {
        changes.push(change(Target::Damping(link), 0.0, &[(8 + link / 4, 5e4)]));
        let target = Target::Law { link, parameter: LawParameter::Stiffness };
        changes.push(change(target, 0.0, &[(4 + link / 4, 6e7)]));
    }
    changes.push(change(Target::Wrench, 0.0, &[(13, 1.0)]));
    changes.push(change(Target::Acceleration, 0.0, &[(12, 1.0)]));
    changes
}

pub fn draws(random: &mut Random, count: usize) -> Vec<[f64; 14]> {
    let mut draw = || {
        let mut values = [0.0; 14];
        values[0] = random.between(0.9, 1.1);
        values[1..4].fill_with(|| random.between(-0.05, 0.05));
        values[4..12].fill_with(|| random.between(0.7, 1.4));
        values[12..].fill_with(|| random.between(-1.5, 1.5));
        values
    };
    (0..count).map(|_| draw()).collect()
}

/// All measures of so many groups and of the drive.
pub fn all_measures(groups: usize) -> Vec<Measure> {
    let mut measures = Vec::new();
    for group in 0..groups {
        for quantity in Quantity::ALL {
            measures.extend(Statistic::ALL.map(|statistic| Measure::Load(group, quantity, statistic)));
        }
        measures.extend([Measure::MeanLoad(group), Measure::PeakLoad(group), Measure::ContactLost(group)]);
    }
    measures.extend(Statistic::ALL.map(Measure::Drive));
    measures
}

/// Whether it is the time of an extreme.
pub fn is_time(measure: &Measure) -> bool {
    use Statistic::{TimeOfMax, TimeOfMin};
    matches!(measure, Measure::Load(_, _, TimeOfMin | TimeOfMax) | Measure::Drive(TimeOfMin | TimeOfMax))
}

/// A motion that owns its samples.
#[derive(Clone)]
pub struct Trace {
    pub time: Vec<f64>,
    pub acceleration: Vec<[f64; 3]>,
    /// External loads, or none.
    pub wrench: Vec<[f64; 6]>,
    pub speed: Vec<f64>,
}

impl Trace {
    /// With uneven intervals, a jump and external loads.
    pub fn new(random: &mut Random, count: usize) -> Self {
        Self::with_intervals(
            random,
            count,
            |random, k| {
                if k == count / 2 { 0.0 } else { random.between(5e-4, 3e-3) }
            },
        )
    }

    /// Of a clock that ticks every millisecond, and now and then half a millisecond late.
    fn ticking(random: &mut Random, count: usize) -> Self {
        Self::with_intervals(random, count, |_, k| if k % 400 == 39 { 1.5 / 1024.0 } else { 1.0 / 1024.0 })
    }

    fn with_intervals(
        random: &mut Random,
        count: usize,
        interval: impl Fn(&mut Random, usize) -> f64,
    ) -> Self {
        let mut now = 0.3125;
        let time = (0..count)
            .map(|k| {
                now += interval(random, k);
                now
            })
            .collect();
        let mut vector = |size| <[f64; 3]>::from(random.vector(size));
        Self {
            time,
            acceleration: (0..count).map(|_| vector(2.0)).collect(),
            wrench: (0..count)
                .map(|_| {
                    let ([a, b, c], [d, e, f]) = (vector(2000.0), vector(300.0));
                    [a, b, c, d, e, f]
                })
                .collect(),
            speed: (0..count).map(|_| vector(1.0)[0]).collect(),
        }
    }

    /// With a constant excitation from sample `from` to sample `until`.
    fn constant(mut self, from: usize, until: usize) -> Self {
        let (acceleration, wrench) = (self.acceleration[from], self.wrench[from]);
        self.acceleration[from..=until].fill(acceleration);
        self.wrench[from..=until].fill(wrench);
        self
    }

    /// Without acceleration up to sample `until`.
    fn unmoved(mut self, until: usize) -> Self {
        self.acceleration[..until].fill([0.0; 3]);
        self
    }

    pub fn excitation(&self) -> Excitation<'_> {
        let wrench = (!self.wrench.is_empty()).then_some(&self.wrench[..]);
        Excitation::new(&self.time, &self.acceleration, wrench).expect("a sound trace")
    }

    pub fn motion(&self, exponent: f64) -> Motion<'_> {
        Motion { excitation: self.excitation(), speed: Some(&self.speed), exponent }
    }

    /// The motion with factors on its accelerations and external loads.
    pub fn scaled(&self, acceleration: f64, wrench: f64) -> Self {
        let mut scaled = self.clone();
        scaled.acceleration.as_flattened_mut().iter_mut().for_each(|x| *x *= acceleration);
        scaled.wrench.as_flattened_mut().iter_mut().for_each(|x| *x *= wrench);
        scaled
    }
}

/// The measures of one scene from its whole history under an excitation. `travel`: the motion without the factors of a sample.
pub fn by_hand(
    machine: &Machine,
    groups: &[Group],
    travel: &Motion,
    excitation: &Excitation,
    measures: &[Measure],
    method: Option<NamedMethod>,
) -> Vec<f64> {
    let mut states: Vec<State> = Vec::new();
    let (run_by, control) = (method.unwrap_or(NamedMethod::Exact), adaptive(1e-9));
    run_by
        .run(&machine.system(), control, Start::AtRest, excitation, Output::Samples, &mut states)
        .expect("a run that succeeds");
    let in_lanes = method.is_none() && machine.links.iter().all(|link| link.law().is_linear());
    let bows_by = if in_lanes { exact_bows } else { polynomial_bows };
    measures_of(machine, groups, travel, excitation, &states, bows_by, measures)
}

/// Bows of loads: [`exact_bows`] or [`polynomial_bows`].
pub type BowsBy = fn(&System, &Excitation, &[Wrench], &[State]) -> Vec<Vec<[f64; 6]>>;

/// The measures of one history by their definitions. `travel`: the motion without the factors of a sample.
pub fn measures_of(
    machine: &Machine,
    groups: &[Group],
    travel: &Motion,
    excitation: &Excitation,
    states: &[State],
    bows_by: BowsBy,
    measures: &[Measure],
) -> Vec<f64> {
    let system = machine.system();
    let wrenches: Vec<_> = groups
        .iter()
        .map(|group| group_load(&system, group.links.clone(), group.center, Part::Total))
        .collect();
    let history_of = |load: &Wrench| -> Vec<[f64; 6]> {
        states.iter().enumerate().map(|(k, state)| load.at(state, &excitation.input(k))).collect()
    };
    let loads: Vec<_> = wrenches.iter().map(history_of).collect();
    let bows = bows_by(&system, excitation, &wrenches, states);
    let reactions = history_of(&reaction(&system));
    let along_x: Vec<f64> = (0..states.len()).map(|k| travel.excitation.input(k)[0]).collect();
    let weights = time_weights(excitation);
    let statistic = |history: &[f64], statistic: Statistic| {
        let mut best = 0;
        for k in 0..history.len() {
            let better = match statistic {
                Statistic::Min | Statistic::TimeOfMin => history[k] < history[best],
                _ => history[k] > history[best],
            };
            best = if better { k } else { best };
        }
        match statistic {
            Statistic::Min | Statistic::Max => history[best],
            Statistic::TimeOfMin | Statistic::TimeOfMax => excitation.time(best),
            Statistic::Rms => history.iter().zip(&weights).map(|(x, w)| w * x * x).sum::<f64>().sqrt(),
            Statistic::Start => history[0],
        }
    };
    let measure = |measure: &Measure| match *measure {
        Measure::Load(group, quantity, of) => {
            let history: Vec<f64> = loads[group]
                .iter()
                .map(|load| match quantity {
                    Quantity::Resultant => load[1].hypot(load[2]),
                    component => load[component as usize],
                })
                .collect();
            statistic(&history, of)
        }
        Measure::Drive(_) if machine.free.contains(Dof::X) => f64::NAN,
        Measure::Drive(of) => statistic(&reactions.iter().map(|held| held[0]).collect::<Vec<_>>(), of),
        Measure::MeanLoad(group) | Measure::PeakLoad(group) => {
            let rules = [groups[group].mean_rule, groups[group].peak_rule];
            let [mean, largest] = mean_and_largest(
                rules,
                excitation,
                [travel.speed.expect("a speed"), &along_x],
                travel.exponent,
                &loads[group],
                &bows[group],
            );
            if matches!(measure, Measure::MeanLoad(_)) { mean } else { largest }
        }
        Measure::ContactLost(group) => {
            let position = guideload::position(&system);
            let lost = states.iter().any(|state| {
                let at = at(&position, state);
                groups[group].links.iter().any(|&link| {
                    let (law, d) = (machine.links[link].law(), machine.links[link].row().dot(&at));
                    match law.kind() {
                        "linear" => false,
                        "preloaded" => d.abs() >= law.edges()[1],
                        _ => law.force(d) == 0.0 && law.tangent(d) == 0.0,
                    }
                })
            });
            f64::from(u8::from(lost))
        }
    };
    measures.iter().map(measure).collect()
}

/// The machine of a row of values, built without a batch; curves have no stiffness to change.
fn machine_of(base: &Machine, values: &[f64; 14]) -> Machine {
    let center = base.body.center_of_mass() + Vector3::new(values[1], values[2], values[3]);
    let mut machine = base.clone();
    machine.body = Body::new(1250.0 * values[0], center, base.body.inertia()).expect("a body");
    for (i, link) in machine.links.iter_mut().enumerate() {
        let law = match link.law().kind() {
            "curve" => *link.law(),
            _ => link.law().with(LawParameter::Stiffness, 6e7 * values[4 + i / 4]).expect("a law"),
        };
        *link = Link::with_law(link.point(), link.direction(), law, 5e4 * values[8 + i / 4]).expect("a link");
    }
    machine
}

fn laws() -> [(Law, Option<NamedMethod>); 5] {
    [
        (linear(6e7), None),
        (sided(6e7, 6e7, 5e-6), Some(NamedMethod::Exact)),
        (sided(6e7, 3e7, 0.0), None),
        (curve(&CURVE), Some(NamedMethod::Exact)),
        (preloaded(6e7, 300.0, 1.5), Some(NamedMethod::Implicit)),
    ]
}

#[test]
fn a_row_equals_a_single_run() {
    let mut random = Random::new(41);
    let trace = Trace::new(&mut random, 120);
    for (law, method) in laws() {
        let (machine, groups) = cart_on(law);
        let measures = all_measures(groups.len());
        let values = draws(&mut random, 2);
        let mut changes = yardstick(machine.links.len());
        if law.kind() == "curve" {
            changes.retain(|change| !matches!(change.target, Target::Law { .. }));
        }
        for exponent in [3.0, 10.0 / 3.0] {
            let batch = Batch::new(
                base(&machine, &groups),
                trace.motion(exponent),
                &changes,
                &measures,
                method,
                1e-9,
            )
            .expect("a batch")
            .at_samples();
            let mut table = vec![0.0; values.len() * measures.len()];
            let failures =
                batch.run(values.len(), values.as_flattened(), 1, &mut table).expect("tables that fit");
            assert_eq!(failures, []);
            for (values, row) in values.iter().zip(table.chunks_exact(measures.len())) {
                let sample = machine_of(&machine, values);
                let scaled = trace.scaled(values[12], values[13]);
                let travel = trace.motion(exponent);
                let want = by_hand(&sample, &groups, &travel, &scaled.excitation(), &measures, method);
                // Step sizes depend on estimated errors, which change with rounding.
                let tolerance = if method == Some(NamedMethod::Implicit) { 1e-8 } else { 1e-12 };
                for ((measure, got), want) in measures.iter().zip(row).zip(&want) {
                    let scale = match measure {
                        Measure::Load(_, Quantity::Mx | Quantity::My | Quantity::Mz, _) => 1000.0,
                        Measure::Load(..) | Measure::Drive(_) => 10_000.0,
                        _ => want.abs(),
                    };
                    // A sum that is zero up to rounding has its extremes at any time.
                    if !(is_time(measure) && matches!(measure, Measure::Load(_, Quantity::Fx, _))) {
                        close(*got, *want, tolerance, scale);
                    }
                }
            }
        }
    }
}

#[test]
fn rows_do_not_depend_on_threads_or_other_rows() {
    let mut random = Random::new(5);
    let uneven = Trace::new(&mut random, 12);
    let ticking = Trace::ticking(&mut random, 700).constant(30, 650);
    let preloaded = (preloaded(6e7, 300.0, 1.5), Some(NamedMethod::Exponential));
    for (law, method) in [laws()[0], laws()[1], laws()[4], preloaded] {
        let trace = if method == Some(NamedMethod::Exponential) { &ticking } else { &uneven };
        let (machine, groups) = cart_on(law);
        let measures = all_measures(groups.len());
        let batch =
            Batch::new(base(&machine, &groups), trace.motion(3.0), &yardstick(16), &measures, method, 1e-6)
                .expect("a batch");
        let values = draws(&mut random, 100);
        let bits = |values: &[[f64; 14]], threads: usize| -> Vec<u64> {
            let mut table = vec![0.0; values.len() * measures.len()];
            batch.run(values.len(), values.as_flattened(), threads, &mut table).expect("tables that fit");
            table.into_iter().map(f64::to_bits).collect()
        };
        let all = bits(&values, 1);
        assert_eq!(all, bits(&values, 3));
        for part in [3..4, 70..100] {
            let alone = bits(&values[part.clone()], 2);
            assert_eq!(alone, all[part.start * measures.len()..part.end * measures.len()]);
        }
        let turned: Vec<_> = values.iter().rev().copied().collect();
        let turned = bits(&turned, 2);
        let rows = turned.chunks_exact(measures.len()).rev();
        assert!(rows.zip(all.chunks_exact(measures.len())).all(|(a, b)| a == b));
    }
}

#[test]
fn samples_without_a_result_have_a_reason_and_do_not_affect_others() {
    let (machine, groups) = cart_on(sided(6e7, 6e7, 5e-6));
    let trace = Trace::new(&mut Random::new(3), 50);
    let mut changes = vec![
        change(Target::Mass, 0.0, &[(0, 1.0)]),
        change(Target::Acceleration, 0.0, &[(2, 1.0)]),
        change(Target::Law { link: 3, parameter: LawParameter::Clearance }, 0.0, &[(1, 1.0)]),
    ];
    // Stiff to one side only: with gravity reversed no link carries the weight.
    for link in (0..16).step_by(2) {
        let target = Target::Law { link, parameter: LawParameter::PositiveStiffness };
        changes.push(change(target, 0.0, &[(3, 6e7)]));
    }
    changes.push(change(Target::Gravity(1), 0.0, &[(4, -9.80665)]));
    let measures = [Measure::Load(1, Quantity::Fy, Statistic::Max), Measure::ContactLost(3)];
    let batch = Batch::new(base(&machine, &groups), trace.motion(3.0), &changes, &measures, None, 1e-6)
        .expect("a batch");
    let good = [1250.0, 4e-6, 1.0, 1.0, 1.0];
    let rows = [
        good,
        [-2.0, 4e-6, 1.0, 1.0, 1.0],
        [1250.0, -1e-6, 1.0, 1.0, 1.0],
        [1250.0, 4e-6, f64::NAN, 1.0, 1.0],
        [1250.0, 4e-6, 1.0, 0.0, -1.0],
        good,
        [1250.0, 4e-6, 1e306, 1.0, 1.0],
    ];
    let mut table = [0.0; 14];
    let failures = batch.run(7, rows.as_flattened(), 2, &mut table).expect("tables that fit");
    let reasons: Vec<(usize, String)> = failures.iter().map(|(i, error)| (*i, error.to_string())).collect();
    let expected = [
        (1, "body.mass: expected > 0 kg, got -2"),
        (2, "links[3].clearance: expected >= 0 m"),
        (3, "factor on the acceleration: expected a finite number, got NaN"),
        (4, "no static equilibrium"),
        (6, "the loads are beyond the range of numbers"),
    ];
    assert_eq!(reasons.len(), expected.len(), "{reasons:?}");
    for ((index, reason), (at, start)) in reasons.iter().zip(expected) {
        assert_eq!(*index, at);
        assert!(reason.starts_with(start), "{reason}");
        assert!(table[2 * at..2 * at + 2].iter().all(|x| x.is_nan()));
    }
    assert_eq!(failures[0].1, SampleError::Scene(SceneError::Mass { got: -2.0 }));
    let mut alone = [0.0; 2];
    assert_eq!(batch.run(1, &good, 1, &mut alone), Ok(vec![]));
    for at in [0, 5] {
        assert_eq!(table[2 * at..2 * at + 2], alone);
    }
}

#[test]
fn an_unsupported_sample_names_the_motion() {
    let (machine, groups) = cart_on(linear(6e7));
    let trace = Trace::new(&mut Random::new(3), 5);
    let changes: Vec<Change> = (0..16)
        .map(|link| change(Target::Law { link, parameter: LawParameter::Stiffness }, 0.0, &[(link % 2, 6e7)]))
        .collect();
    let measures = [Measure::Load(0, Quantity::Fy, Statistic::Rms)];
    let batch = Batch::new(base(&machine, &groups), trace.motion(3.0), &changes, &measures, None, 1e-6)
        .expect("a batch");
    let mut table = [0.0; 2];
    let failures = batch.run(2, &[1.0, 0.0, 1.0, 1.0], 1, &mut table).expect("tables that fit");
    assert!(
        matches!(failures[..], [(0, SampleError::Scene(SceneError::Unsupported { .. }))]),
        "{failures:?}"
    );
    assert!(table[0].is_nan() && table[1] > 0.0);
}

#[test]
fn histories_are_those_of_a_single_run() {
    let mut random = Random::new(23);
    let trace = Trace::new(&mut random, 40);
    let (machine, groups) = cart_on(sided(6e7, 6e7, 5e-6));
    let batch = Batch::new(base(&machine, &groups), trace.motion(3.0), &yardstick(16), &[], None, 1e-6)
        .expect("a batch");
    let mut values = draws(&mut random, 3);
    values[1][0] = 0.0;
    let width = 40 * groups.len() * 6;
    let mut out = vec![0.0; 3 * width];
    let failures = batch.histories(3, values.as_flattened(), &mut out).expect("tables that fit");
    assert!(matches!(failures[..], [(1, SampleError::Scene(SceneError::Mass { got: 0.0 }))]));
    assert!(out[width..2 * width].iter().all(|x| x.is_nan()));
    let machine = machine_of(&machine, &values[2]);
    let scaled = trace.scaled(values[2][12], values[2][13]);
    let (states, _) = machine.states(&Exact, ADAPTIVE, &scaled.excitation());
    let system = machine.system();
    for (g, group) in groups.iter().enumerate() {
        let load = group_load(&system, group.links.clone(), group.center, Part::Total);
        for (k, state) in states.iter().enumerate() {
            let want = load.at(state, &[0.0; 9]);
            for (axis, want) in want.into_iter().enumerate() {
                close(out[2 * width + (k * groups.len() + g) * 6 + axis], want, 1e-12, 1e4);
            }
        }
    }
}

#[test]
fn the_drive_force_with_free_x_and_the_mean_load_at_standstill_are_nan() {
    let (mut machine, groups) = cart_on(linear(6e7));
    machine.links.push(Link::new(Vector3::zeros(), Vector3::x(), 1e7, 1e4).expect("a link"));
    machine.free = Free::ALL;
    let acceleration = [[0.0; 3]; 3];
    let excitation = Excitation::uniform(0.0, 0.1, &acceleration).expect("a motion");
    let measures = [
        Measure::Drive(Statistic::Max),
        Measure::MeanLoad(0),
        Measure::Load(0, Quantity::Fy, Statistic::Rms),
        Measure::Load(0, Quantity::Fy, Statistic::Start),
        Measure::Load(0, Quantity::Fy, Statistic::TimeOfMax),
    ];
    for speed in [None, Some(&[0.0; 3][..])] {
        let motion = Motion { excitation, speed, exponent: 3.0 };
        let batch = Batch::new(base(&machine, &groups), motion, &[], &measures, None, 1e-6).expect("a batch");
        let mut row = [0.0; 5];
        assert_eq!(batch.run(1, &[], 1, &mut row), Ok(vec![]));
        assert!(row[0].is_nan() && row[1].is_nan());
        // At rest the load is always the static one, and the time of an extreme is that of its first occurrence.
        close(row[2], row[3].abs(), 1e-14, row[3].abs());
        assert_eq!(row[4], 0.0);
    }
}

const PEAK: Measure = Measure::Load(0, Quantity::Fy, Statistic::Max);

#[test]
fn auto_chooses_the_method_by_the_laws_of_the_sample() {
    // The clearance may be zero: some samples are linear, others are not, and all are exact.
    let (machine, groups) = cart_on(linear(6e7));
    let motion_samples = cycle();
    let excitation = Excitation::uniform(0.0, 1e-3, &motion_samples[..900]).expect("a motion");
    let motion = Motion { excitation, speed: None, exponent: 3.0 };
    let changes: Vec<Change> = (0..16)
        .map(|link| change(Target::Law { link, parameter: LawParameter::Clearance }, 0.0, &[(0, 1.0)]))
        .collect();
    let measures = [Measure::ContactLost(0), PEAK];
    let batch = Batch::new(base(&machine, &groups), motion, &changes, &measures, None, 1e-6)
        .expect("a batch")
        .at_samples();
    let mut table = [0.0; 4];
    assert_eq!(batch.run(2, &[0.0, 5e-6], 1, &mut table), Ok(vec![]));
    assert_eq!([table[0], table[2]], [0.0, 1.0]);
    for (row, clearance) in [0.0, 5e-6].into_iter().enumerate() {
        let (machine, _) = cart_on(sided(6e7, 6e7, clearance));
        let system = machine.system();
        let model_level = if clearance == 0.0 { ModelLevel::Linear } else { ModelLevel::PiecewiseLinear };
        assert_eq!(system.model_level(), model_level);
        let (states, _) = machine.states(&Exact, ADAPTIVE, &excitation);
        let load = group_load(&system, 0..4, groups[0].center, Part::Total);
        let peak = states.iter().map(|state| load.at(state, &[0.0; 9])[1]).fold(f64::MIN, f64::max);
        close(table[2 * row + 1], peak, 1e-12, 1e4);
    }
}

/// In vector lanes, and by themselves where the error or the interval asks for it; also at rest, and beside a sample that fails.
#[test]
fn preloaded_samples_side_by_side_take_the_steps_that_they_take_by_themselves() {
    let mut random = Random::new(8);
    let trace = Trace::ticking(&mut random, 800).constant(100, 700);
    let (machine, groups) = cart_on(preloaded(6e7, 300.0, 1.5));
    let measures: Vec<Measure> = (0..groups.len())
        .flat_map(|group| [Statistic::Min, Statistic::Max].map(|of| Measure::Load(group, Quantity::Fy, of)))
        .collect();
    for rtol in [1e-3, 1e-6] {
        let motion = trace.motion(3.0);
        let count = motion.excitation.count();
        let base = base(&machine, &groups);
        let batch = Batch::new(base, motion, &yardstick(16), &measures, None, rtol);
        let batch = batch.expect("a batch").at_samples();
        let mut values = draws(&mut random, 11);
        values[5][12] = 1e306;
        let mut table = vec![0.0; values.len() * measures.len()];
        let failures =
            batch.run(values.len(), values.as_flattened(), 1, &mut table).expect("tables that fit");
        assert_eq!(failures.iter().map(|(index, _)| *index).collect::<Vec<_>>(), [5]);
        let mut loads = vec![0.0; values.len() * count * groups.len() * 6];
        batch.histories(values.len(), values.as_flattened(), &mut loads).expect("tables that fit");
        for (index, row) in table.chunks_exact(measures.len()).enumerate().filter(|(index, _)| *index != 5) {
            let loads = &loads[index * count * groups.len() * 6..][..count * groups.len() * 6];
            for (group, got) in row.chunks_exact(2).enumerate() {
                let fy = loads.iter().skip(6 * group + 1).step_by(6 * groups.len());
                let (least, most) = fy.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), fy| {
                    (f64::min(least, *fy), f64::max(most, *fy))
                });
                close(got[0], least, 1e-13, 10_000.0);
                close(got[1], most, 1e-13, 10_000.0);
            }
        }
    }
}

/// It runs in a lane until the motion starts, whose loads overflow. The tolerance is so loose that its neighbours are in lanes, too.
#[test]
fn a_preloaded_sample_that_fails_in_its_run_leaves_its_neighbours_their_bits() {
    let mut random = Random::new(9);
    let trace = Trace::ticking(&mut random, 200).unmoved(60);
    let (machine, groups) = cart_on(preloaded(6e7, 300.0, 1.5));
    let measures = all_measures(groups.len());
    let base = base(&machine, &groups);
    let batch =
        Batch::new(base, trace.motion(3.0), &yardstick(16), &measures, Some(NamedMethod::Exponential), 1e-3)
            .expect("a batch");
    let mut values = draws(&mut random, 8);
    let run = |values: &[[f64; 14]]| {
        let mut table = vec![0.0; values.len() * measures.len()];
        let failures =
            batch.run(values.len(), values.as_flattened(), 1, &mut table).expect("tables that fit");
        let rows = table.chunks_exact(measures.len());
        (rows.map(|row| row.iter().map(|x| x.to_bits()).collect()).collect::<Vec<Vec<u64>>>(), failures)
    };
    let (mut sound, none) = run(&values);
    assert!(none.is_empty());
    values[5][12] = 1e160;
    let (mut beside, failures) = run(&values);
    assert!(matches!(&failures[..], [(5, SampleError::Run(_))]), "{failures:?}");
    sound.remove(5);
    beside.remove(5);
    assert_eq!(sound, beside);
}
