//! Derivatives of the exact step by numbers of the equations (Fréchet derivative of the exponential).

use super::Equations;
use super::propagator::{
    Columns, exp_minus_identity_of, identity, matrix, next_phi, norm_1, phi_terms, product, scale_by,
};
use crate::excitation::Values;
use crate::numeric::float::add_scaled;
use crate::system::{Force, State};

/// Derivatives of linear equations by one number, at a fixed state and input.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EquationsDerivative {
    /// Of A, by columns.
    pub matrix: Columns<12>,
    /// Of the modal force of a unit of each component of an input.
    pub influence: [Force; 9],
    /// Of the constant force.
    pub constant: Force,
}

/// The doublings of a [`Propagator`](super::Propagator), each value of which its derivatives need: the product rule is applied to every
/// operation, so that the derivative is exact for defective, overdamped and undamped equations, and for repeated eigenvalues.
#[derive(Debug, Clone)]
pub(crate) struct PropagatorStages {
    h: f64,
    /// s.
    tau: f64,
    /// A.
    matrix: Columns<12>,
    /// The columns of the force of the φ-functions of `A τ`, from the highest to φ₁.
    phi: Vec<Columns<6>>,
    /// E, `∫ exp(A s) ds` and `∫∫ exp(A s) ds²` of the force, before each doubling and at the end.
    stages: Vec<(Columns<12>, Columns<6>, Columns<6>)>,
}

/// Derivative of the exact step by one number: `x'(h) = (I + E) x'(0) + D (x(0), u(0), u(h), 1)`.
#[derive(Debug, Clone)]
pub(crate) struct PropagatorDerivative {
    /// Of E.
    pub(crate) exp_minus_identity: Columns<12>,
    pub(crate) from_constant: [f64; 12],
    /// Of the effects of each component at the start and at the end.
    pub(crate) from_start: Columns<9>,
    pub(crate) from_end: Columns<9>,
}

impl PropagatorStages {
    /// The stages of a step of `h` > 0 s.
    #[inline(always)]
    pub(crate) fn new<E: Equations>(equations: &E, h: f64) -> Self {
        let a = matrix(equations);
        let (mut tau, mut halvings) = (h, 0);
        while tau * norm_1(&a) > 1.0 {
            tau *= 0.5;
            halvings += 1;
        }
        // Two terms more, as derivatives of terms are of lower order in A.
        let count = phi_terms(tau * norm_1(&a)) + 2;
        let mut phi = vec![identity::<6>(6)];
        for n in (1..count).rev() {
            phi.push(next_phi(&a, tau / (n + 1) as f64, &phi[phi.len() - 1]));
        }
        let (mut once, mut twice) = (phi[count - 1], phi[count - 2]);
        scale_by(&mut once, tau);
        scale_by(&mut twice, tau * tau / 2.0);
        let mut stages = vec![(exp_minus_identity_of(&a, &once), once, twice)];
        let mut length = tau;
        for _ in 0..halvings {
            let (exp_minus_identity, once, twice) = stages[stages.len() - 1];
            let mut both = doubled(&twice, &exp_minus_identity);
            add(&mut both, &once, length);
            stages.push((
                doubled(&exp_minus_identity, &exp_minus_identity),
                doubled(&once, &exp_minus_identity),
                both,
            ));
            length *= 2.0;
        }
        Self { h, tau, matrix: a, phi, stages }
    }

    /// E of the whole step.
    pub(crate) fn exp_minus_identity(&self) -> &Columns<12> {
        &self.stages[self.stages.len() - 1].0
    }

    /// The derivative by a number. `influence`: modal force of a unit of each component of an input; `constant`: of the equations.
    #[inline(always)]
    pub(crate) fn derivative(
        &self,
        by: &EquationsDerivative,
        influence: &[Force; 9],
        constant: &Force,
    ) -> PropagatorDerivative {
        let (mut once, mut twice) = ([[0.0; 12]; 6], [[0.0; 12]; 6]);
        for (n, phi) in (1..self.phi.len()).rev().zip(&self.phi) {
            let mut next = products([(&by.matrix, phi), (&self.matrix, &once)]);
            scale_by(&mut next, self.tau / (n + 1) as f64);
            (once, twice) = (next, once);
        }
        scale_by(&mut once, self.tau);
        scale_by(&mut twice, self.tau * self.tau / 2.0);
        let mut exp_minus_identity = self.exp_minus_identity_derivative(&by.matrix, &once);
        let mut length = self.tau;
        for (e, o, t) in &self.stages[..self.stages.len() - 1] {
            let mut both = doubled(&twice, e);
            add(&mut both, &product(&exp_minus_identity, t), 1.0);
            add(&mut both, &once, length);
            twice = both;
            once = doubled(&once, e);
            add(&mut once, &product(&exp_minus_identity, o), 1.0);
            let moved = product(&exp_minus_identity, e);
            exp_minus_identity = doubled(&exp_minus_identity, e);
            add(&mut exp_minus_identity, &moved, 1.0);
            length *= 2.0;
        }
        let (_, o, t) = &self.stages[self.stages.len() - 1];
        self.with_forces([(o, &once), (t, &twice)], exp_minus_identity, (by, influence, constant))
    }

