//! BoundedVec scenes side by side in damped modes: statics, modes, rows of loads.
//!
//! With `y = (p, -p̄)`, `p = (iω η + η') / √2`, the equations of motion are `y' = M y + (f, -f) / √2` with the complex symmetric
//! `M = [[iΩ - Ĉ/2, Ĉ/2], [Ĉ/2, -iΩ - Ĉ/2]]`. A complex orthogonal T turns it diagonal, and each mode `z' = λ z + g u` goes its own way. Counted
//! from where the excitation would hold it, `v = z + (g/λ) u`, it is driven by changes of u alone: `v' = λ v + (g/λ) u'`.

use pulp::{Simd, WithSimd};

use super::aligned_buffer::AlignedBuffer;
use super::assemble::{LaneLink, Links, mass_matrix, weight};
use super::dense::{cholesky, congruent, projected};
use super::jacobi::{DampedModes, symmetric};
use super::matrix::{MAX_MODES, Square};
use super::vector::{Complex, Real};
use crate::batch::instance::{Group, Instance};
use crate::batch::requirements::LoadRow;

/// What is to be known of each scene.
#[derive(Debug, Clone)]
pub(super) struct ModalRequest<'a> {
    /// Free degrees of freedom, ascending.
    pub dofs: Vec<usize>,
    /// Links of each group.
    pub groups: &'a [Group],
    /// Components of the excitation that are not zero throughout.
    pub components: Vec<usize>,
    pub rows: Vec<LoadRow>,
    /// Values of these components at the first sample.
    pub first: Vec<f64>,
    /// Of the motion, s.
    pub duration: f64,
}

/// As many scenes as there are lanes, in damped modes: numbers for the kernels, complex ones as pairs.
#[derive(Debug, Default)]
pub(super) struct ModalScenes {
    /// λ of each mode, 1/s.
    pub(super) eigenvalues: AlignedBuffer,
    /// `g/λ` of each mode, for each component of the excitation.
    pub(super) drive: AlignedBuffer,
    /// Number of wanted rows.
    pub(super) rows: usize,
    /// Of each [`TILE`] rows side by side: their values at rest, what a unit of each component of the excitation adds, then, mode by mode, what
    /// a unit of the real and of the imaginary part of v adds. Rows that fill the last tile up are zero.
    pub(super) tiles: AlignedBuffer,
    /// Value of each row at the first sample, before anything has moved.
    pub(super) starts: AlignedBuffer,
    /// One in the lanes in which all this is right to what the arithmetic allows; the others need the careful way.
    pub(super) sound: AlignedBuffer,
}

/// Limits up to which rounding leaves less than 1e-12 of the loads.
///
/// Spread of ω², times that of the pivots of the mass matrix (as where L is far from the body): K and M are formed here, which squares what the
/// careful way keeps apart.
const SPREAD: f64 = 1e3;
/// Of ω², beyond which its square leaves the range of numbers.
const SMALLEST: f64 = 1e-100;
/// Of a row, beyond which its squares do.
const LARGEST: f64 = 1e150;
/// Radians that every mode turns, or decays by, in a motion: in less the loads are so far below what the excitation would hold for ever, from
/// which they are counted, that they lose digits.
const LEAST_TURN: f64 = 0.3;
/// Square of the size of T, per mode: 1 where damping does not couple, infinite where two modes become one.
const CONDITION: f64 = 50.0;
/// Radians that a mode turns while it lasts: an error in λ is that many times as large in the load.
const TURNS: f64 = 2e3;

/// Rows that are worked out side by side.
pub(super) const TILE: usize = 4;

/// Fills a [`ModalScenes`] from as many scenes as there are lanes.
pub(super) struct ModalSetup<'a> {
    pub scenes: &'a [&'a Instance],
    pub wanted: &'a ModalRequest<'a>,
    pub to: &'a mut ModalScenes,
}

