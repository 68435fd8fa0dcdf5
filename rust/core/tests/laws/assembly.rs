//! Assembly, paper eqs. 2-33, and its two sign errors.

use guideload::tensor::{parallel_axes, projector, skew};
use guideload::{Body, Dof, Free, Link, Matrices, SceneError, assemble};
use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};

use crate::common::{GRAVITY, Machine, Random, body, close, random_machine};

#[test]
fn skew_is_the_cross_product_of_the_textbook() {
    let r = Vector3::new(1.0, 2.0, 3.0);
    assert_eq!(skew(&r), Matrix3::new(0.0, -3.0, 2.0, 3.0, 0.0, -1.0, -2.0, 1.0, 0.0));
    assert_eq!(skew(&r).transpose(), -skew(&r));
    let mut random = Random::new(1);
    for _ in 0..20 {
        let (r, w) = (random.vector(1.0), random.vector(1.0));
        // Both compute the same products and sums, to one rounding.
        assert!((skew(&r) * w - r.cross(&w)).amax() <= 1e-15);
    }
}

#[test]
fn a_cuboid_about_its_corner_has_the_textbook_inertia() {
    let (m, a, b, c) = (12.0, 0.2, 0.3, 0.4);
    let about_center =
        Matrix3::from_diagonal(&Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b)) * (m / 12.0);
    let about_corner = parallel_axes(&about_center, m, &(Vector3::new(a, b, c) / 2.0));
    let want = Matrix3::new(
        m * (b * b + c * c) / 3.0,
        -m * a * b / 4.0,
        -m * a * c / 4.0,
        -m * a * b / 4.0,
        m * (a * a + c * c) / 3.0,
        -m * b * c / 4.0,
        -m * a * c / 4.0,
        -m * b * c / 4.0,
        m * (a * a + b * b) / 3.0,
    );
    assert!((about_corner - want).amax() < 1e-15); // A few roundings of numbers below one.
}

/// A body of point masses, and the points.
fn cloud(random: &mut Random) -> (Body, Vec<(f64, Vector3<f64>)>) {
    let points: Vec<_> = (0..15).map(|_| (random.between(1.0, 50.0), random.vector(0.8))).collect();
    let mass: f64 = points.iter().map(|(m, _)| m).sum();
    let center = points.iter().map(|(m, r)| r * *m).sum::<Vector3<f64>>() / mass;
    let inertia =
        points.iter().map(|(m, r)| parallel_axes(&Matrix3::zeros(), *m, &(r - center))).sum::<Matrix3<f64>>();
    (Body::new(mass, center, inertia).expect("a body"), points)
}

#[test]
fn kinetic_energy_is_that_of_the_points_of_the_body() {
    let mut random = Random::new(2);
    for _ in 0..20 {
        let (body, points) = cloud(&mut random);
        let (u, phi) = (random.vector(2.0), random.vector(3.0));
        let of_points: f64 = points.iter().map(|(m, r)| 0.5 * m * (u + phi.cross(r)).norm_squared()).sum();
        let rate = Vector6::new(u.x, u.y, u.z, phi.x, phi.y, phi.z);
        let of_matrix = 0.5 * rate.dot(&(body.mass_matrix() * rate));
        close(of_matrix, of_points, 1e-14, of_points); // Fifteen points, one rounding each.
    }
}

#[test]
fn the_mass_matrix_is_symmetric_and_positive_definite() {
    let mut random = Random::new(3);
    for _ in 0..20 {
        let m = cloud(&mut random).0.mass_matrix();
        assert_eq!(m, m.transpose());
        assert!(SymmetricEigen::new(m).eigenvalues.min() > 0.0);
    }
}

#[test]
fn inertia_about_the_reference_point_describes_the_same_body() {
    let there = body();
    let about_l = parallel_axes(&there.inertia(), there.mass(), &there.center_of_mass());
    let here = Body::about_reference(there.mass(), there.center_of_mass(), about_l).expect("a body");
    // Moving forth and back rounds numbers of size 1e3.
    assert!((here.mass_matrix() - there.mass_matrix()).amax() < 1e-12);
}

/// Lower left, lower right and so on as the paper writes them.
fn paper_blocks(links: &[Link], coefficient: fn(&Link) -> f64) -> Matrix6<f64> {
    let mut sum = Matrix6::zeros();
    for link in links {
        let (p, omega) = (skew(&link.point()), projector(&link.direction()) * coefficient(link));
        let blocks = [(0, 0, omega), (0, 3, -omega * p), (3, 0, p * omega), (3, 3, -p * omega * p)];
        for (row, column, block) in blocks {
            let mut view = sum.fixed_view_mut::<3, 3>(row, column);
            view += block;
        }
    }
    sum
}

