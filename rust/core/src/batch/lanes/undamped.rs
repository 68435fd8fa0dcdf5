//! Masses, stiffnesses, undamped modes, static position and rows of loads of many scenes, one in each lane.

use pulp::Simd;

use super::assemble::{LaneLink, Links, mass_matrix, weight};
use super::dense::{MAX_MODES, Square, cholesky, congruent, projected};
use super::jacobi::symmetric;
use super::request::ModalRequest;
use super::vector::{Mask, Number, Real};
use crate::batch::requirements::LoadRow;
use crate::model::Body;
use crate::variation::Instance;

/// Largest product of the spread of ω² and that of the pivots of the mass matrix (large if L is far from the body) for which rounding
/// errors are below 1e-12 of the loads. Forming K and M squares the spread; `system::undamped_modes` does not form them.
const MAX_SPREAD: f64 = 1e3;

/// Smallest ω² [1/s²]: below, the body may rest kilometres away, which `System::new` judges; and the largest, whose square is within the
/// range of numbers.
const SMALLEST: f64 = 1e-3;
const LARGEST: f64 = 1e100;

/// Undamped modes of the scenes, their damping, modal forces and static position.
pub(super) struct Undamped<S: Simd> {
    pub n: usize,
    pub zero: Real<S>,
    pub mass: [[Real<S>; 6]; 6],
    weight: [Real<S>; 6],
    links: Links<S>,
    /// Φ = L⁻ᵀ V.
    pub shapes: Square<Real<S>>,
    pub frequency: [Real<S>; MAX_MODES],
    /// Ĉ.
    pub damping: Square<Real<S>>,
    /// Modal force of a unit of each component of the excitation, and the sample's factor on this component.
    pub influence: Vec<([Real<S>; MAX_MODES], Real<S>)>,
    /// Static position, ωη.
    pub rest: [Real<S>; MAX_MODES],
    /// Lanes in which rounding leaves enough digits.
    pub accurate: Mask<S>,
}

impl<S: Simd> Undamped<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, scenes: &[&Instance], bodies: &[Body], request: &ModalRequest) -> Self {
        let zero = Real::splat(simd, 0.0);
        let dofs = &request.dofs[..usize::min(request.dofs.len(), MAX_MODES)];
        let n = dofs.len();
        let mass = mass_matrix(simd, bodies);
        let weight = weight(simd, scenes, bodies);
        let links = Links::new(simd, scenes, dofs);
        let mut lower = [[zero; MAX_MODES]; MAX_MODES];
        for i in 0..n {
            for j in 0..n {
                lower[i][j] = mass[dofs[i]][dofs[j]];
            }
        }
        let pivots = cholesky(&mut lower, n);
        let (mut stiffness, damping) = links.matrices(simd, n);
        congruent(&lower, &mut stiffness, n);
        let mut shapes = symmetric(simd, &mut stiffness, n);
        for mode in 0..n {
            for i in (0..n).rev() {
                let mut sum = shapes[i][mode];
                for k in i + 1..n {
                    sum = (-lower[k][i]).mul_add(shapes[k][mode], sum);
                }
                shapes[i][mode] = sum / lower[i][i];
            }
        }
        let (mut frequency, mut high, mut low) = ([zero; MAX_MODES], stiffness[0][0], stiffness[0][0]);
        for mode in 0..n {
            let square = stiffness[mode][mode];
            (high, low) = (high.max(square), low.min(square));
            frequency[mode] = square.sqrt();
        }
        let accurate = high
            .less_than(low * pivots * low.constant(MAX_SPREAD))
            .and(low.constant(SMALLEST).less_than(low))
            .and(high.less_than(high.constant(LARGEST)));
        let damping = projected(&shapes, &damping, n);
        // A loop and no iterator: a closure would be compiled for the oldest processor.
        let mut influence = Vec::with_capacity(request.components.len());
        for &component in &request.components {
            influence.push(modal_influence(simd, scenes, &mass, &shapes, dofs, component));
        }
        let mut force = weight;
        for link in &links.all {
            let Some(load) = link.load_of_offset else { continue };
            for (i, &dof) in dofs.iter().enumerate() {
                force[dof] = load.mul_add(link.row[i], force[dof]);
            }
        }
        let mut rest = on_modes(&shapes, dofs, &force);
        for mode in 0..n {
            rest[mode] = rest[mode] / frequency[mode];
        }
        Self { n, zero, mass, weight, links, shapes, frequency, damping, influence, rest, accurate }
    }

    /// A load per unit of `ωη`, of `η'` and, into `feeds`, of each component of the excitation.
    #[inline(always)]
    pub(super) fn row(
        &self,
        simd: S,
        scenes: &[&Instance],
        request: &ModalRequest,
        row: LoadRow,
        feeds: &mut [Real<S>],
    ) -> RowParts<S> {
        feeds.fill(self.zero);
        let mut of = RowParts::new(simd);
        match row {
            LoadRow::Group { component, group } => {
                for &link in &request.groups[group].links {
                    let arm = self.links.arm(simd, scenes, link, group, component);
                    of.add(&self.links.all[link], &self.shapes, &self.frequency, self.n, arm);
                }
                of.at_rest(&self.rest, self.n);
            }
            LoadRow::Drive => {
                for (index, link) in self.links.all.iter().enumerate() {
                    let arm = Real::gather(simd, |lane| scenes[lane].links()[index].direction().x);
                    of.add(link, &self.shapes, &self.frequency, self.n, arm);
                }
                of.at_rest(&self.rest, self.n);
                of.constant = of.constant - self.weight[0];
                self.add_inertia(request, &mut of, feeds);
            }
        }
        of
    }

    /// Adds `M q''` in the row of x, with `η'' = -ω (ωη) - Ĉ η' + f`.
    #[inline(always)]
    fn add_inertia(&self, request: &ModalRequest, of: &mut RowParts<S>, feeds: &mut [Real<S>]) {
        let n = self.n;
        let mut inert = [self.zero; MAX_MODES];
        for mode in 0..n {
            for i in 0..n {
                inert[mode] = self.mass[0][request.dofs[i]].mul_add(self.shapes[i][mode], inert[mode]);
            }
            of.elastic[mode] = (-inert[mode]).mul_add(self.frequency[mode], of.elastic[mode]);
        }
        for mode in 0..n {
            for i in 0..n {
                of.damping[mode] = (-inert[i]).mul_add(self.damping[i][mode], of.damping[mode]);
            }
        }
        for ((feed, &component), (force, factor)) in
            feeds.iter_mut().zip(&request.components).zip(&self.influence)
        {
            let mut sum = match component {
                0..3 => self.mass[0][component] * *factor,
                3 => -*factor,
                _ => self.zero,
            };
            for mode in 0..n {
                sum = inert[mode].mul_add(force[mode], sum);
            }
            *feed = sum;
        }
    }
}