impl WithSimd for ModalSetup<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scenes, wanted, to } = self;
        let zero = Real::splat(simd, 0.0);
        let dofs = &wanted.dofs[..usize::min(wanted.dofs.len(), MAX_MODES)];
        let n = dofs.len();
        let mass = mass_matrix(simd, scenes);
        let weight = weight(simd, scenes);
        let links = Links::new(simd, scenes, dofs);

        let mut lower = [[zero; MAX_MODES]; MAX_MODES];
        for i in 0..n {
            for j in 0..n {
                lower[i][j] = mass[dofs[i]][dofs[j]];
            }
        }
        let pivots = cholesky(&mut lower, n);
        let (mut stiffness, mut damping) = links.matrices(simd, n);
        congruent(&lower, &mut stiffness, n);
        let vectors = symmetric(simd, &mut stiffness, n);
        // Shapes Φ = L⁻ᵀ V.
        let mut shapes = vectors;
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
        let mut sound = high.less_than(low * pivots * low.constant(SPREAD));
        sound = sound
            .and(low.constant(SMALLEST).less_than(low))
            .and(high.less_than(high.constant(1.0 / SMALLEST)));
        damping = projected(&shapes, &damping, n);

        // The influence of a unit of each component, and of the weight, on the modes.
        let mut influence = Vec::with_capacity(wanted.components.len());
        for &component in &wanted.components {
            let mut force = [zero; 6];
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
            let mut modal = on_modes(&shapes, dofs, &force);
            for entry in &mut modal {
                *entry = *entry * factor;
            }
            influence.push((modal, factor));
        }
        let mut rest = on_modes(&shapes, dofs, &weight);
        for mode in 0..n {
            rest[mode] = rest[mode] / frequency[mode];
        }

        let half = Real::splat(simd, 0.5);
        let none = Complex::new(zero, zero);
        let (mut a, mut b) = ([[none; MAX_MODES]; MAX_MODES], [[none; MAX_MODES]; MAX_MODES]);
        for i in 0..n {
            for j in 0..n {
                let coupling = half * damping[i][j];
                a[i][j] = Complex::new(-coupling, if i == j { frequency[i] } else { zero });
                b[i][j] = Complex::new(coupling, zero);
            }
        }
        let mut modes = DampedModes::new(simd, a, b, n);
        modes.turn();
        sound = sound.and_not(modes.creeps);
        let mut eigenvalues = [none; MAX_MODES];
        let (mut size, mut trace, mut damped) = (zero, zero, zero);
        for k in 0..n {
            eigenvalues[k] = modes.a[k][k];
            let mut largest = zero;
            for i in 0..n {
                size = size + modes.upper[i][k].norm_squared() + modes.lower[i][k].norm_squared();
                if i != k {
                    largest = largest.max(modes.a[i][k].norm_squared());
                }
                largest = largest.max(modes.b[i][k].norm_squared());
            }
            let square = eigenvalues[k].norm_squared();
            let settled = largest.less_than(square * square.constant(1e-28));
            // Of the time that the motion takes and the time in which the mode decays the shorter.
            let memory = (-eigenvalues[k].re).max(square.constant(1.0 / wanted.duration));
            let turns = (eigenvalues[k].im).less_than(memory * square.constant(TURNS));
            let swings = zero.less_than(eigenvalues[k].im);
            let least = square.constant(LEAST_TURN / wanted.duration);
            let lasts = (least * least).less_than(square);
            sound = sound.and(settled).and(turns).and(swings).and(lasts);
            trace = trace + eigenvalues[k].re;
            damped = damped + half * damping[k][k];
        }
        // No rotation changes a trace.
        let stores_values =
            (trace + damped).abs().less_than((damped + frequency[n - 1]) * damped.constant(1e-12));
        sound = sound.and(stores_values);
        sound = sound.and(size.less_than(size.constant(CONDITION * n as f64)));

        for (to, value) in to.eigenvalues.clear::<S>(2 * n).as_chunks_mut::<2>().0.iter_mut().zip(eigenvalues)
        {
            *to = value.lanes();
        }
        // g = Tᵀ (f, -f) / √2.
        let root = Real::splat(simd, core::f64::consts::FRAC_1_SQRT_2);
        let drives = to.drive.clear::<S>(influence.len() * 2 * n).as_chunks_mut::<2>().0;
        for ((force, _), drive) in influence.iter().zip(drives.chunks_exact_mut(n)) {
            for k in 0..n {
                let mut sum = none;
                for j in 0..n {
                    sum = sum + (modes.upper[j][k] - modes.lower[j][k]).scale(force[j] * root);
                }
                drive[k] = (sum * eigenvalues[k].recip()).lanes();
            }
        }

        let width = 1 + influence.len() + 2 * n;
        to.rows = wanted.rows.len();
        let tiles = to.tiles.clear::<S>(to.rows.next_multiple_of(TILE) * width).as_chunks_mut::<TILE>().0;
        let starts = to.starts.clear::<S>(to.rows);
        let mut feeds = vec![zero; influence.len()];
        let mut size = zero;
        for (index, row) in wanted.rows.iter().enumerate() {
            let (tile, place) = (&mut tiles[index / TILE * width..][..width], index % TILE);
            feeds.fill(zero);
            let mut of = RowParts::new(simd);
            match *row {
                LoadRow::Group(group, component) => {
                    for &link in &wanted.groups[group].links {
                        of.add(
                            &links.all[link],
                            &shapes,
                            &frequency,
                            n,
                            links.arm(simd, scenes, link, group, component),
                        );
                    }
                    of.at_rest(&rest, n);
                }
                LoadRow::Drive => {
                    for (index, link) in links.all.iter().enumerate() {
                        of.add(
                            link,
                            &shapes,
                            &frequency,
                            n,
                            Real::gather(simd, |lane| scenes[lane].links()[index].direction().x),
                        );
                    }
                    of.at_rest(&rest, n);
                    of.constant = of.constant - weight[0];
                    // M q'' in the row of x, with η'' = -ω (ωη) - Ĉ η' + f.
                    let mut inert = [zero; MAX_MODES];
                    for mode in 0..n {
                        for i in 0..n {
                            inert[mode] = mass[0][dofs[i]].mul_add(shapes[i][mode], inert[mode]);
                        }
                        of.elastic[mode] = (-inert[mode]).mul_add(frequency[mode], of.elastic[mode]);
                    }
                    for mode in 0..n {
                        for i in 0..n {
                            of.damping[mode] = (-inert[i]).mul_add(damping[i][mode], of.damping[mode]);
                        }
                    }
                    for ((feed, &component), (force, factor)) in
                        feeds.iter_mut().zip(&wanted.components).zip(&influence)
                    {
                        let mut sum = match component {
                            0..3 => mass[0][component] * *factor,
                            3 => -*factor,
                            _ => zero,
                        };
                        for mode in 0..n {
                            sum = inert[mode].mul_add(force[mode], sum);
                        }
                        *feed = sum;
                    }
                }
            }
            tile[0][place] = of.constant.lanes;
            let mut start = of.constant;
            for (feed, &value) in feeds.iter().zip(&wanted.first) {
                start = feed.mul_add(Real::splat(simd, value), start);
            }
            starts[index] = start.lanes;
            size = size + start.abs();
            // Per unit of p and of -p̄, then of the modes: out = 2 Re(Σ c z), z = v - (g/λ) u.
            for k in 0..n {
                let mut c = none;
                for j in 0..n {
                    let (e, d) = (of.elastic[j] * root, of.damping[j] * root);
                    c = Complex::new(d, -e).mul_add(modes.upper[j][k], c);
                    c = Complex::new(-d, -e).mul_add(modes.lower[j][k], c);
                }
                for (feed, drive) in feeds.iter_mut().zip(drives.chunks_exact(n)) {
                    let still = c * Complex::of(simd, drive[k]);
                    *feed = *feed - (still.re + still.re);
                }
                size = size + c.re.abs() + c.im.abs();
                let coefficients = &mut tile[1 + influence.len() + 2 * k..];
                (coefficients[0][place], coefficients[1][place]) =
                    ((c.re + c.re).lanes, (-(c.im + c.im)).lanes);
            }
            for (feed, to) in feeds.iter().zip(&mut tile[1..]) {
                to[place] = feed.lanes;
                size = size + feed.abs();
            }
        }
        sound = sound.and(size.less_than(size.constant(LARGEST)));
        to.sound.clear::<S>(1)[0] = sound.select(Real::splat(simd, 1.0), zero).lanes;
    }
}

/// A row per unit of `ωη` and `η'`, and at rest.
#[derive(Debug)]
struct RowParts<S: Simd> {
    constant: Real<S>,
    elastic: [Real<S>; MAX_MODES],
    damping: [Real<S>; MAX_MODES],
}

impl<S: Simd> RowParts<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
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
