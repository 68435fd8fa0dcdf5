//! Preloaded scenes side by side, one in each lane of vectors: their propagators, and the loads of their balls.
//!
//! Operations and their order are those of [`CubicPropagator`] and [`SmoothEquations`], so a scene gets the same bits as by itself. See
//! `numeric::simd` for why this file uses `pulp`.

use pulp::{Simd, bytemuck};

use super::ball_links::{BallLinks, POWERS_OF_3};
use super::cubic::CubicPropagator;
use super::smooth::{SIGNATURE_FACTOR, SmoothEquations};
use super::{Equations, Remainder};
use crate::numeric::simd::LANES;

/// A state of each scene, entry by entry.
pub(crate) type States<S> = [<S as Simd>::f64s; 12];

/// A modal force on each scene, entry by entry.
pub(crate) type Forces<S> = [<S as Simd>::f64s; 6];

/// The number of one scene.
#[inline(always)]
pub(crate) fn number<S: Simd>(lanes: &mut S::f64s, scene: usize) -> &mut f64 {
    let numbers: &mut [f64] = bytemuck::cast_slice_mut(core::slice::from_mut(lanes));
    &mut numbers[scene]
}

/// Adds `factor * column` to `sum`, in the entries of N modes; the others are zero.
#[inline(always)]
fn add_product<S: Simd, const N: usize, const ENTRIES: usize>(
    simd: S,
    sum: &mut [S::f64s; ENTRIES],
    column: &[S::f64s; ENTRIES],
    factor: S::f64s,
) {
    for i in 0..ENTRIES {
        if i % 6 < N {
            sum[i] = simd.mul_add_f64s(column[i], factor, sum[i]);
        }
    }
}

/// `sum + other`, entry by entry.
#[inline(always)]
pub(crate) fn plus<S: Simd, const N: usize>(
    simd: S,
    mut sum: [S::f64s; N],
    other: &[S::f64s; N],
) -> [S::f64s; N] {
    for i in 0..N {
        sum[i] = simd.add_f64s(sum[i], other[i]);
    }
    sum
}

/// A [`CubicPropagator`] for each scene, of at most N modes.
#[derive(Debug, Clone)]
pub(crate) struct Propagators<S: Simd, const N: usize> {
    exp_minus_identity: [States<S>; 12],
    response: [[States<S>; 6]; 4],
}

impl<S: Simd, const N: usize> Propagators<S, N> {
    /// Of these propagators, one for each lane.
    pub(crate) fn new<'a>(simd: S, each: impl Iterator<Item = &'a CubicPropagator>) -> Self {
        let zero = simd.splat_f64s(0.0);
        let mut all = Self { exp_minus_identity: [[zero; 12]; 12], response: [[[zero; 12]; 6]; 4] };
        for (scene, one) in each.enumerate() {
            let from = one
                .exp_minus_identity
                .as_flattened()
                .iter()
                .chain(one.response.as_flattened().as_flattened());
            let to = all.exp_minus_identity.as_flattened_mut().iter_mut();
            let to = to.chain(all.response.as_flattened_mut().as_flattened_mut());
            for (to, from) in to.zip(from) {
                *number::<S>(to, scene) = *from;
            }
        }
        all
    }

    /// The states at the end of the step under forces that are linear in time, of these two coefficients.
    #[inline(always)]
    pub(crate) fn apply(&self, simd: S, states: &States<S>, force: [&Forces<S>; 2]) -> States<S> {
        let zero = simd.splat_f64s(0.0);
        let (mut sum, mut second, mut third) = ([zero; 12], *states, [zero; 12]);
        for j in 0..N {
            add_product::<S, N, _>(simd, &mut second, &self.response[0][j], force[0][j]);
        }
        for j in (1..12).step_by(3) {
            if j % 6 < N {
                add_product::<S, N, _>(simd, &mut second, &self.exp_minus_identity[j], states[j]);
            }
        }
        for j in 0..N {
            add_product::<S, N, _>(simd, &mut third, &self.response[1][j], force[1][j]);
        }
        for j in (2..12).step_by(3) {
            if j % 6 < N {
                add_product::<S, N, _>(simd, &mut third, &self.exp_minus_identity[j], states[j]);
            }
        }
        for j in (0..12).step_by(3) {
            if j % 6 < N {
                add_product::<S, N, _>(simd, &mut sum, &self.exp_minus_identity[j], states[j]);
            }
        }
        plus(simd, sum, &plus(simd, second, &third))
    }

    /// [`CubicPropagator::curved`] of each scene.
    #[inline(always)]
    pub(crate) fn curved(&self, simd: S, [quadratic, cubic]: [&Forces<S>; 2]) -> [States<S>; 2] {
        let zero = simd.splat_f64s(0.0);
        let (mut both, mut difference) = ([zero; 12], [zero; 12]);
        for j in 0..N {
            add_product::<S, N, _>(
                simd,
                &mut both,
                &self.response[2][j],
                simd.add_f64s(quadratic[j], cubic[j]),
            );
        }
        for j in 0..N {
            add_product::<S, N, _>(simd, &mut difference, &self.response[3][j], cubic[j]);
        }
        [plus(simd, both, &difference), difference]
    }
}

