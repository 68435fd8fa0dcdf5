//! The short way gives the bits of the long one, and the live step the loads of a run.

use guideload::{
    Body, Carriage, Control, Error, Exact, Excitation, Exponential, Extremes, Free, Law, Link, Load, Machine,
    MassProperties, Method, Output, Part, Peaks, Radau, RunError, SampledSystem, Scene, SceneError,
    Simulation, System, carriage_ends, carriage_links, group_load, run,
};
use nalgebra::{Matrix3, Vector3};

const PERIOD: f64 = 2e-3;
const BODY: MassProperties = MassProperties {
    mass: 1250.0,
    center_of_mass: [0.12, -0.65, 0.18],
    inertia: [[420.0, 15.0, -8.0], [15.0, 310.0, 22.0], [-8.0, 22.0, 380.0]],
};
const CARRIAGE: Carriage = Carriage {
    center: [0.0, 0.05, -0.35],
    length: 0.6,
    stiffness_y: 120e6,
    stiffness_z: 90e6,
    damping_y: 1e5,
    damping_z: 8e4,
    law_y: None,
    law_z: None,
};

/// Accelerations along x, up and down with jumps of the slope.
fn motion(count: usize) -> Vec<[f64; 3]> {
    let at = |k: usize| f64::from(((k / 7 * 13) % 11) as u32) * 0.4 - 2.0 + 0.01 * (k % 7) as f64;
    (0..count).map(|k| [at(k), 0.0, 0.0]).collect()
}

fn simulation(carriage: Carriage) -> Simulation {
    let mut machine = Machine::new(BODY).expect("a body");
    for x in [-0.35, 0.35] {
        machine.add(Carriage { center: [0.1, 0.05, x], ..carriage }).expect("a carriage");
    }
    machine.assemble().expect("supported")
}

/// The extremes by the functions below, for laws along y and z.
fn the_long_way<M: Method>(method: &M, [y, z]: [Law; 2], excitation: &Excitation) -> [Extremes; 2] {
    let inertia = Matrix3::new(420.0, 15.0, -8.0, 15.0, 310.0, 22.0, -8.0, 22.0, 380.0);
    let body = Body::new(1250.0, Vector3::new(0.12, -0.65, 0.18), inertia).expect("a body");
    let centers = [-0.35, 0.35].map(|z| Vector3::new(0.1, 0.05, z));
    let mut links = Vec::new();
    for (k, (point, direction)) in
        centers.into_iter().flat_map(|center| carriage_ends(center, 0.6)).enumerate()
    {
        let law = [y, z][k % 2].scaled(0.5).expect("half");
        links.push(Link::with_law(point, direction, law, [1e5, 8e4][k % 2] / 2.0).expect("a link"));
    }
    let scene = Scene::new(body, &links, Vector3::new(0.0, -9.80665, 0.0), Free::GUIDED).expect("a scene");
    let system = System::new(&scene).expect("supported");
    let loads = [0, 1].map(|k| group_load(&system, 4 * k..4 * k + 4, centers[k], Part::Total));
    let mut extremes = [Extremes::NONE; 2];
    let control = Control::Adaptive { rtol: 1e-6 };
    run(
        &system,
        method,
        control,
        excitation,
        Output::Samples,
        &mut Peaks::new(&system, excitation, &loads, &mut extremes),
    )
    .expect("a run");
    extremes
}

fn bits_agree<M: Method>(method: &M, laws: [Law; 2], carriage: Carriage) {
    let motion = motion(400);
    let excitation = Excitation::uniform(0.5, PERIOD / 4.0, &motion).expect("an excitation");
    let short = simulation(carriage).extremes(&excitation).expect("a run");
    for (short, long) in short.iter().zip(the_long_way(method, laws, &excitation)) {
        let ranges = [short.fy, short.fz, short.mx, short.my, short.mz, short.resultant, short.moment];
        for (range, k) in ranges.iter().zip(1..) {
            assert_eq!(range.smallest.value.to_bits(), long.smallest[k].to_bits());
            assert_eq!(range.largest.value.to_bits(), long.largest[k].to_bits());
            assert_eq!(
                [range.smallest.time, range.largest.time],
                [long.time_of_smallest[k], long.time_of_largest[k]]
            );
        }
        assert_eq!(long.largest[0], 0.0); // no force along the rails
    }
}

