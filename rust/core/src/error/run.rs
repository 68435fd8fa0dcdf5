//! Errors of runs.

use core::fmt;

use nalgebra::Vector6;

use super::scene::write_motion;

/// Another method that the scene allows and that does not share the difficulty of the one that failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherMethod {
    /// The exact method: no link is preloaded, and no rider moves.
    Exact,
    /// The implicit method: a link is preloaded or a rider moves, and another method failed.
    Implicit,
    /// None: a link is preloaded or a rider moves, and the implicit method failed.
    None,
}

impl OtherMethod {
    /// The end of a sentence with other ways out.
    const fn advice(self) -> &'static str {
        match self {
            Self::Exact => ", or use method \"exact\"",
            Self::Implicit => ", or use method \"implicit\"",
            Self::None => "",
        }
    }
}

/// Why a run is refused or stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RunError {
    /// Tolerance outside 1e-13 to 0.1. Smaller ones are below rounding, larger ones have no meaning.
    Tolerance {
        /// As asked.
        got: f64,
    },
    /// Fixed step that is not positive or not finite.
    Step {
        /// s.
        got: f64,
    },
    /// The exact method with a preloaded link.
    NotExact {
        /// Its index.
        link: usize,
    },
    /// The exact method with a moving rider.
    NotExactRiders,
    /// The exponential method on a scene that has preloaded links, and links with straight segments beside them.
    NotExponential {
        /// Index of the first link with straight segments.
        link: usize,
    },
    /// The exponential method with a moving rider.
    NotExponentialRiders,
    /// The error stays above the tolerance at the shortest step.
    StepTooSmall {
        /// When, s.
        time: f64,
        /// Shortest step tried, s.
        step: f64,
        /// Estimated error of that step as a multiple of the tolerance.
        error: f64,
        /// Way out.
        other: OtherMethod,
    },
    /// The state grows without bound: a fixed step outside the stability region of the method.
    Diverged {
        /// When, s.
        time: f64,
        /// Step, s.
        step: f64,
        /// Way out.
        other: OtherMethod,
    },
    /// An output time outside the excitation, or out of order.
    OutputTime {
        /// Which, from 0.
        index: usize,
        /// s.
        got: f64,
        /// First and last time allowed there, s.
        range: [f64; 2],
    },
    /// More work than any run of this motion should need.
    TooManySteps {
        /// When it gave up, s.
        time: f64,
        /// Last step, s.
        step: f64,
        /// Number of steps made, rejected ones included.
        steps: usize,
        /// Largest modal frequency, 1/s.
        fastest: f64,
        /// Way out.
        other: OtherMethod,
    },
    /// More steps than a run may take, known before the first.
    TooLong {
        /// Duration of the motion, or of the interval between samples, s.
        duration: f64,
        /// Number of steps that stability asks for, at least.
        steps: f64,
        /// Number allowed.
        most: f64,
        /// Rate of the fastest mode, 1/s.
        fastest: f64,
        /// Way out.
        other: OtherMethod,
    },
    /// More steps of a fixed length than a run may take, known before the first.
    ShortSteps {
        /// Length, s.
        step: f64,
        /// Number of steps that the motion asks for.
        steps: f64,
        /// Number allowed.
        most: f64,
        /// Way out.
        other: OtherMethod,
    },
    /// The record stopped the run: after Ctrl-C, for instance.
    Interrupted {
        /// When, s.
        time: f64,
    },
    /// Not enough memory for the record.
    Memory {
        /// Bytes that could not be had.
        bytes: usize,
    },
    /// No static equilibrium under the first sample of the excitation.
    NoQuasiStaticState {
        /// The motion `(u, φ)` in which the body leaves its links, largest entry 1.
        motion: Vector6<f64>,
    },
    /// A start state that is not finite, or not zero in a held degree of freedom.
    StartState {
        /// Index among the position and the velocity of x y z rx ry rz.
        component: usize,
        /// Its value.
        got: f64,
        /// Whether its degree of freedom is held.
        held: bool,
    },
    /// Loads beyond the range of numbers.
    OutOfRange,
    /// The eigenvalue iteration does not converge.
    Eigenvalues,
    /// A record that is too small.
    Capacity {
        /// Samples of the run.
        expected: usize,
        /// Samples that it can store.
        got: usize,
    },
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tolerance { got } => write!(
                f,
                "rtol: expected 1e-13 to 0.1 of the load scale, got {got:e}; below it, rounding is larger; where no link is \
                 preloaded, method \"exact\" has no step error"
            ),
            Self::Step { got } => write!(f, "step: expected > 0 s, got {got} s"),
            Self::NotExact { link } => write!(
                f,
                "method: links[{link}] has a preloaded contact, which has no exact solution; expected \"exponential\", \"rk45\", \
                 \"implicit\" or \"auto\""
            ),
            Self::NotExponential { link } => write!(
                f,
                "method: links[{link}] has clearance, one side or a curve beside preloaded contacts, whose changes \"exponential\" does not \
                 locate; expected \"rk45\", \"implicit\" or \"auto\""
            ),
            Self::NotExponentialRiders => f.write_str(
                "method: a rider moves, so the mass matrix changes, which \"exponential\" does not follow; expected \"rk45\", \"implicit\" \
                 or \"auto\"",
            ),
            Self::NotExactRiders => f.write_str(
                "method: a rider moves, so the mass matrix changes and there is no exact solution; expected \"rk45\", \"implicit\" \
                 or \"auto\"",
            ),
            Self::StepTooSmall { time, step, error, other } => write!(
                f,
                "step {step:.3e} s at t = {time:.9} s is below 1e-9 of the interval between samples (error {error:.3} x \
                 tolerance): loosen rtol{}",
                other.advice()
            ),
            Self::Diverged { time, step, other } => write!(
                f,
                "the solution grew without bound at t = {time:.9} s with a step of {step:.3e} s: the step is outside the \
                 method's stability region; shorten it or leave it to error control{}",
                other.advice()
            ),
            Self::OutputTime { index, got, range: [from, to] } => {
                write!(f, "times[{index}]: expected {from} to {to} s, ascending, got {got} s")
            }
            Self::TooManySteps { time, step, steps, fastest, other } => write!(
                f,
                "gave up at t = {time:.9} s after {steps} steps, the last of {step:.3e} s, far more than this motion should need: \
                 check the machine for a value that none has (its fastest mode turns at {fastest:.3e} rad/s), lengthen the step or \
                 loosen rtol{}",
                other.advice()
            ),
            Self::TooLong { duration, steps, most, fastest, other } => write!(
                f,
                "the fastest mode turns or decays at {fastest:.3e} rad/s, which an explicit method must follow: {duration:.3e} s would take \
                 {steps:.1e} steps or more, {most:.1e} are allowed: check that the time stamps are in s, shorten the motion{}",
                other.advice()
            ),
            Self::ShortSteps { step, steps, most, other } => write!(
                f,
                "step: {step:.3e} s would take {steps:.1e} steps for this motion, {most:.1e} are allowed: lengthen the step, or leave it out \
                 for steps by tolerance{}",
                other.advice()
            ),
            Self::Interrupted { time } => write!(f, "interrupted at t = {time:.9} s"),
            Self::Memory { bytes } => write!(
                f,
                "not enough memory for the states of all instants, {:.3} GB: use peak_loads, which stores none, or fewer times",
                *bytes as f64 * 1e-9
            ),
            Self::NoQuasiStaticState { motion } => {
                f.write_str(
                    "start: no static equilibrium under the first acceleration and force of the motion, which are more than the \
                     links bear against ",
                )?;
                write_motion(f, motion)?;
                f.write_str("; start at rest")
            }
            Self::StartState { component, got, held } => {
                let name = ["x", "y", "z", "rx", "ry", "rz"][component % 6];
                let history = if *component < 6 { "position" } else { "velocity" };
                let expected = if *held { "0, as this degree of freedom is held" } else { "a finite number" };
                write!(f, "start.{history}.{name}: expected {expected}, got {got}")
            }
            Self::OutOfRange => f.write_str(
                "the loads are beyond the range of numbers: are the accelerations and forces in m/s2, N and N m?",
            ),
            Self::Eigenvalues => f.write_str(
                "the eigenvalues of the damped system did not settle; frequencies and shapes without damping are available",
            ),
            Self::Capacity { expected, got } => {
                write!(f, "record: expected room for {expected} samples, got {got}")
            }
        }
    }
}

impl core::error::Error for RunError {}
