//! Changes: a parameter of a law, a scene with the values of a sample, and refused values.

use guideload::batch::{Batch, Change, Instance, Measure, Plan, Target};
use guideload::{BatchError, Body, ChangeError, Law, LawParameter, Link, SampleError, SceneError, System};
use nalgebra::Vector3;

use crate::batch::{Trace, base, cart_on, change, yardstick};
use crate::common::{GRAVITY, Random};

#[test]
fn changing_a_parameter_gives_the_law_with_that_parameter() {
    let (linear, sided) = (Law::linear(6e7), Law::sided(6e7, 3e7, 4e-6));
    let (balls, rollers) = (Law::preloaded(6e7, 600.0, 1.5), Law::preloaded(6e7, 600.0, 10.0 / 9.0));
    let curve = Law::curve(&[[-1e-5, -300.0], [0.0, 0.0], [1e-5, 100.0]]);
    let with = [
        (&linear, LawParameter::Stiffness, 5e7, Law::linear(5e7)),
        (&linear, LawParameter::PositiveStiffness, 5e7, Law::sided(5e7, 6e7, 0.0)),
        (&linear, LawParameter::NegativeStiffness, 0.0, Law::sided(6e7, 0.0, 0.0)),
        (&linear, LawParameter::Clearance, 5e-6, Law::sided(6e7, 6e7, 5e-6)),
        (&linear, LawParameter::Clearance, 0.0, Law::linear(6e7)),
        (&linear, LawParameter::Scale, 2.0, Law::linear(1.2e8)),
        (&sided, LawParameter::Stiffness, 8e7, Law::sided(8e7, 4e7, 4e-6)),
        (&sided, LawParameter::PositiveStiffness, 3e7, Law::sided(3e7, 3e7, 4e-6)),
        (&sided, LawParameter::Clearance, 0.0, Law::sided(6e7, 3e7, 0.0)),
        (&sided, LawParameter::Scale, 0.5, Law::sided(3e7, 1.5e7, 4e-6)),
        (&balls, LawParameter::Stiffness, 5e7, Law::preloaded(5e7, 600.0, 1.5)),
        (&balls, LawParameter::Preload, 700.0, Law::preloaded(6e7, 700.0, 1.5)),
        (&rollers, LawParameter::Preload, 700.0, Law::preloaded(6e7, 700.0, 10.0 / 9.0)),
        (&curve, LawParameter::Scale, 2.0, Law::curve(&[[-1e-5, -600.0], [0.0, 0.0], [1e-5, 200.0]])),
    ];
    for (law, parameter, value, want) in with {
        assert_eq!(law.expect("a law").with(parameter, value), want, "{parameter:?} {value}");
    }
    let refused = [
        (&linear, LawParameter::Stiffness, -1.0, SceneError::Stiffness { got: -1.0 }),
        (&sided, LawParameter::Clearance, -1e-6, SceneError::Clearance { got: -1e-6 }),
        (&sided, LawParameter::NegativeStiffness, -1.0, SceneError::Sides { positive: 6e7, negative: -1.0 }),
        (&balls, LawParameter::Preload, 0.0, SceneError::Preload { got: 0.0 }),
        (&curve, LawParameter::Scale, -1.0, SceneError::Factor { got: -1.0 }),
        (
            &linear,
            LawParameter::Preload,
            1.0,
            SceneError::NoParameter { parameter: "preload", law: "linear" },
        ),
        (
            &balls,
            LawParameter::Clearance,
            1.0,
            SceneError::NoParameter { parameter: "clearance", law: "preloaded" },
        ),
        (
            &curve,
            LawParameter::Stiffness,
            1.0,
            SceneError::NoParameter { parameter: "stiffness", law: "curve" },
        ),
    ];
    for (law, parameter, value, want) in refused {
        assert_eq!(law.expect("a law").with(parameter, value), Err(want));
    }
    for parameter in LawParameter::ALL {
        assert_eq!(LawParameter::from_name(parameter.name()), Some(parameter));
    }
}

#[test]
fn setting_the_stiffness_sets_the_nominal_stiffness() {
    let mut random = Random::new(8);
    for _ in 0..100 {
        let (a, b, c) = (random.between(0.0, 1e8), random.between(1.0, 1e8), random.between(0.0, 1e-5));
        let law = Law::sided(a, b, c).expect("a law").with(LawParameter::Stiffness, 3e7).expect("a law");
        assert_eq!(law.nominal(), 3e7);
        assert_eq!(law.clearance(), c);
    }
}