/// Modal force of a unit of a component of the excitation, and the sample's factor on this component.
#[inline(always)]
fn modal_influence<S: Simd>(
    simd: S,
    scenes: &[&Instance],
    mass: &[[Real<S>; 6]; 6],
    shapes: &Square<Real<S>>,
    dofs: &[usize],
    component: usize,
) -> ([Real<S>; MAX_MODES], Real<S>) {
    let mut force = [Real::splat(simd, 0.0); 6];
    let factor;
    if component < 3 {
        factor = Real::gather(simd, |lane| scenes[lane].factors()[0]);
        for dof in 0..6 {
            force[dof] = -mass[dof][component];
        }
    } else {
        factor = Real::gather(simd, |lane| scenes[lane].factors()[1]);
        force[component - 3] = Real::splat(simd, 1.0);
    }
    let mut modal = on_modes(shapes, dofs, &force);
    for entry in &mut modal {
        *entry = *entry * factor;
    }
    (modal, factor)
}

/// A row per unit of `ωη` and `η'`, and at rest.
#[derive(Debug)]
pub(super) struct RowParts<S: Simd> {
    pub constant: Real<S>,
    pub elastic: [Real<S>; MAX_MODES],
    pub damping: [Real<S>; MAX_MODES],
}

impl<S: Simd> RowParts<S> {
    #[inline(always)]
    pub(super) fn new(simd: S) -> Self {
        let zero = Real::splat(simd, 0.0);
        Self { constant: zero, elastic: [zero; MAX_MODES], damping: [zero; MAX_MODES] }
    }

    /// Adds `arm` times the load of a link.
    #[inline(always)]
    fn add(
        &mut self,
        link: &LaneLink<S>,
        shapes: &Square<Real<S>>,
        frequency: &[Real<S>; MAX_MODES],
        n: usize,
        arm: Real<S>,
    ) {
        if let Some(load) = link.load_of_offset {
            self.constant = (-arm).mul_add(load, self.constant);
        }
        let (stiffness, damping) = (arm * link.stiffness, arm * link.damping);
        for mode in 0..n {
            let mut rate = arm.constant(0.0);
            for i in 0..n {
                rate = link.row[i].mul_add(shapes[i][mode], rate);
            }
            self.elastic[mode] = (stiffness * rate) / frequency[mode] + self.elastic[mode];
            self.damping[mode] = damping.mul_add(rate, self.damping[mode]);
        }
    }

    #[inline(always)]
    fn at_rest(&mut self, rest: &[Real<S>; MAX_MODES], n: usize) {
        for mode in 0..n {
            self.constant = self.elastic[mode].mul_add(rest[mode], self.constant);
        }
    }
}

/// `Φᵀ` times the free entries of a force.
#[inline(always)]
fn on_modes<S: Simd>(shapes: &Square<Real<S>>, dofs: &[usize], force: &[Real<S>; 6]) -> [Real<S>; MAX_MODES] {
    let n = usize::min(dofs.len(), MAX_MODES);
    let mut out = [force[0].constant(0.0); MAX_MODES];
    for mode in 0..n {
        for i in 0..n {
            out[mode] = shapes[i][mode].mul_add(force[dofs[i]], out[mode]);
        }
    }
    out
}
