//! Riders: bodies that move along the main body.

use guideload::{
    Body, BodyWithRiders, BodyWithRidersInstant, Control, Exact, Excitation, ExcitationError, Exponential,
    MAX_RIDERS, Method, Output, Part, Radau, Rider, RiderMotion, Rk45, RunError, State, System, Wrench,
    acceleration, group_load, load_scale, position, reaction, run, velocity,
};
use nalgebra::{Matrix3, Vector3, Vector6};

use crate::common::{
    GRAVITY, Machine, Random, adaptive, alike, cart, cart_clear, cart_stiff, close, difference, largest,
    preloaded_cart,
};

const STEP: f64 = 1e-3;
const TIGHT: Control = adaptive(1e-12);

fn slide() -> Rider {
    let inertia = Matrix3::new(9.0, 1.0, 0.5, 1.0, 12.0, -0.7, 0.5, -0.7, 15.0);
    let body = Body::new(180.0, Vector3::new(0.1, 0.3, -0.2), inertia).expect("a sound body");
    Rider::new(body, Vector3::new(0.2, -0.1, 2.0)).expect("a direction")
}

/// A machine that carries the slide at a travel, m.
fn carrying(machine: Machine, travel: f64) -> Machine {
    Machine { body: machine.body.plus(&slide().at(travel)), ..machine }
}

/// Travel, speed and acceleration of a move there and back under a constant jerk of changing sign.
fn there_and_back(samples: usize, jerk: f64) -> Vec<[f64; 3]> {
    let mut now = [0.0; 3];
    (0..samples)
        .map(|k| {
            let before = now;
            let [s, v, a] = now;
            let part = 8 * k / (samples - 1).max(1);
            let j = jerk * [1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 0.0][part.min(8)];
            now = [
                s + STEP * (v + STEP * (a / 2.0 + STEP * j / 6.0)),
                v + STEP * (a + STEP * j / 2.0),
                a + STEP * j,
            ];
            before
        })
        .collect()
}

fn drive(samples: usize) -> Vec<[f64; 3]> {
    (0..samples).map(|k| [2.0 * (0.011 * k as f64).sin(), 0.3 * (0.007 * k as f64).sin(), 0.0]).collect()
}

fn states<M: Method>(machine: &Machine, method: &M, control: Control, excitation: &Excitation) -> Vec<State> {
    machine.states(method, control, excitation).0
}

/// The state of a system with this position and velocity of L.
fn state_at(system: &System, q: &Vector6<f64>, speed: &Vector6<f64>) -> State {
    let momenta = system.shapes().transpose() * system.matrices().mass;
    let (eta, rate) = (momenta * (q - system.static_position()), momenta * speed);
    core::array::from_fn(|i| if i < 6 { system.frequencies()[i] * eta[i] } else { rate[i - 6] })
}

/// Riders at rest anywhere are a part of the body.
#[test]
fn a_rider_at_rest_gives_the_accelerations_and_reactions_of_the_merged_body() {
    let (apart, mut random) = (carrying(cart(), 0.0).system(), Random::new(1));
    let riders = [slide()];
    let ridden = BodyWithRiders::new(&apart, &riders);
    for _ in 0..20 {
        let travel = random.between(-1.0, 1.0);
        let merged = carrying(cart(), travel).system();
        let size = |v: Vector3<f64>, w: Vector3<f64>| Vector6::new(0.0, v.y, v.z, w.x, w.y, w.z);
        let q = size(random.vector(1e-4), random.vector(1e-4));
        let speed = size(random.vector(1e-2), random.vector(1e-2));
        let mut input = [0.0; 9];
        input.iter_mut().for_each(|x| *x = random.between(-3.0, 3.0));
        let got = ridden.at(&[[travel, 0.0, 0.0]], &state_at(&apart, &q, &speed), &input);
        let there = state_at(&merged, &q, &speed);
        // The state is turned into the modes of two systems: some roundings of link loads that nearly balance.
        alike(&got.acceleration, &acceleration(&merged).at(&there, &input), 1e-11);
        alike(&got.reaction, &reaction(&merged).at(&there, &input), 1e-11);
    }
}

/// What a run under moving cart and rider does, at equal short intervals.
struct Course {
    interval: f64,
    states: Vec<State>,
    travels: Vec<[f64; 3]>,
    instants: Vec<BodyWithRidersInstant>,
}