#[test]
fn stiffness_and_damping_have_the_blocks_of_the_paper() {
    let mut random = Random::new(4);
    for _ in 0..20 {
        let machine = random_machine(&mut random);
        let Matrices { stiffness, damping, .. } = assemble(&machine.scene());
        let (k, c) =
            (paper_blocks(&machine.links, Link::stiffness), paper_blocks(&machine.links, Link::damping));
        // Twelve links, products of three factors: tens of roundings.
        assert!((stiffness - k).amax() <= 1e-14 * k.amax());
        assert!((damping - c).amax() <= 1e-14 * c.amax());
        assert!((stiffness - stiffness.transpose()).amax() <= 1e-15 * k.amax());
    }
}

/// Correction 1: with the sign of eq. 13 as printed the body would rise.
#[test]
fn a_body_on_vertical_links_sags_by_its_weight_over_their_stiffness() {
    let k = [3e5, 5e5, 7e5];
    let links = k.map(|k| Link::new(Vector3::zeros(), Vector3::y(), k, 0.0).expect("a link")).to_vec();
    let machine = Machine { body: body(), links, gravity: GRAVITY, free: Free::only(&[Dof::Y]) };
    let sag = machine.system().static_position();
    let want = -1250.0 * 9.80665 / k.iter().sum::<f64>();
    close(sag[1], want, 1e-15, want.abs()); // Two divisions and a root.
    assert_eq!([sag[0], sag[2], sag[3], sag[4], sag[5]], [0.0; 5]);
}

/// Potential energy of the links and of the weight: eq. 13 with g_S up.
fn potential(machine: &Machine, q: &Vector6<f64>) -> f64 {
    let (u, phi) = (q.fixed_rows::<3>(0).into_owned(), q.fixed_rows::<3>(3).into_owned());
    let elastic: f64 = machine
        .links
        .iter()
        .map(|link| {
            let delta = (u + phi.cross(&link.point())).dot(&link.direction());
            0.5 * link.stiffness() * delta * delta
        })
        .sum();
    let center = u + phi.cross(&machine.body.center_of_mass());
    elastic - machine.body.mass() * machine.gravity.dot(&center)
}

/// Correction 2: the last line of eq. 24 prints the damping term; the derivative of the energy has the stiffness.
#[test]
fn forces_and_moments_are_the_derivative_of_the_potential_energy() {
    let mut random = Random::new(5);
    for _ in 0..20 {
        let machine = random_machine(&mut random);
        let Matrices { stiffness, weight, .. } = assemble(&machine.scene());
        let q = Vector6::from_fn(|_, _| random.between(-1.0, 1.0));
        let want = stiffness * q - weight;
        let other = assemble(&machine.clone().with_damping(7.0).scene());
        // The energy has no damping; normalising the directions again changes last digits.
        assert!((stiffness - other.stiffness).amax() <= 1e-15 * stiffness.amax() && weight == other.weight);
        for i in 0..6 {
            // The energy is quadratic, so the central difference is exact at any step; roundings of U / step remain.
            let mut step = Vector6::zeros();
            step[i] = 1.0;
            let got = (potential(&machine, &(q + step)) - potential(&machine, &(q - step))) / 2.0;
            close(got, want[i], 1e-14, stiffness.amax());
        }
    }
}

#[test]
fn invalid_inertias_are_refused_with_their_numbers() {
    let body = |mass, inertia| Body::new(mass, Vector3::zeros(), inertia).expect_err("no body");
    let one = Matrix3::identity();
    assert_eq!(body(-1.0, one), SceneError::Mass { got: -1.0 });
    assert!(matches!(body(f64::NAN, one), SceneError::Mass { .. }));
    assert_eq!(
        body(1.0, Matrix3::from_diagonal(&Vector3::new(5.0, 1.0, 2.0))),
        SceneError::InertiaTriangle { principal: [1.0, 2.0, 5.0] }
    );
    assert!(matches!(body(1.0, -one), SceneError::InertiaNotPositive { .. }));
    let tilted = Matrix3::new(1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    assert_eq!(body(1.0, tilted), SceneError::InertiaAsymmetric { by: 0.1 });

    let link = |direction, k, b| Link::new(Vector3::zeros(), direction, k, b).expect_err("no link");
    assert_eq!(link(Vector3::zeros(), 1.0, 1.0), SceneError::Direction { got: [0.0; 3] });
    assert_eq!(link(Vector3::x(), -4e5, 1.0), SceneError::Stiffness { got: -4e5 });
    assert_eq!(link(Vector3::x(), 1.0, -2.0), SceneError::Damping { got: -2.0 });
    assert_eq!(link(Vector3::x(), 0.0, 0.0), SceneError::IdleLink);
}
