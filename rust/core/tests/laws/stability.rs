//! Steps that are too long, tolerances that are too tight, and methods that are stable at any step.

use guideload::{Control, Exact, Excitation, OtherMethod, Output, Radau, Rk45, RunError};
use nalgebra::DVector;

use crate::common::{
    ADAPTIVE, Machine, adaptive, cart, cart_stiff, difference, free_block, largest, one_dof,
};

/// Step of the fastest real eigenvalue of an overdamped degree of freedom, as a multiple of 1 / |λ|.
fn rk45_at(z: f64, steps: u32) -> (Vec<[f64; 12]>, Result<guideload::Summary, RunError>) {
    let (w, ratio) = (100.0, 2.0);
    let fastest = w * (ratio + f64::sqrt(ratio * ratio - 1.0));
    let h = z / fastest;
    let time = [0.0, f64::from(steps) * h];
    let samples = [[0.0, 1.0, 0.0]; 2];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    one_dof(w, ratio).run(&Rk45, Control::Fixed { step: h }, &excitation, Output::Samples)
}

/// Where 1 + z + ... + z^5/120 + z^6/600 leaves the unit circle on the negative real axis.
const DP5_REAL_LIMIT: f64 = 3.3065;

#[test]
fn rk45_is_stable_up_to_its_limit_and_no_further() {
    let growth = |z: f64| {
        1.0 - z + z * z / 2.0 - z.powi(3) / 6.0 + z.powi(4) / 24.0 - z.powi(5) / 120.0 + z.powi(6) / 600.0
    };
    assert!((growth(DP5_REAL_LIMIT) - 1.0).abs() < 1e-3); // The limit as printed, five digits.

    let (inside, outcome) = rk45_at(0.98 * DP5_REAL_LIMIT, 20_000);
    outcome.expect("bounded");
    assert!(largest(&inside[1]) < 1.0, "{:?}", inside[1]);
    let (outside, outcome) = rk45_at(1.02 * DP5_REAL_LIMIT, 20_000);
    match outcome {
        Err(RunError::Diverged { time, step, .. }) => {
            assert!(time > 0.0 && step > 0.0);
        }
        other => panic!("expected Diverged, got {other:?}"),
    }
    // The states recorded before are finite.
    assert!(outside.iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn rk45_beyond_its_limit_on_the_stiff_cart_is_an_error() {
    let samples = vec![[2.2, 0.0, 0.0]; 2000];
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let (states, outcome) =
        cart_stiff().run(&Rk45, Control::Fixed { step: 1e-3 }, &excitation, Output::Samples);
    let error = outcome.expect_err("|h λ| is 36");
    assert!(matches!(error, RunError::Diverged { step: 1e-3, .. }), "{error:?}");
    assert!(error.to_string().contains("stability"), "{error}");
    assert!(states.len() < 2000 && states.iter().flatten().all(|x| x.is_finite()));
}

/// The quasi-static position: `K q = Q - M a` in the free degrees of freedom, from the matrices.
fn quasi_static(machine: &Machine, acceleration: [f64; 3]) -> Vec<f64> {
    let system = machine.system();
    let dofs: Vec<usize> = machine.free.iter().map(|dof| dof as usize).collect();
    let n = dofs.len();
    let matrices = system.matrices();
    let k = free_block(&matrices.stiffness, machine.free);
    let force = DVector::from_fn(n, |i, _| {
        let inertia: f64 = (0..3).map(|axis| matrices.mass[(dofs[i], axis)] * acceleration[axis]).sum();
        matrices.weight[dofs[i]] - inertia
    });
    let q = k.lu().solve(&force).expect("supported");
    machine
        .links
        .iter()
        .map(|link| {
            link.stiffness() * dofs.iter().zip(q.iter()).map(|(&dof, q)| link.row()[dof] * q).sum::<f64>()
        })
        .collect()
}

#[test]
fn radau_is_stable_at_any_step() {
    let a = [2.2, 0.3, -0.4];
    for machine in [cart(), cart_stiff()] {
        let want = quasi_static(&machine, a);
        for step in [0.1, 10.0, 1e3, 1e6] {
            let time = [0.0, 40.0 * step];
            let samples = [a, a];
            let excitation = Excitation::new(&time, &samples, None).expect("sound");
            let (states, _) = machine.states(&Radau, Control::Fixed { step }, &excitation);
            let got = machine.loads_of(&states[1..]);
            // |R(z)| is at most about 5 / |z| for large |z|, so after forty steps only rounding is left, of `h A` with a condition up to 1e2.
            assert!(
                difference(&got, &want) <= 1e-11 * largest(&want),
                "{step}: {:e}",
                difference(&got, &want)
            );
        }
        // L-stable: after one very long step there is no vibration left.
        let (time, samples) = ([0.0, 1e6], [a, a]);
        let excitation = Excitation::new(&time, &samples, None).expect("sound");
        let (states, _) = machine.states(&Radau, Control::Fixed { step: 1e6 }, &excitation);
        assert!(difference(&machine.loads_of(&states[1..]), &want) <= 1e-4 * largest(&want));
    }
}

#[test]
fn radau_without_damping_never_gains_energy() {
    // On the imaginary axis |R| < 1: the energy of a free body falls, step by step, however long they are.
    let machine = cart().with_damping(0.0);
    for step in [1e-3, 1e-2, 1e-1, 10.0] {
        let samples = [vec![[2.2, 0.0, 0.0]; 3], vec![[0.0; 3]; 60]].concat();
        let excitation = Excitation::uniform(0.0, step, &samples).expect("sound");
        let (states, _) = machine.states(&Radau, Control::Fixed { step }, &excitation);
        let energy: Vec<f64> = states[3..].iter().map(|s| s.iter().map(|x| x * x).sum()).collect();
        assert!(
            energy.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-14) + 1e-24),
            "{step}: {energy:?}"
        );
    }
}