fn course(machine: &Machine, drive: &[[f64; 3]], samples: &[[f64; 3]], per_step: usize) -> Course {
    let riders = [RiderMotion { rider: slide(), samples }];
    let excitation =
        Excitation::uniform(0.0, STEP, drive).expect("samples").with_riders(&riders).expect("riders");
    let count = (samples.len() - 1) * per_step + 1;
    let interval = STEP / per_step as f64;
    let times: Vec<f64> = (0..count).map(|k| f64::min(interval * k as f64, excitation.duration())).collect();
    let system = machine.system();
    let mut states: Vec<State> = Vec::new();
    let control = Control::Fixed { step: interval };
    run(&system, &Rk45, control, &excitation, Output::Times(&times), &mut states).expect("a run");
    let (only, travels) = ([slide()], times.iter().map(|&t| excitation.travel_at(0, t)).collect::<Vec<_>>());
    let ridden = BodyWithRiders::new(&system, &only);
    let instants = times
        .iter()
        .zip(&states)
        .zip(&travels)
        .map(|((&t, state), &travel)| ridden.at(&[travel], state, &excitation.input_at(t)))
        .collect();
    Course { interval, states, travels, instants }
}

/// Integral of values at equal intervals by Simpson's rule.
fn simpson(values: &[f64], interval: f64) -> f64 {
    let inner: f64 = (1..values.len() - 1).map(|k| values[k] * if k % 2 == 1 { 4.0 } else { 2.0 }).sum();
    (values[0] + inner + values[values.len() - 1]) * interval / 3.0
}

/// The energy of body and rider changes by the work of the rider's drive less that of the dampers, the momentum by the forces.
#[test]
fn energy_and_momentum_are_balanced() {
    let machine = carrying(cart(), 0.0);
    let system = machine.system();
    let samples = there_and_back(601, 400.0);
    let course = course(&machine, &vec![[0.0; 3]; samples.len()], &samples, 50);
    let [q_of, speed_of]: [Wrench; 2] = [position(&system), velocity(&system)];
    let links = group_load(&system, 0..16, Vector3::zeros(), Part::Total);
    let stiffness = system.matrices().stiffness;
    let (rider, main) = (slide(), cart().body);
    let (mut energy, mut power, mut momentum, mut force) = (vec![], vec![], vec![], vec![]);
    for ((state, &[travel, speed, _]), instant) in
        course.states.iter().zip(&course.travels).zip(&course.instants)
    {
        let [q, rate] = [&q_of, &speed_of].map(|wrench| Vector6::from(wrench.at(state, &[0.0; 9])));
        let half = |v: &Vector6<f64>, first| Vector3::new(v[first], v[first + 1], v[first + 2]);
        let arm = rider.at(travel).center_of_mass();
        let along = rider.direction() + half(&q, 3).cross(&rider.direction());
        let v = half(&rate, 0) + half(&rate, 3).cross(&arm) + along * speed;
        let turning = half(&rate, 3);
        let kinetic = rate.dot(&(main.mass_matrix() * rate))
            + rider.body().mass() * v.norm_squared()
            + turning.dot(&(rider.body().inertia() * turning));
        let at = half(&q, 0) + half(&q, 3).cross(&arm) + rider.direction() * travel;
        let potential = q.dot(&(stiffness * q)) / 2.0
            - q.dot(&main.weight(&GRAVITY))
            - rider.body().mass() * GRAVITY.dot(&at);
        energy.push(kinetic / 2.0 + potential);
        power.push(instant.drive[0] * speed - rate.dot(&(system.matrices().damping * rate)));
        let of_main = main.mass_matrix() * rate;
        momentum.push(half(&of_main, 0) + v * rider.body().mass());
        let weight = GRAVITY * (main.mass() + rider.body().mass());
        force.push(
            half(&Vector6::from(instant.reaction), 0) - half(&Vector6::from(links.at(state, &[0.0; 9])), 0)
                + weight,
        );
    }
    let (first, last) = (0, energy.len() - 1);
    let turned = simpson(&power.iter().map(|p| p.abs()).collect::<Vec<_>>(), course.interval);
    close(energy[last] - energy[first], simpson(&power, course.interval), 1e-8, turned);
    for axis in 0..3 {
        let along: Vec<f64> = force.iter().map(|f| f[axis]).collect();
        let pushed = simpson(&along.iter().map(|f| f.abs()).collect::<Vec<_>>(), course.interval);
        close(momentum[last][axis] - momentum[first][axis], simpson(&along, course.interval), 1e-7, pushed);
    }
}

fn ridden_loads<M: Method>(machine: &Machine, method: &M, control: Control, jerk: f64) -> Vec<f64> {
    let (samples, drive) = (there_and_back(401, jerk), drive(401));
    let riders = [RiderMotion { rider: slide(), samples: &samples }];
    let excitation =
        Excitation::uniform(0.0, STEP, &drive).expect("samples").with_riders(&riders).expect("riders");
    machine.loads_of(&states(machine, method, control, &excitation))
}

