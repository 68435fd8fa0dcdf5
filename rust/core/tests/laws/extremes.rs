//! Scenes and traces at the limits of double precision.

use guideload::{
    Body, Control, Dof, Exact, Excitation, ExcitationError, Free, Link, Output, Radau, Rider, Rk45, RunError,
    Scene, SceneError, System,
};
use nalgebra::{Matrix3, Vector3};

use crate::common::{ADAPTIVE, GRAVITY, Machine, adaptive, cart, difference, largest, one_dof};

/// Springs along y and z, and one damper along y + z: the motion y - z is undamped, though both directions have damping.
#[test]
fn methods_agree_where_modes_are_damped_only_together() {
    let mass = 100.0;
    let body = Body::new(mass, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let link = |direction, k, b| Link::new(Vector3::zeros(), direction, k, b).expect("a link");
    let diagonal = Vector3::new(0.0, 1.0, 1.0);
    let samples: Vec<[f64; 3]> = (0..21).map(|k| [0.0, if k == 1 { 2.0 } else { 0.0 }, 0.0]).collect();
    let excitation = Excitation::uniform(0.0, 0.25, &samples).expect("sound");
    for b in [2e3, 1e5] {
        let stiffness = mass * 500.0 * 500.0;
        let links = vec![
            link(Vector3::y(), stiffness, 0.0),
            link(Vector3::z(), stiffness, 0.0),
            link(diagonal, 0.0, b),
        ];
        let free = Free::only(&[Dof::Y, Dof::Z]);
        let machine = Machine { body, links, gravity: GRAVITY, free };
        let exact = machine.exact_loads(&excitation);
        for rtol in [1e-4, 1e-6, 1e-8] {
            let control = adaptive(rtol);
            let (states, summary) = machine.states(&Rk45, control, &excitation);
            let bound = 10.0 * rtol * summary.load_scale; // What is asked of any two methods.
            assert!(difference(&machine.loads_of(&states), &exact) < bound, "rk45 {b} {rtol}");
            let (states, _) = machine.states(&Radau, control, &excitation);
            assert!(difference(&machine.loads_of(&states), &exact) < bound, "implicit {b} {rtol}");
        }
    }
}

/// With dominant damping, `m q'' + b q' + k q = -m a` decays at `λ = k/b (1 + ...)`; the result depends on the digits of `1 - exp(-λ h)`.
#[test]
fn strong_damping_keeps_its_digits() {
    let frequency: f64 = 1e3;
    for ratio in [1e2_f64, 1e4, 1e5, 1e6] {
        let machine = one_dof(frequency, ratio);
        let (sum, root) = (2.0 * ratio * frequency, f64::sqrt(ratio * ratio - 1.0) * frequency);
        let fast = sum / 2.0 + root;
        let slow = frequency * frequency / fast;
        let samples = vec![[0.0, -1.0, 0.0]; 1001];
        let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
        let loads = machine.exact_loads(&excitation);
        // Constant force m a = 100 N from rest: k δ + b δ' from the closed form.
        let (k, b) = (100.0 * frequency * frequency, 100.0 * sum);
        for (step, load) in loads.iter().enumerate() {
            let t = step as f64 * 1e-3;
            let (p, q) = (-(-slow * t).exp_m1(), -(-fast * t).exp_m1());
            let delta = (fast * p - slow * q) / (fast - slow) / (frequency * frequency);
            let rate = ((-slow * t).exp() - (-fast * t).exp()) / (fast - slow);
            let want = k * delta + b * rate - 100.0 * 9.80665;
            assert!((load - want).abs() < 1e-12 * 1e3, "ratio {ratio}, t {t}: {load} {want}"); // 1e3 N: the scale.
        }
    }
}

/// Seconds since 1970 give the same loads as seconds since the start.
#[test]
fn unix_time_is_as_good_as_any() {
    let samples = [[0.0; 3], [2.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
    let at = |start: f64| {
        let excitation = Excitation::uniform(start, 0.0078125, &samples).expect("sound"); // 2^-7 s: no rounding of times
        [Control::Fixed { step: 1e-6 }, adaptive(1e-12)]
            .map(|control| cart().states(&Rk45, control, &excitation).0)
    };
    assert_eq!(at(0.0), at(1_700_000_000.0));
}

#[test]
fn a_very_short_interval_ends() {
    let samples = [[0.0; 3], [2.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    for tiny in [5e-324, 1e-310, 1e-300, 1e-30] {
        let time = [0.0, tiny, 1.0];
        let excitation = Excitation::new(&time, &samples, None).expect("sound");
        let (exact, outcome) = cart().run(&Exact, ADAPTIVE, &excitation, Output::Samples);
        if let Err(error) = outcome {
            assert!(matches!(error, RunError::Diverged { .. }), "{error:?}");
            continue;
        }
        let (states, outcome) = cart().run(&Rk45, ADAPTIVE, &excitation, Output::Samples);
        outcome.expect("ends");
        let scale = largest(&exact[2]);
        assert!(exact[2].iter().zip(&states[2]).all(|(a, b)| (a - b).abs() < 1e-3 * scale));
    }
}

/// A rod has no moment of inertia about its axis, in any orientation.
#[test]
fn a_needle_is_refused_in_every_direction() {
    for axis in [
        [1.0, 2.0, 3.0],
        [1.0, 5.0, 2.0],
        [1.0, 1.0, 0.3],
        [0.3, 0.7, 0.1],
        [-2.0, 0.5, 0.9],
        [0.0, 0.0, 1.0],
    ] {
        let u = Vector3::from(axis).normalize();
        let rod = (Matrix3::identity() - u * u.transpose()) * 10.0;
        let refused = Body::new(5.0, Vector3::zeros(), rod);
        assert!(matches!(refused, Err(SceneError::InertiaNotPositive { .. })), "{axis:?}: {refused:?}");
    }
}

#[test]
fn steps_and_durations_beyond_the_range_of_numbers_are_errors() {
    let samples = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]];
    let excitation = Excitation::uniform(0.0, 1e306, &samples).expect("finite");
    let (_, outcome) = cart().run(&Exact, ADAPTIVE, &excitation, Output::Samples);
    assert_eq!(outcome, Err(RunError::OutOfRange));
    for endless in [
        Excitation::uniform(1e308, 1e308, &samples),
        Excitation::uniform(-1e308, 1e308, &samples),
        Excitation::new(&[-1e308, 0.0, 1e308], &samples, None),
    ] {
        assert!(matches!(endless, Err(ExcitationError::Duration { .. })), "{endless:?}");
    }
}

#[test]
fn a_direction_of_any_length_becomes_a_unit_vector() {
    for size in [5e-324, 1e-310, 1e-161, 5e-162, 1e-99, 1.0, 1e99, 1e160, 1e308] {
        let direction = Vector3::new(size, 0.5 * size, 0.0);
        let link = Link::new(Vector3::zeros(), direction, 1e8, 0.0).expect("a link");
        assert!((link.direction().norm() - 1.0).abs() < 1e-15, "{size:e}");
        let body = Body::new(5.0, Vector3::zeros(), Matrix3::identity()).expect("a body");
        assert_eq!(Rider::new(body, direction).expect("a rider").direction(), link.direction());
    }
    for direction in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 1.0, 0.0]] {
        let refused = Link::new(Vector3::zeros(), direction.into(), 1e8, 0.0);
        assert!(matches!(refused, Err(SceneError::Direction { .. })), "{refused:?}");
    }
}

#[test]
fn overflow_of_loads_is_an_error() {
    let heavy = Body::new(1e10, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let links = cart().links;
    let scene = Scene::new(heavy, &links, Vector3::new(0.0, -1e300, 0.0), Free::GUIDED).expect("a scene");
    assert!(matches!(System::new(&scene), Err(SceneError::OutOfRange { .. })));

    let samples = [[1e306, 0.0, 0.0]; 2];
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("finite");
    let (_, outcome) = cart().run(&Exact, ADAPTIVE, &excitation, Output::Samples);
    assert_eq!(outcome, Err(RunError::OutOfRange));
}