/// The same link of each scene, with preloaded balls.
#[derive(Debug, Clone, Copy)]
struct BallLink<S: Simd> {
    deflection: Forces<S>,
    /// Less the modal force per unit of load, the load at rest, and the stiffness there, so that no signs are left to change.
    minus_rate: Forces<S>,
    minus_load: S::f64s,
    minus_stiffness: S::f64s,
    rest: S::f64s,
    opening: S::f64s,
    coefficient: S::f64s,
}

/// A [`Remainder`] of each scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Remainders<S: Simd> {
    pub force: Forces<S>,
    pub rate: Forces<S>,
    pub contact_signature: S::f64s,
}

impl<S: Simd> Remainders<S> {
    /// Of scenes at rest.
    pub(crate) fn none(simd: S) -> Self {
        let zero = simd.splat_f64s(0.0);
        Self { force: [zero; 6], rate: [zero; 6], contact_signature: zero }
    }

    /// Sets those of one scene.
    #[inline(always)]
    pub(crate) fn set(&mut self, scene: usize, one: &Remainder) {
        for i in 0..6 {
            *number::<S>(&mut self.force[i], scene) = one.force[i];
            *number::<S>(&mut self.rate[i], scene) = one.rate[i];
        }
        *number::<S>(&mut self.contact_signature, scene) = one.contact_signature;
    }

    /// That of one scene.
    pub(crate) fn one(&mut self, scene: usize) -> Remainder {
        let mut one = Remainder {
            contact_signature: *number::<S>(&mut self.contact_signature, scene),
            ..Remainder::NONE
        };
        for i in 0..6 {
            one.force[i] = *number::<S>(&mut self.force[i], scene);
            one.rate[i] = *number::<S>(&mut self.rate[i], scene);
        }
        one
    }
}

/// The nonlinear loads of scenes of at most N modes, with the same number of links with preloaded balls.
#[derive(Debug, Clone)]
pub(crate) struct BallScenes<S: Simd, const N: usize> {
    frequency: Forces<S>,
    /// Eight links at a time.
    blocks: Vec<[BallLink<S>; LANES]>,
}

impl<S: Simd, const N: usize> BallScenes<S, N> {
    /// Of scenes, one for each lane, whose links all have preloaded balls, or linear laws; none if one has another law, or another number of
    /// them.
    pub(crate) fn new<'a, 's: 'a>(
        simd: S,
        each: impl Iterator<Item = &'a SmoothEquations<'s>> + Clone,
    ) -> Option<Self> {
        let count = each.clone().next()?.balls().len();
        if each.clone().any(|one| !one.has_only_balls() || one.balls().len() != count) {
            return None;
        }
        let zero = simd.splat_f64s(0.0);
        let none = BallLink {
            deflection: [zero; 6],
            minus_rate: [zero; 6],
            minus_load: zero,
            minus_stiffness: zero,
            rest: zero,
            opening: zero,
            coefficient: zero,
        };
        let mut all = Self { frequency: [zero; 6], blocks: vec![[none; LANES]; count] };
        for (scene, one) in each.enumerate() {
            for (to, from) in all.frequency.iter_mut().zip(one.frequency()) {
                *number::<S>(to, scene) = *from;
            }
            for (block, from) in all.blocks.iter_mut().zip(one.balls()) {
                for (lane, link) in block.iter_mut().enumerate() {
                    link.set(scene, from, lane);
                }
            }
        }
        Some(all)
    }

    /// [`Equations::remainder`] of each scene.
    #[inline(always)]
    pub(crate) fn remainder(&self, simd: S, states: &States<S>) -> Remainders<S> {
        let zero = simd.splat_f64s(0.0);
        let mut moving = [zero; 6];
        for i in 0..6 {
            moving[i] = simd.mul_f64s(self.frequency[i], states[6 + i]);
        }
        let [mut force, mut second, mut rate, mut second_rate] = [[zero; 6]; 4];
        let mut contact_signature = zero;
        for block in &self.blocks {
            let mut open = zero;
            for (lane, pair) in block.as_chunks::<2>().0.iter().enumerate() {
                let [load, load_rate, digit] = pair[0].loads::<N>(simd, states, &moving);
                let [other, other_rate, other_digit] = pair[1].loads::<N>(simd, states, &moving);
                add_product::<S, N, _>(simd, &mut force, &pair[0].minus_rate, load);
                add_product::<S, N, _>(simd, &mut rate, &pair[0].minus_rate, load_rate);
                add_product::<S, N, _>(simd, &mut second, &pair[1].minus_rate, other);
                add_product::<S, N, _>(simd, &mut second_rate, &pair[1].minus_rate, other_rate);
                open = simd.mul_add_f64s(digit, simd.splat_f64s(POWERS_OF_3[2 * lane]), open);
                open = simd.mul_add_f64s(other_digit, simd.splat_f64s(POWERS_OF_3[2 * lane + 1]), open);
            }
            contact_signature = simd.mul_add_f64s(contact_signature, simd.splat_f64s(SIGNATURE_FACTOR), open);
        }
        let (force, rate) = (plus(simd, force, &second), plus(simd, rate, &second_rate));
        Remainders { force, rate, contact_signature }
    }
}