/// Orders of the methods with a mass matrix that changes in time.
#[test]
fn the_methods_keep_their_orders_and_agree() {
    let machine = carrying(cart(), 0.0);
    let want = ridden_loads(&machine, &Radau, TIGHT, 3000.0);
    alike(&ridden_loads(&machine, &Rk45, TIGHT, 3000.0), &want, 1e-10);
    let error = |step| difference(&ridden_loads(&machine, &Rk45, Control::Fixed { step }, 3000.0), &want);
    let order = (error(2.5e-4) / error(1.25e-4)).log2();
    assert!((order - 5.0).abs() < 0.2, "rk45: {order}");
    // All intervals are 1 ms, so the implicit method shows its order on a scene that is twice as fast.
    let stiff = carrying(cart_stiff(), 0.0);
    let want = ridden_loads(&stiff, &Radau, TIGHT, 3000.0);
    alike(&ridden_loads(&stiff, &Radau, Control::Fixed { step: 1.25e-4 }, 3000.0), &want, 1e-9);
}

/// The error of the link loads stays below the tolerance, in newtons.
#[test]
fn the_error_stays_below_the_tolerance() {
    for machine in [carrying(cart(), 0.0), carrying(cart_stiff(), 0.0)] {
        let want = ridden_loads(&machine, &Radau, TIGHT, 3000.0);
        let scale = largest(&want);
        for rtol in [1e-3, 1e-5, 1e-7] {
            let control = adaptive(rtol);
            let implicit = difference(&ridden_loads(&machine, &Radau, control, 3000.0), &want) / scale;
            let explicit = difference(&ridden_loads(&machine, &Rk45, control, 3000.0), &want) / scale;
            assert!(implicit < 3.0 * rtol && explicit < 3.0 * rtol, "{rtol:e}: {implicit:e} {explicit:e}");
        }
    }
}

/// A slow rider at constant speed adds no force: its weight travels, and that is all.
#[test]
fn a_slow_rider_at_constant_speed_moves_its_weight_only() {
    let machine = carrying(cart(), 0.0);
    let (speed, count) = (0.02, 5001);
    let samples: Vec<[f64; 3]> = (0..count).map(|k| [speed * STEP * k as f64, speed, 0.0]).collect();
    let still = vec![[0.0; 3]; count];
    let riders = [RiderMotion { rider: slide(), samples: &samples }];
    let excitation =
        Excitation::uniform(0.0, STEP, &still).expect("samples").with_riders(&riders).expect("riders");
    let got = machine.loads_of(&states(&machine, &Rk45, TIGHT, &excitation));
    let there = carrying(cart(), samples[count - 1][0]);
    let want = there.loads_of(&[[0.0; 12]]);
    let moved = difference(&want, &machine.loads_of(&[[0.0; 12]]));
    assert!(moved > 50.0, "{moved}");
    // The force of the damping at this speed, and the ringing of the start.
    assert!(difference(&got[got.len() - want.len()..], &want) < 2e-3 * moved);
}

/// Clearance and preload under a moving rider: the two methods agree.
#[test]
fn riders_move_on_nonlinear_links() {
    for machine in [cart_clear(), preloaded_cart()] {
        let machine = carrying(machine, 0.0);
        let control = adaptive(1e-9);
        let want = ridden_loads(&machine, &Radau, control, 3000.0);
        alike(&ridden_loads(&machine, &Rk45, control, 3000.0), &want, 1e-7);
    }
}

#[test]
fn what_riders_cannot_do_is_refused() {
    let machine = carrying(cart(), 0.0);
    let (samples, drive) = (there_and_back(50, 100.0), drive(50));
    let motion = RiderMotion { rider: slide(), samples: &samples };
    let excitation = Excitation::uniform(0.0, STEP, &drive).expect("samples");
    let riders = [motion];
    let ridden = excitation.with_riders(&riders).expect("riders");
    let (_, outcome) = machine.run(&Exact, TIGHT, &ridden, Output::Samples);
    assert_eq!(outcome, Err(RunError::NotExactRiders));
    let (_, outcome) = machine.run(&Exponential, TIGHT, &ridden, Output::Samples);
    assert_eq!(outcome, Err(RunError::NotExponentialRiders));
    let many = [motion; MAX_RIDERS + 1];
    let error = excitation.with_riders(&many).expect_err("too many");
    assert_eq!(error, ExcitationError::TooManyRiders { max: MAX_RIDERS, got: MAX_RIDERS + 1 });
    let short = [RiderMotion { samples: &samples[1..], ..motion }];
    assert!(matches!(excitation.with_riders(&short), Err(ExcitationError::Length { got: 49, .. })));
    assert!(load_scale(&machine.system(), &ridden) > load_scale(&machine.system(), &excitation));
}
