//! Scenes and motions from bytes: most are machines that could exist, with some numbers replaced by extreme or arbitrary ones.

use guideload::{Body, Dof, Free, Law, Link, SceneError};
use nalgebra::{Matrix3, Vector3};

/// Numbers that break careless code.
const SPECIAL: [f64; 16] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    1e200,
    -1e200,
    1e-200,
    1e154,
    1e100,
    1.0,
    -1.0,
];

/// Bytes, taken from the front; zeros after their end.
pub struct Source<'a>(pub &'a [u8]);

impl Source<'_> {
    /// The next byte.
    pub fn byte(&mut self) -> u8 {
        match self.0.split_first() {
            Some((&first, rest)) => {
                self.0 = rest;
                first
            }
            None => 0,
        }
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        self.byte() as usize % count
    }

    /// True for `of` of 256 bytes.
    pub fn chance(&mut self, of: u8) -> bool {
        self.byte() > 255 - of
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / 65535.0
    }

    /// From -1 to 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.share() - 1.0
    }

    /// Usually within two decades of `typical`; sometimes far from it, special, or any bits.
    pub fn number(&mut self, typical: f64) -> f64 {
        match self.byte() {
            0..=239 => typical * 10f64.powf(2.0 * self.signed()),
            240..=247 => {
                typical * 10f64.powf(12.0 * self.signed()) * if self.chance(128) { -1.0 } else { 1.0 }
            }
            248..=252 => SPECIAL[self.below(SPECIAL.len())],
            _ => f64::from_le_bytes(core::array::from_fn(|_| self.byte())),
        }
    }

    /// About the origin, some tenths long.
    pub fn point(&mut self) -> Vector3<f64> {
        let mut point = Vector3::from_fn(|_, _| self.signed());
        if self.chance(4) {
            point[self.below(3)] = self.number(1.0);
        }
        point
    }

    /// A law with its features about `load`.
    pub fn law(&mut self, load: f64) -> Result<Law, SceneError> {
        let stiffness = self.number(1e7);
        match self.below(4) {
            0 => Law::linear(stiffness),
            1 => Law::sided(stiffness, self.number(stiffness), self.number(load / stiffness)),
            2 => Law::preloaded(stiffness, self.number(load), [1.5, 10.0 / 9.0, 1.0, 2.0][self.below(4)]),
            _ => {
                let (mut d, mut f) = (-load / stiffness, -load);
                let points: Vec<[f64; 2]> = (0..2 + self.below(15))
                    .map(|_| {
                        let step = self.number(0.2 * load / stiffness);
                        (d, f) = (d + step, f + step * stiffness * self.share());
                        [d, f]
                    })
                    .collect();
                Law::curve(&points)
            }
        }
    }

    /// Links that may support a body.
    pub fn links(&mut self) -> Result<Vec<Link>, SceneError> {
        let one = self.chance(128).then(|| self.law(1e3));
        (0..4 + 2 * self.below(7))
            .map(|i| {
                let mut direction = Vector3::zeros();
                direction[1 + i % 2] = 1.0;
                if self.chance(16) {
                    direction = self.point();
                }
                let law = one.map_or_else(|| self.law(1e3), |law| law)?;
                let link = Link::with_law(self.point(), direction, law, self.number(1e4))?;
                if law.clearance() > 0.0 && self.chance(64) { link.damped_in_contact() } else { Ok(link) }
            })
            .collect()
    }

    /// Mass, centre of mass and inertia.
    pub fn body(&mut self) -> (f64, Vector3<f64>, Matrix3<f64>) {
        let (mass, center, size) = (self.number(1e3), self.point(), self.number(1.0));
        let mut inertia = Matrix3::from_diagonal_element(0.1 * mass * size * size);
        if self.chance(8) {
            inertia[(self.below(3), self.below(3))] = self.number(100.0);
        }
        (mass, center, inertia)
    }

    /// The body itself.
    ///
    /// # Errors
    /// As [`Body::new`].
    pub fn sound_body(&mut self) -> Result<Body, SceneError> {
        let (mass, center, inertia) = self.body();
        Body::new(mass, center, inertia)
    }

    /// Free degrees of freedom.
    pub fn free(&mut self) -> Free {
        match self.below(4) {
            0 | 1 => Free::GUIDED,
            2 => Free::PAPER,
            _ => Free::only(&Dof::ALL[..self.below(7)]),
        }
    }

    /// Stamps, accelerations and perhaps external loads of 2 to 9 samples.
    pub fn motion(&mut self) -> Samples {
        let (count, step, size) = (2 + self.below(8), self.number(1e-3), self.number(1.0));
        let mut now = 0.0;
        let mut time = Vec::new();
        for _ in 0..count {
            time.push(now);
            now += if self.chance(16) { self.number(step) } else { step };
        }
        let acceleration = (0..count).map(|_| self.point() * size).map(Into::into).collect();
        let load = self.number(100.0);
        let wrench = self
            .chance(64)
            .then(|| (0..count).map(|_| core::array::from_fn(|_| load * self.signed())).collect());
        Samples { time, acceleration, wrench }
    }
}

/// What an excitation borrows.
pub struct Samples {
    /// s
    pub time: Vec<f64>,
    /// m/s²
    pub acceleration: Vec<[f64; 3]>,
    /// N, N m
    pub wrench: Option<Vec<[f64; 6]>>,
}
