//! Natural frequencies, shapes, damping ratios, eigenvalues.

use guideload::{Free, Link, Mode, Scene, System, eigenvalues, modes};
use nalgebra::{Complex, ComplexField, Vector6};

use crate::common::{Machine, Random, cart, cart_stiff, close, free_block, one_dof, paper, random_machine};

fn machines(random: &mut Random) -> Vec<Machine> {
    let mut machines: Vec<_> = (0..20).map(|_| random_machine(random)).collect();
    machines.extend([cart(), paper(), cart_stiff()]);
    machines
}

fn free_rows(vector: &Vector6<f64>, free: Free) -> nalgebra::DVector<f64> {
    nalgebra::DVector::from_iterator(free.count(), free.iter().map(|dof| vector[dof as usize]))
}

#[test]
fn shapes_solve_the_eigenproblem_and_are_orthogonal() {
    let mut random = Random::new(61);
    for machine in machines(&mut random) {
        let system = machine.system();
        let k = free_block(&system.matrices().stiffness, machine.free);
        let m = free_block(&system.matrices().mass, machine.free);
        let modes: Vec<Mode> = modes(&system).collect();
        assert_eq!(modes.len(), machine.free.count());
        assert!(modes.windows(2).all(|pair| pair[0].frequency <= pair[1].frequency));
        for (i, mode) in modes.iter().enumerate() {
            let shape = free_rows(&mode.shape, machine.free);
            let lambda = mode.frequency * mode.frequency;
            // A backward error of tens of roundings of the two matrices.
            let missing = &k * &shape - &m * &shape * lambda;
            let size = (k.norm() + lambda * m.norm()) * shape.norm();
            assert!(missing.norm() <= 1e-14 * size, "{:e}", missing.norm() / size);
            for (j, other) in modes.iter().enumerate() {
                let other_shape = free_rows(&other.shape, machine.free);
                let same = f64::from(i == j);
                let size = m.norm() * shape.norm() * other_shape.norm();
                close(shape.dot(&(&m * &other_shape)), same, 1e-14, size);
                let size = k.norm() * shape.norm() * other_shape.norm();
                close(shape.dot(&(&k * &other_shape)), same * lambda, 1e-14, size);
            }
        }
    }
}

#[test]
fn one_dof_has_the_frequency_and_damping_of_the_textbook() {
    for ratio in [0.0, 0.02, 1.0, 4.0] {
        let system = one_dof(250.0, ratio).system();
        let mode = modes(&system).next().expect("one");
        close(mode.frequency, 250.0, 1e-15, 250.0); // A root and a quotient.
        close(mode.damping_ratio, ratio, 4e-16, ratio);
        let values = eigenvalues(&system).expect("they settle");
        let root = Complex::new(ratio * ratio - 1.0, 0.0).sqrt();
        let want = [(root - ratio) * 250.0, (-root - ratio) * 250.0];
        for value in &values[..2] {
            let off = want.iter().map(|want| (want - value).modulus()).fold(f64::INFINITY, f64::min);
            // The error of a double eigenvalue is the square root of a rounding error.
            let tolerance = if ratio == 1.0 { 1e-7 } else { 1e-13 };
            assert!(off <= tolerance * 250.0 * ratio.max(1.0), "{ratio}: {value} {want:?}");
        }
    }
}

/// `b = β k` for every link: ζ = β ω / 2 for every mode, and no coupling between them.
#[test]
fn proportional_damping_gives_each_mode_its_ratio() {
    let mut random = Random::new(62);
    for machine in machines(&mut random) {
        let beta = 1e-4;
        let machine = machine.with_proportional_damping(beta);
        let system = machine.system();
        let highest = system.frequencies().iter().copied().fold(0.0, f64::max);
        for (i, mode) in modes(&system).enumerate() {
            // Rounding of b φᵀ d dᵀ φ; the highest mode determines its size.
            close(
                mode.damping_ratio,
                beta * mode.frequency / 2.0,
                1e-13,
                beta * highest * highest / mode.frequency,
            );
            for j in 0..i {
                close(system.modal_damping()[(i, j)], 0.0, 1e-13, beta * highest * highest);
            }
        }
        let values = eigenvalues(&system).expect("they settle");
        for mode in modes(&system) {
            let (w, z) = (mode.frequency, mode.damping_ratio);
            let root = Complex::new(z * z - 1.0, 0.0).sqrt();
            for want in [(root - z) * w, (-root - z) * w] {
                let off = values.iter().map(|value| (value - want).modulus()).fold(f64::INFINITY, f64::min);
                assert!(off <= 1e-11 * highest, "{want} is missing by {off}"); // QR on 12 x 12.
            }
        }
    }
}