impl<S: Simd> BallLink<S> {
    /// Sets the link of a scene to one of eight.
    fn set(&mut self, scene: usize, from: &BallLinks, lane: usize) {
        for j in 0..6 {
            *number::<S>(&mut self.deflection[j], scene) = from.deflection[j][lane];
            *number::<S>(&mut self.minus_rate[j], scene) = -from.rate[lane][j];
        }
        for (to, from) in [
            (&mut self.rest, from.rest),
            (&mut self.opening, from.opening),
            (&mut self.coefficient, from.coefficient),
        ] {
            *number::<S>(to, scene) = from[lane];
        }
        *number::<S>(&mut self.minus_load, scene) = -from.load[lane];
        *number::<S>(&mut self.minus_stiffness, scene) = -from.stiffness[lane];
    }

    /// Load beyond the linear part, its rate of change, and the digit of the open row.
    #[inline(always)]
    fn loads<const N: usize>(&self, simd: S, states: &States<S>, moving: &Forces<S>) -> [S::f64s; 3] {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let from_rest = self.deflections::<N>(simd, states);
        let at = simd.add_f64s(self.rest, from_rest);
        let (a, b) = (simd.add_f64s(self.opening, at), simd.sub_f64s(self.opening, at));
        let (has_a, has_b) = (simd.less_than_f64s(zero, a), simd.less_than_f64s(zero, b));
        let (a, b) = (simd.select_f64s(has_a, a, zero), simd.select_f64s(has_b, b, zero));
        let (root_a, root_b) = (simd.sqrt_f64s(a), simd.sqrt_f64s(b));
        let minus_linear = simd.mul_add_f64s(self.minus_stiffness, from_rest, self.minus_load);
        let force = simd.sub_f64s(simd.mul_f64s(a, root_a), simd.mul_f64s(b, root_b));
        let load = simd.mul_add_f64s(self.coefficient, force, minus_linear);
        let coefficient = simd.mul_f64s(simd.splat_f64s(1.5), self.coefficient);
        let slope = simd.mul_add_f64s(coefficient, simd.add_f64s(root_a, root_b), self.minus_stiffness);
        let rate = simd.mul_f64s(slope, self.deflections::<N>(simd, moving));
        let open = simd.sub_f64s(simd.select_f64s(has_a, zero, one), simd.select_f64s(has_b, zero, one));
        [load, rate, open]
    }

    /// Deflections from rest, or their rates of change.
    #[inline(always)]
    fn deflections<const N: usize>(&self, simd: S, positions: &[S::f64s]) -> S::f64s {
        let zero = simd.splat_f64s(0.0);
        let [mut sum, mut second] = [zero; 2];
        for j in 0..3 {
            sum = simd.mul_add_f64s(self.deflection[j], positions[j], sum);
            if 3 + j < N {
                second = simd.mul_add_f64s(self.deflection[3 + j], positions[3 + j], second);
            }
        }
        simd.add_f64s(sum, second)
    }
}