#[test]
fn invalid_controls_are_refused() {
    let samples = [[0.0; 3]; 3];
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let outcome = |control| cart().run(&Rk45, control, &excitation, Output::Samples).1;
    for rtol in [1e-14, 0.2, 0.0, -1e-6] {
        assert_eq!(outcome(adaptive(rtol)), Err(RunError::Tolerance { got: rtol }));
        let exact = cart().run(&Exact, adaptive(rtol), &excitation, Output::Samples).1;
        assert_eq!(exact, Err(RunError::Tolerance { got: rtol }));
    }
    assert!(matches!(outcome(adaptive(f64::NAN)), Err(RunError::Tolerance { .. })));
    for step in [0.0, -1e-3, f64::INFINITY] {
        assert_eq!(outcome(Control::Fixed { step }), Err(RunError::Step { got: step }));
    }
    for rtol in [1e-13, 0.1] {
        assert!(outcome(adaptive(rtol)).is_ok());
    }
    for (times, index) in [(vec![0.0, -1e-9], 1), (vec![3e-3], 0), (vec![1e-3, 5e-4], 1), (vec![f64::NAN], 0)]
    {
        let outcome = cart().run(&Rk45, ADAPTIVE, &excitation, Output::Times(&times)).1;
        assert!(
            matches!(outcome, Err(RunError::OutputTime { index: got, .. }) if got == index),
            "{outcome:?}"
        );
    }
}

/// Undamped vibration over a million radians at 1e-13: the rounding of each step exceeds its allowed error.
#[test]
fn a_tolerance_below_rounding_is_reported_with_its_numbers() {
    let time = [0.0, 0.01, 0.01, 100.0];
    let samples = [[0.0; 3], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0; 3]];
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let mut machine = one_dof(1e4, 0.0);
    machine.gravity.y = 0.0;
    let (_, outcome) = machine.run(&Rk45, adaptive(1e-13), &excitation, Output::Samples);
    match outcome {
        Err(RunError::StepTooSmall { time, step, error, other }) => {
            assert!((0.0..100.0).contains(&time) && step > 0.0 && error > 1.0, "{time} {step} {error}");
            assert_eq!(other, OtherMethod::Exact);
        }
        other => panic!("expected StepTooSmall, got {other:?}"),
    }
}

#[test]
fn a_few_diverging_steps_are_an_error() {
    // Far from overflow: without the test of divergence the loads would be 1e17 N after these five steps.
    let (states, outcome) = rk45_at(3.0 * DP5_REAL_LIMIT, 5);
    assert!(matches!(outcome, Err(RunError::Diverged { .. })), "{outcome:?}");
    assert_eq!(states.len(), 1);
}

#[test]
fn fixed_steps_that_are_too_many_are_refused_at_once() {
    let samples = [[2.2, 0.0, 0.0]; 3];
    let excitation = Excitation::uniform(1.0, 1e-3, &samples).expect("sound");
    for step in [1e-12, 1e-17, 1e-30, f64::MIN_POSITIVE] {
        let (_, outcome) = cart().run(&Rk45, Control::Fixed { step }, &excitation, Output::Samples);
        assert!(
            matches!(outcome, Err(RunError::ShortSteps { step: refused, .. }) if refused == step),
            "{outcome:?}"
        );
    }
}