/// Each eigenvalue makes `λ² M + λ C + K` singular, and their sum is the trace.
#[test]
fn eigenvalues_solve_the_damped_problem() {
    let mut random = Random::new(63);
    for machine in machines(&mut random) {
        let system = machine.system();
        let n = machine.free.count();
        let [m, c, k] = [&system.matrices().mass, &system.matrices().damping, &system.matrices().stiffness]
            .map(|matrix| free_block(matrix, machine.free));
        let values = eigenvalues(&system).expect("they settle");
        let values = &values[..2 * n];
        let fastest = values.iter().map(|value| value.modulus()).fold(0.0, f64::max);
        for value in values {
            assert!(value.re <= 1e-12 * fastest); // Passive: nothing grows.
            let pencil = m.map(|x| value * value * x) + c.map(|x| value * x) + k.map(Complex::from);
            let size = pencil.norm();
            let smallest = pencil.singular_values().min();
            // The error of QR is some roundings of the fastest eigenvalue, in λ and in its factors.
            let slip = 1e-13 * fastest * (2.0 * value.modulus() * m.norm() + c.norm());
            assert!(smallest <= 1e-13 * size + slip, "{value}: {smallest:e} of {size:e}");
            let twin =
                values.iter().map(|other| (other - value.conj()).modulus()).fold(f64::INFINITY, f64::min);
            assert!(twin <= 1e-12 * fastest); // Real, or with its conjugate.
        }
        let trace: f64 = values.iter().map(|value| value.re).sum();
        close(trace, -system.modal_damping().trace(), 1e-12, fastest);
    }
}

#[test]
fn the_yardstick_scenes_have_the_published_eigenvalues() {
    let stiff = eigenvalues(&cart_stiff().system()).expect("they settle");
    let stiff = &stiff[..10];
    assert!(stiff.iter().all(|value| value.im == 0.0), "overdamped: real eigenvalues {stiff:?}");
    close(stiff[9].re, -3.6e4, 0.02, 3.6e4); // The yardstick prints two digits.
    let clean = eigenvalues(&cart().system()).expect("they settle");
    assert!(clean[..10].iter().all(|value| value.im != 0.0 && value.re < 0.0));
}

#[test]
fn eigenvalues_come_slowest_first() {
    let mut random = Random::new(64);
    for machine in machines(&mut random) {
        let values = eigenvalues(&machine.system()).expect("they settle");
        let n = 2 * machine.free.count();
        assert!(values[..n].windows(2).all(|pair| pair[0].modulus() <= pair[1].modulus() * (1.0 + 1e-12)));
        assert!(values[..n].iter().all(|value| value.modulus() > 0.0));
    }
}

/// Nearly a point mass on an arm: the mass matrix is singular to rounding, but no digits are lost.
#[test]
fn a_nearly_singular_mass_matrix_gives_finite_results() {
    let mut random = Random::new(65);
    let base = cart();
    for size in [1e-6, 1e-9, 1e-12, 1e-15] {
        for free in [Free::GUIDED, Free::ALL, Free::PAPER] {
            let inertia = nalgebra::Matrix3::identity() * size;
            let body = guideload::Body::new(1250.0, random.vector(9.0), inertia).expect("a body");
            let mut links = base.links.clone();
            links.push(Link::new(random.vector(0.5), nalgebra::Vector3::x(), 1e7, 0.0).expect("a drive"));
            let scene = Scene::new(body, &links, base.gravity, free).expect("a scene");
            let system = System::new(&scene).unwrap_or_else(|error| panic!("{size:e} {free:?}: {error}"));
            let sag = system.static_position();
            let mut numbers = system.frequencies().iter().chain(sag.as_slice());
            assert!(numbers.all(|x| x.is_finite()), "{size:e} {free:?}: {:?}", system.frequencies());
        }
    }
}