#[test]
fn a_changed_scene_is_the_one_made_directly() {
    let mut random = Random::new(17);
    let (machine, groups) = cart_on(Law::sided(6e7, 2e7, 5e-6).expect("a law"));
    let (body, inertia_about) = (machine.body, guideload::tensor::parallel_axes);
    let about_reference = inertia_about(&body.inertia(), body.mass(), &body.center_of_mass());
    let mut base = base(&machine, &groups);
    (base.body.inertia, base.body.inertia_about_reference) = (about_reference, true);
    let changes = [
        change(Target::Law { link: 2, parameter: LawParameter::Scale }, 1.0, &[(0, 0.5)]),
        change(Target::Law { link: 2, parameter: LawParameter::Clearance }, 2e-6, &[(1, 1e-6)]),
        change(Target::Law { link: 2, parameter: LawParameter::Stiffness }, 1e7, &[(0, 1e7), (1, 2e7)]),
        change(Target::Point { link: 2, axis: 0 }, -0.4, &[(1, 0.1)]),
        change(Target::Center { group: 1, axis: 2 }, 0.3, &[(0, 0.1)]),
        change(Target::Mass, 1200.0, &[(0, 100.0)]),
        change(Target::Inertia(1, 2), about_reference[(1, 2)], &[(1, 3.0)]),
        change(Target::Gravity(2), 0.0, &[(1, 0.7)]),
        change(Target::Wrench, 1.0, &[(0, 1.0)]),
    ];
    let plan = Plan::new(&base, &changes).expect("changes that have their places");
    assert_eq!(plan.columns(), 2);
    let mut instance = Instance::new(&base).expect("a scene");
    for _ in 0..20 {
        let [a, b] = [random.between(0.1, 1.0), random.between(0.1, 1.0)];
        // A refused sample must not affect the next one.
        let refused = plan.apply(&base, &[a, -1e9], &mut instance);
        assert!(matches!(refused, Err(SampleError::Scene(_) | SampleError::Link(2, _))), "{refused:?}");
        plan.apply(&base, &[a, b], &mut instance).expect("a sound sample");
        let mut inertia = about_reference;
        inertia[(1, 2)] += b * 3.0;
        inertia[(2, 1)] = inertia[(1, 2)];
        let body =
            Body::about_reference(1200.0 + a * 100.0, base.body.center_of_mass, inertia).expect("a body");
        let known = machine.links[2];
        let positive = 1e7 + a * 1e7 + b * 2e7;
        let law = Law::sided(positive, positive * (2e7 / 6e7), 2e-6 + b * 1e-6).expect("a law");
        let law = law.scaled(1.0 + a * 0.5).expect("a law");
        let mut point = known.point();
        point.x = -0.4 + b * 0.1;
        let mut links = machine.links.clone();
        links[2] = Link::with_law(point, known.direction(), law, known.damping()).expect("a link");
        assert_eq!(instance.body(), &body);
        assert_eq!(instance.links(), links);
        assert_eq!(instance.gravity(), GRAVITY + Vector3::new(0.0, 0.0, b * 0.7));
        assert_eq!(instance.centers()[1].z, 0.3 + a * 0.1);
        assert_eq!(instance.centers()[0], groups[0].center);
        assert_eq!(instance.factors(), [1.0, 1.0 + a]);
        System::new(&instance.scene().expect("a scene")).expect("a system");
    }
}

#[test]
fn invalid_batches_are_refused_by_name() {
    let (machine, groups) = cart_on(Law::linear(6e7).expect("a law"));
    let trace = Trace::new(&mut Random::new(3), 5);
    let new = |changes: &[Change], measures: &[Measure], exponent: f64, rtol: f64| {
        Batch::new(base(&machine, &groups), trace.motion(exponent), changes, measures, None, rtol)
            .map(|_| ())
            .expect_err("refused")
    };
    let mass = change(Target::Mass, 1.0, &[]);
    for target in [Target::Damping(16), Target::CenterOfMass(3), Target::Center { group: 4, axis: 0 }] {
        assert_eq!(new(&[change(target, 1.0, &[])], &[], 3.0, 1e-6), ChangeError::Target { target }.into());
    }
    assert_eq!(
        new(&[mass.clone(), mass.clone()], &[], 3.0, 1e-6),
        BatchError::from(ChangeError::Repeated { target: Target::Mass })
    );
    let [ab, ba] = [(0, 1), (1, 0)].map(|(i, j)| change(Target::Inertia(i, j), 0.0, &[]));
    assert!(matches!(new(&[ab, ba], &[], 3.0, 1e-6), BatchError::Change(ChangeError::Repeated { .. })));
    let infinite = change(Target::Mass, 0.0, &[(0, f64::INFINITY)]);
    assert_eq!(new(&[infinite], &[], 3.0, 1e-6), ChangeError::NotFinite { target: Target::Mass }.into());
    let measure = Measure::MeanLoad(4);
    assert_eq!(new(&[], &[measure], 3.0, 1e-6), BatchError::Measure { measure });
    for got in [0.5, 101.0, 1e6, f64::INFINITY] {
        assert_eq!(new(&[], &[], got, 1e-6), BatchError::Exponent { got });
    }
    assert!(matches!(new(&[], &[], f64::NAN, 1e-6), BatchError::Exponent { .. }));
    assert!(matches!(new(&[], &[], 3.0, 2.0), BatchError::Run(_)));
    let batch = Batch::new(
        base(&machine, &groups),
        trace.motion(3.0),
        &yardstick(16),
        &[Measure::ContactLost(0)],
        None,
        1e-6,
    )
    .expect("a batch");
    let mut out = [0.0; 2];
    assert_eq!(batch.run(2, &[0.0; 26], 1, &mut out), Err(BatchError::Columns { expected: 14, got: 13 }));
    let length = BatchError::Length { field: "out", expected: 1, got: 2 };
    assert_eq!(batch.run(1, &[1.0; 14], 1, &mut out), Err(length));
}
