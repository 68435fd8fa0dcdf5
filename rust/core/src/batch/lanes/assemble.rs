//! Mass matrices, weights and links of many scenes, one in each lane; see `crate::assemble` for one scene.

use pulp::Simd;

use super::dense::{MAX_MODES, Square};
use super::vector::{Number, Real};
use crate::model::Body;
use crate::variation::Instance;

/// `[[m I, -S], [S, J_L]]` with `S = m skew(r_S)` (eqs. 8, 11, 12).
#[inline(always)]
pub(super) fn mass_matrix<S: Simd>(simd: S, bodies: &[Body]) -> [[Real<S>; 6]; 6] {
    let m = Real::gather(simd, |lane| bodies[lane].mass());
    let r: [_; 3] =
        core::array::from_fn(|axis| Real::gather(simd, |lane| bodies[lane].center_of_mass()[axis]));
    let zero = m.constant(0.0);
    let mut out = [[zero; 6]; 6];
    let square = r[0].mul_add(r[0], r[1].mul_add(r[1], r[2] * r[2]));
    for i in 0..3 {
        out[i][i] = m;
        for j in 0..3 {
            let inertia = Real::gather(simd, |lane| bodies[lane].inertia()[(i, j)]);
            let about = if i == j { (-r[i]).mul_add(r[j], square) } else { -(r[i] * r[j]) };
            out[3 + i][3 + j] = m.mul_add(about, inertia);
        }
        // u × r: -S is m times the transpose of skew(r).
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (low, high) = (m * r[k], -(m * r[j]));
        (out[i][3 + j], out[3 + j][i]) = (low, low);
        (out[i][3 + k], out[3 + k][i]) = (high, high);
    }
    out
}

/// `(m g, r_S × m g)`.
#[inline(always)]
pub(super) fn weight<S: Simd>(simd: S, scenes: &[&Instance], bodies: &[Body]) -> [Real<S>; 6] {
    let m = Real::gather(simd, |lane| bodies[lane].mass());
    let force: [_; 3] =
        core::array::from_fn(|axis| m * Real::gather(simd, |lane| scenes[lane].gravity()[axis]));
    let r: [_; 3] =
        core::array::from_fn(|axis| Real::gather(simd, |lane| bodies[lane].center_of_mass()[axis]));
    let moment = cross(&r, &force);
    [force[0], force[1], force[2], moment[0], moment[1], moment[2]]
}

#[inline(always)]
fn cross<S: Simd>(a: &[Real<S>; 3], b: &[Real<S>; 3]) -> [Real<S>; 3] {
    core::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j].mul_add(b[k], -(a[k] * b[j]))
    })
}

/// One link in all scenes.
#[derive(Debug)]
pub(super) struct LaneLink<S: Simd> {
    /// Deflection per unit of each free degree of freedom (eqs. 14-17).
    pub row: [Real<S>; MAX_MODES],
    pub stiffness: Real<S>,
    pub damping: Real<S>,
    /// Load of its offset on the body, `k e`; none if no scene has one.
    pub load_of_offset: Option<Real<S>>,
}

/// All links in all scenes.
#[derive(Debug)]
pub(super) struct Links<S: Simd> {
    pub all: Vec<LaneLink<S>>,
}

impl<S: Simd> Links<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, scenes: &[&Instance], dofs: &[usize]) -> Self {
        let zero = Real::splat(simd, 0.0);
        let mut all = Vec::with_capacity(scenes[0].links().len());
        for index in 0..scenes[0].links().len() {
            let point: [_; 3] = core::array::from_fn(|axis| {
                Real::gather(simd, |lane| scenes[lane].links()[index].point()[axis])
            });
            // Directions do not vary.
            let o = scenes[0].links()[index].direction();
            let along: [_; 3] = core::array::from_fn(|axis| Real::splat(simd, o[axis]));
            let moment = cross(&point, &along);
            let mut row = [zero; MAX_MODES];
            for (i, &dof) in dofs.iter().enumerate() {
                row[i] = if dof < 3 { along[dof] } else { moment[dof - 3] };
            }
            let stiffness = Real::gather(simd, |lane| scenes[lane].links()[index].stiffness());
            let damping = Real::gather(simd, |lane| scenes[lane].links()[index].damping());
            let mut has_offset = false;
            for scene in scenes {
                has_offset |= scene.links()[index].offset() != 0.0;
            }
            let load_of_offset = if has_offset {
                Some(stiffness * Real::gather(simd, |lane| scenes[lane].links()[index].offset()))
            } else {
                None
            };
            all.push(LaneLink { row, stiffness, damping, load_of_offset });
        }
        Self { all }
    }

    /// K and C of the free degrees of freedom (eqs. 21-24, 30-33).
    #[inline(always)]
    pub(super) fn matrices(&self, simd: S, n: usize) -> (Square<Real<S>>, Square<Real<S>>) {
        let zero = Real::splat(simd, 0.0);
        let (mut k, mut c) = ([[zero; MAX_MODES]; MAX_MODES], [[zero; MAX_MODES]; MAX_MODES]);
        for link in &self.all {
            for i in 0..n {
                let (stiff, damped) = (link.stiffness * link.row[i], link.damping * link.row[i]);
                for j in 0..=i {
                    k[i][j] = stiff.mul_add(link.row[j], k[i][j]);
                    c[i][j] = damped.mul_add(link.row[j], c[i][j]);
                }
            }
        }
        for i in 0..n {
            for j in 0..i {
                (k[j][i], c[j][i]) = (k[i][j], c[i][j]);
            }
        }
        (k, c)
    }

    /// Component of the load of a group per unit of the load of a link.
    #[inline(always)]
    pub(super) fn arm(
        &self,
        simd: S,
        scenes: &[&Instance],
        link: usize,
        group: usize,
        component: usize,
    ) -> Real<S> {
        Real::gather(simd, |lane| {
            let scene = &scenes[lane];
            let (o, axes) = (scene.links()[link].direction(), scene.axes()[group]);
            if component < 3 {
                axes.components(o)[component]
            } else {
                let moment = (scene.links()[link].point() - scene.centers()[group]).cross(&o);
                axes.components(moment)[component - 3]
            }
        })
    }
}
