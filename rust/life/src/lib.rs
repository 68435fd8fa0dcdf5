//! The equivalent load of a carriage by the rule of a maker, and the integral of its power over the travel, for f32 and f64: the simulation
//! and the load monitor of a controller count life by the same code.
//!
//! - `real`: f32 and f64.
//! - `rows`: two preloaded rows, for one number or several side by side.
//! - `rule`: what a [`Rule`] makes of a load.
//! - `sum`: addition of two numbers with its rounding error.
//! - `travel`: `∫ P^p |v| dt` over an interval on which loads are linear and the speed is quadratic, cut into pieces on which P is smooth.
//!
//! No function calls itself, allocates or panics, and the number of operations is bounded.
#![no_std]
#![deny(unsafe_code)]

#[cfg(feature = "std")]
extern crate std;

mod real;
mod rows;
mod rule;
mod sum;
mod travel;

pub use real::Real;
pub use rows::{Number, Rows};
pub use rule::{COMPONENTS, Exponent, Rule, Weighed};
pub use sum::two_sum;
pub use travel::{Integrals, Interval, Piece, Power, Travel};