#[test]
fn the_short_way_gives_the_bits_of_the_long_one_whatever_the_laws() {
    let [y, z] = [120e6, 90e6].map(|stiffness| Law::linear(stiffness).expect("a law"));
    bits_agree(&Exact, [y, z], CARRIAGE);
    let loose = Law::sided(120e6, 120e6, 2e-6).expect("a law");
    bits_agree(&Exact, [loose, z], Carriage { law_y: Some(loose), ..CARRIAGE });
    let preloaded = Law::preloaded(120e6, 4000.0, 1.5).expect("a law");
    bits_agree(&Exponential, [preloaded, z], Carriage { law_y: Some(preloaded), ..CARRIAGE });
    bits_agree(
        &Radau,
        [preloaded, loose],
        Carriage { law_y: Some(preloaded), law_z: Some(loose), ..CARRIAGE },
    );
}

#[test]
fn a_carriage_has_the_links_of_carriage_links() {
    let simulation = simulation(CARRIAGE);
    let center = Vector3::new(0.1, 0.05, 0.35);
    let links = carriage_links(center, 0.6, [120e6, 90e6], [1e5, 8e4]).expect("links");
    assert!(simulation.system().links().skip(4).eq(&links));
}

#[test]
fn at_rest_the_carriages_bear_the_weight() {
    let simulation = simulation(CARRIAGE);
    let loads = simulation.loads_at_rest();
    let sum = |of: fn(&Load) -> f64| loads.iter().map(of).sum::<f64>();
    let weight = 1250.0 * 9.80665;
    assert!(
        (sum(|load| load.fy) + weight).abs() < 1e-9 * weight && sum(|load| load.fz).abs() < 1e-9 * weight
    );
}

#[test]
fn loads_at_samples_are_those_of_the_recorded_states() {
    let (simulation, motion) = (simulation(CARRIAGE), motion(300));
    let excitation = Excitation::uniform(0.0, PERIOD, &motion).expect("an excitation");
    let mut states = Vec::<guideload::State>::new();
    let control = Control::Adaptive { rtol: 1e-6 };
    run(simulation.system(), &Exact, control, &excitation, Output::Samples, &mut states).expect("a run");
    let of_second = group_load(simulation.system(), 4..8, Vector3::new(0.1, 0.05, 0.35), Part::Total);
    let mut k = 0;
    simulation
        .at_samples(&excitation, |time, loads| {
            assert_eq!(time, PERIOD * k as f64);
            let Load { fy, fz, mx, my, mz } = loads.as_slice()[1];
            assert_eq!(of_second.at(&states[k], &[0.0; 9])[1..], [fy, fz, mx, my, mz]);
            k += 1;
        })
        .expect("a run");
    assert_eq!(k, 300);
}

#[test]
fn a_live_step_gives_the_loads_of_a_run_in_f64_and_f32() {
    let (simulation, motion) = (simulation(CARRIAGE), motion(2000));
    let excitation = Excitation::uniform(0.0, PERIOD, &motion).expect("an excitation");
    let (mut double, mut single) = (Vec::new(), Vec::new());
    let mut live =
        (simulation.live::<f64>(PERIOD).expect("linear"), simulation.live::<f32>(PERIOD).expect("linear"));
    for _ in 0..2 {
        (double, single) = (Vec::new(), Vec::new());
        for [a, ..] in &motion {
            double.push(live.0.step(*a).as_slice().to_vec());
            single.push(live.1.step(*a as f32).as_slice().to_vec());
        }
        live.0.reset();
        live.1.reset();
    }
    assert_eq!(live.0.loads().as_slice(), simulation.loads_at_rest().as_slice());
    let (mut k, mut scale, mut errors) = (0, 0.0_f64, [0.0_f64; 2]);
    simulation
        .at_samples(&excitation, |_, loads| {
            for ((load, double), single) in loads.iter().zip(&double[k]).zip(&single[k]) {
                scale = scale.max(load.resultant());
                let apart = |double: f64, other: f64| (double - other).abs();
                for [run, double, single] in [
                    [load.fy, double.fy, single.fy.into()],
                    [load.fz, double.fz, single.fz.into()],
                    [load.mx, double.mx, single.mx.into()],
                    [load.my, double.my, single.my.into()],
                    [load.mz, double.mz, single.mz.into()],
                ] {
                    errors = [errors[0].max(apart(run, double)), errors[1].max(apart(run, single))];
                }
            }
            k += 1;
        })
        .expect("a run");
    // Roundings of one step last as long as the vibration rings, some hundred steps.
    assert!(errors[0] < 1e-12 * scale && errors[1] < 1e-5 * scale, "{errors:?} of {scale}");
}