    /// Derivative of E before the doublings, from those of A and of the first integral.
    #[inline(always)]
    fn exp_minus_identity_derivative(&self, slope: &Columns<12>, once_slope: &Columns<6>) -> Columns<12> {
        let (_, once, _) = &self.stages[0];
        let mut exp_minus_identity = [[0.0; 12]; 12];
        for j in 0..6 {
            for i in 0..6 {
                add_scaled(&mut exp_minus_identity[j], &once_slope[i], self.matrix[j][6 + i]);
                add_scaled(&mut exp_minus_identity[j], &once[i], slope[j][6 + i]);
            }
        }
        exp_minus_identity[6..].copy_from_slice(&products([(slope, once), (&self.matrix, once_slope)]));
        exp_minus_identity
    }

    /// The derivative from those of E, and of both integrals of the force.
    #[inline(always)]
    fn with_forces(
        &self,
        [(o, once), (t, twice)]: [(&Columns<6>, &Columns<6>); 2],
        exp_minus_identity: Columns<12>,
        (by, influence, constant): (&EquationsDerivative, &[Force; 9], &Force),
    ) -> PropagatorDerivative {
        let (mut from_start, mut from_end, mut from_constant) = ([[0.0; 12]; 9], [[0.0; 12]; 9], [0.0; 12]);
        for component in 0..9 {
            for j in 0..6 {
                let (force, slope) = (influence[component][j], by.influence[component][j]);
                add_scaled(&mut from_start[component], &once[j], force);
                add_scaled(&mut from_start[component], &o[j], slope);
                add_scaled(&mut from_end[component], &twice[j], force / self.h);
                add_scaled(&mut from_end[component], &t[j], slope / self.h);
            }
            let end = from_end[component];
            add_scaled(&mut from_start[component], &end, -1.0);
        }
        for j in 0..6 {
            add_scaled(&mut from_constant, &once[j], constant[j]);
            add_scaled(&mut from_constant, &o[j], by.constant[j]);
        }
        PropagatorDerivative { exp_minus_identity, from_constant, from_start, from_end }
    }
}

impl PropagatorDerivative {
    /// Adds the derivative of the step at a fixed start to `to`. `components`: those of the input that are not zero throughout.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn add_to(&self, to: &mut State, state: &State, ends: [&Values; 2], components: &[usize]) {
        let (mut sum, mut second) = (self.from_constant, [0.0; 12]);
        for &component in components {
            add_scaled(&mut sum, &self.from_start[component], ends[0][component]);
            add_scaled(&mut second, &self.from_end[component], ends[1][component]);
        }
        for j in (0..12).step_by(2) {
            add_scaled(&mut sum, &self.exp_minus_identity[j], state[j]);
            add_scaled(&mut second, &self.exp_minus_identity[j + 1], state[j + 1]);
        }
        for i in 0..12 {
            to[i] += sum[i] + second[i];
        }
    }
}

/// Sum of two products of matrices.
#[inline(always)]
fn products<const N: usize>(factors: [(&Columns<12>, &Columns<N>); 2]) -> Columns<N> {
    let mut sum = product(factors[0].0, factors[0].1);
    add(&mut sum, &product(factors[1].0, factors[1].1), 1.0);
    sum
}

/// `2 columns + E columns`.
#[inline(always)]
fn doubled<const N: usize>(columns: &Columns<N>, exp_minus_identity: &Columns<12>) -> Columns<N> {
    let mut sum = product(exp_minus_identity, columns);
    add(&mut sum, columns, 2.0);
    sum
}

#[inline(always)]
fn add<const N: usize>(to: &mut Columns<N>, from: &Columns<N>, factor: f64) {
    for (to, from) in to.iter_mut().zip(from) {
        add_scaled(to, from, factor);
    }
}
