//! The machine of the unit tests: the yardstick `cart` of `tests/laws`.

use nalgebra::{Matrix3, Vector3};

use crate::{Body, Free, Link, Scene, System, carriage_links};

/// The 16 links of the cart, whose carriages have this damping along y and along z, N s/m.
pub(crate) fn cart_links(damping: f64) -> Vec<Link> {
    [(-0.5, -0.35), (-0.5, 0.35), (0.5, -0.35), (0.5, 0.35)]
        .iter()
        .flat_map(|&(x, z)| {
            carriage_links(Vector3::new(x, 0.05, z), 0.12, [1.2e8; 2], [damping; 2]).expect("a carriage")
        })
        .collect()
}

/// The cart on these links.
pub(crate) fn cart_on(links: &[Link]) -> System {
    let inertia = Matrix3::new(420.0, 15.0, -8.0, 15.0, 310.0, 22.0, -8.0, 22.0, 380.0);
    let body = Body::new(1250.0, Vector3::new(0.12, -0.65, 0.18), inertia).expect("a body");
    let down = Vector3::new(0.0, -9.80665, 0.0);
    System::new(&Scene::new(body, links, down, Free::GUIDED).expect("a scene")).expect("a supported body")
}

/// Numbers from -1 to 1 that differ.
pub(crate) fn number(at: usize) -> f64 {
    (1.0 + 7.3 * at as f64).sin()
}