#[test]
fn a_number_of_a_carriage_out_of_its_range_is_named_as_it_was_given() {
    let mut machine = Machine::new(BODY).expect("a body");
    machine.add(CARRIAGE).expect("a carriage");
    let stiff = machine.add(Carriage { stiffness_y: -1.0, ..CARRIAGE }).expect_err("negative");
    assert_eq!(stiff.to_string(), "carriages[1].stiffness_y: expected a finite number >= 0 N/m, got -1");
    let law_y = Law::linear(1e8).ok();
    for (field, carriage) in [
        ("length", Carriage { length: f64::NAN, ..CARRIAGE }),
        ("length", Carriage { length: -0.6, ..CARRIAGE }),
        ("stiffness_y", Carriage { stiffness_y: f64::NAN, law_y, ..CARRIAGE }),
        ("stiffness_z", Carriage { stiffness_z: f64::INFINITY, ..CARRIAGE }),
        ("damping_y", Carriage { damping_y: -2.0, ..CARRIAGE }),
        ("damping_z", Carriage { damping_z: f64::NAN, ..CARRIAGE }),
    ] {
        let refused = machine.add(carriage);
        let Err(SceneError::Carriage { index: 1, field: named, .. }) = refused else {
            panic!("{field}: {refused:?}");
        };
        assert_eq!(named, field);
    }
    machine.add(CARRIAGE.at([0.0, 0.05, 0.35])).expect("a carriage");
    assert_eq!(machine.assemble().expect("supported").loads_at_rest().as_slice().len(), 2);
}

#[test]
fn what_leaves_the_range_of_numbers_is_an_error() {
    let simulation = simulation(CARRIAGE);
    let out_of_range = Some(RunError::OutOfRange);
    for acceleration in [1e154, 1e306] {
        let samples = [[0.0; 3], [acceleration, 0.0, 0.0], [0.0; 3]];
        let excitation = Excitation::uniform(0.0, PERIOD, &samples).expect("finite");
        assert_eq!(simulation.extremes(&excitation).err(), out_of_range);
    }
    // The state at the end of an interval is not finite, and is not handed on.
    let samples = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]];
    let excitation = Excitation::uniform(0.0, 1e306, &samples).expect("finite");
    assert_eq!(simulation.extremes(&excitation).err(), out_of_range);
    let finite = |load: &Load| [load.fy, load.fz, load.mx, load.my, load.mz].iter().all(|x| x.is_finite());
    let outcome = simulation.at_samples(&excitation, |_, loads| assert!(loads.iter().all(finite)));
    assert_eq!(outcome.err(), out_of_range);
    let simulation = simulation.with_tolerance(f64::NAN);
    let excitation = Excitation::uniform(0.0, PERIOD, &samples).expect("finite");
    assert!(matches!(simulation.extremes(&excitation), Err(RunError::Tolerance { .. })));
}

#[test]
fn a_live_step_has_finite_numbers_until_it_is_given_others() {
    let simulation = simulation(CARRIAGE);
    for period in [1e-308, 1e300] {
        assert!(matches!(simulation.live::<f64>(period), Err(Error::Period { .. })), "{period}");
    }
    let inertia = BODY.inertia.map(|row| row.map(|entry| 1e36 * entry));
    let mut machine = Machine::new(MassProperties { mass: 1e39, inertia, ..BODY }).expect("a body");
    for z in [-0.35, 0.35] {
        let stiff = Carriage { stiffness_y: 1e45, stiffness_z: 1e45, ..CARRIAGE };
        machine.add(stiff.at([0.0, 0.05, z])).expect("a carriage");
    }
    let heavy = machine.assemble().expect("supported");
    heavy.live::<f64>(PERIOD).expect("within f64");
    assert!(matches!(
        heavy.live::<f32>(PERIOD),
        Err(Error::Period { .. } | Error::Run(RunError::OutOfRange))
    ));
    let mut live = simulation.live::<f64>(PERIOD).expect("linear");
    live.step(1.0);
    assert!(live.is_finite());
    live.step(f64::NAN);
    live.step(0.0);
    live.step(0.0);
    assert!(!live.is_finite());
    live.reset();
    live.step(1.0);
    assert!(live.is_finite());
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(SampledSystem::new(simulation.system(), period).is_none());
    }
}

#[test]
fn what_cannot_be_is_told() {
    let mut machine = Machine::new(BODY).expect("a body");
    assert_eq!(machine.assemble().err(), Some(SceneError::NoLinks));
    let nothing = machine.add(Carriage::default());
    assert_eq!(nothing, Err(SceneError::IdleLink));
    let no_body = Machine::new(MassProperties::default()).err();
    assert_eq!(no_body, Some(SceneError::Mass { got: 0.0 }));
    let loose = Law::sided(120e6, 120e6, 2e-6).expect("a law");
    let live = simulation(Carriage { law_y: Some(loose), ..CARRIAGE }).live::<f64>(PERIOD).err();
    assert_eq!(live, Some(Error::NotLinear));
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(simulation(CARRIAGE).live::<f32>(period), Err(Error::Period { .. })));
    }
    let text = Error::from(SceneError::NoLinks).to_string();
    assert_eq!(text, SceneError::NoLinks.to_string());
}

#[test]
fn extremes_are_those_of_the_straight_lines_however_few_samples_they_have() {
    let corners = [(0.0, 0.0), (0.005, 10.0), (0.105, 10.0), (0.11, 0.0), (0.21, 0.0)];
    let (mut time, mut along) = (vec![0.0], vec![[0.0; 3]]);
    for pair in corners.windows(2) {
        let ((from, start), (to, end)) = (pair[0], pair[1]);
        for part in 1..=128 {
            let share = f64::from(part) / 128.0;
            time.push(from + share * (to - from));
            along.push([start + share * (end - start), 0.0, 0.0]);
        }
    }
    let few: (Vec<f64>, Vec<[f64; 3]>) =
        corners.iter().map(|(time, along)| (*time, [*along, 0.0, 0.0])).unzip();
    let preloaded = Law::preloaded(120e6, 4000.0, 1.5).expect("a law");
    let loose = Law::sided(120e6, 120e6, 2e-6).expect("a law");
    for (law_y, accuracy) in [(None, 1e-9), (Some(loose), 1e-9), (Some(preloaded), 1e-5)] {
        let simulation = simulation(Carriage { law_y, damping_y: 2e3, damping_z: 2e3, ..CARRIAGE });
        let [coarse, fine] = [(&few.0, &few.1), (&time, &along)].map(|(time, acceleration)| {
            simulation.extremes(&Excitation::new(time, acceleration, None).expect("times")).expect("a run")
        });
        for (coarse, fine) in coarse.iter().zip(fine.iter()) {
            let scale = fine.resultant.largest.value;
            for (coarse, fine) in [(coarse.fy, fine.fy), (coarse.fz, fine.fz), (coarse.my, fine.my)] {
                assert!((coarse.largest.value - fine.largest.value).abs() < accuracy * scale);
                assert!((coarse.smallest.value - fine.smallest.value).abs() < accuracy * scale);
            }
            assert!((coarse.resultant.largest.value - scale).abs() < accuracy * scale);
        }
    }
}
