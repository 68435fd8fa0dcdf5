//! The input of the lane integrator from many scenes: eigenvalues, drives, and rows of loads in damped modes.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::assemble::mass_matrix;
use super::damped::Damped;
use super::drawn::Deviations;
use super::handover::{set_modal_state, set_state_rows};
use super::request::ModalRequest;
use super::undamped::Undamped;
use super::vector::{Complex, Number, Real};
use crate::model::Body;
use crate::variation::Instance;

/// Scenes in damped modes, one in each lane; complex numbers as pairs.
#[derive(Debug, Default)]
pub(super) struct ModalScenes {
    /// λ of each mode, 1/s.
    pub(super) eigenvalues: AlignedBuffer,
    /// `g/λ` of each mode, for each component of the excitation.
    pub(super) drive: AlignedBuffer,
    /// Number of wanted rows.
    pub(super) rows: usize,
    /// For each [`TILE`] rows side by side: the values at rest, the coefficients of each component of the excitation, then, mode by mode,
    /// those of the real and the imaginary part of v; then the sizes of some effects: the direct effect of each component, the largest one of
    /// a z of each mode of size one, and the effect of the rate of each component on the curvature, `2 Re(Σ c g)`. The last tile is filled up
    /// with zeros.
    pub(super) tiles: AlignedBuffer,
    /// Value of each row at the first sample.
    pub(super) starts: AlignedBuffer,
    /// Rows of position and velocity, if another window follows; see `handover`.
    pub(super) state_rows: AlignedBuffer,
    /// Position and velocity of the free degrees of freedom at the end of the window before, m, rad, m/s, rad/s.
    pub(super) state: AlignedBuffer,
    /// v before the first sample.
    pub(super) start: AlignedBuffer,
    /// One in lanes in which rounding leaves enough digits in all windows so far; zero in the others, whose scenes must run by themselves.
    pub(super) accurate: AlignedBuffer,
}

/// Largest size of a row; squares of larger ones would overflow.
const MAX_ROW_SIZE: f64 = 1e150;

/// Load rows evaluated side by side.
pub(super) const TILE: usize = 4;

/// Vectors of each row of a tile, for some modes and components of the excitation.
pub(super) fn width(modes: usize, components: usize) -> usize {
    1 + 3 * components + 3 * modes
}

impl ModalScenes {
    /// The place of a number of a row among the vectors of `tiles`.
    #[inline(always)]
    pub(super) fn place(row: usize, number: usize, width: usize) -> usize {
        (row / TILE * width + number) * TILE + row % TILE
    }
}

/// Computes the [`ModalScenes`] of one scene per lane.
pub(super) struct ModalSetup<'a> {
    pub scenes: &'a [&'a Instance],
    /// Their bodies with payloads and, after a change, with those payloads that they keep.
    pub bodies: &'a [Body],
    pub kept: Option<&'a [Body]>,
    /// Deviations of the motion of each scene, if they are drawn.
    pub deviations: Option<Deviations<'a>>,
    /// Whether another window follows.
    pub continues: bool,
    pub request: &'a ModalRequest<'a>,
    pub to: &'a mut ModalScenes,
}

impl ModalSetup<'_> {
    #[inline(always)]
    pub(super) fn compute<S: Simd>(&mut self, simd: S) {
        let &mut Self { scenes, bodies, kept, deviations, continues, request, ref mut to } = self;
        let undamped = Undamped::new(simd, scenes, bodies, request);
        let damped = Damped::new(simd, &undamped, request.duration);
        let (n, count) = (undamped.n, undamped.influence.len());
        let eigenvalues = to.eigenvalues.clear::<S>(2 * n).as_chunks_mut::<2>().0;
        for (to, value) in eigenvalues.iter_mut().zip(damped.eigenvalues) {
            *to = value.lanes();
        }
        let drives = to.drive.clear::<S>(count * 2 * n).as_chunks_mut::<2>().0;
        damped.set_drives(simd, &undamped, drives);
        to.start.clear::<S>(2 * n);
        if let Some(kept) = kept {
            let kept = mass_matrix(simd, kept);
            set_modal_state(simd, &undamped, &damped, &request.dofs, &kept, [&mut to.state, &mut to.start]);
        }
        if continues {
            set_state_rows(simd, &undamped, &damped, &mut to.state_rows);
        }

        let width = width(n, count);
        to.rows = request.rows.len();
        let tiles = to.tiles.clear::<S>(to.rows.next_multiple_of(TILE) * width).as_chunks_mut::<TILE>().0;
        let starts = to.starts.clear::<S>(to.rows);
        let mut first: Vec<Real<S>> = request.first.iter().map(|&value| Real::splat(simd, value)).collect();
        if let (Some(deviations), Some(first)) = (deviations, first.first_mut()) {
            *first = *first + deviations.at(simd, 0);
        }
        let mut feeds = vec![undamped.zero; count];
        let mut size = undamped.zero;
        for (index, row) in request.rows.iter().enumerate() {
            let (tile, place) = (&mut tiles[index / TILE * width..][..width], index % TILE);
            let of = undamped.row(simd, scenes, request, *row, &mut feeds);
            tile[0][place] = of.constant.lanes;
            let start = first_value(&of.constant, &feeds, &first);
            starts[index] = start.lanes;
            size = size + start.abs();
            let (head, bounds) = tile.split_at_mut(1 + count + 2 * n);
            let mut kinks = [undamped.zero; 9];
            for (feed, to) in feeds.iter().zip(&mut *bounds) {
                to[place] = feed.abs().lanes;
            }
            for k in 0..n {
                let c = damped.coefficient(simd, &of, k, n);
                for ((feed, kink), drive) in feeds.iter_mut().zip(&mut kinks).zip(drives.chunks_exact(n)) {
                    let still = c * Complex::of(simd, drive[k]);
                    *feed = *feed - (still.re + still.re);
                    let rate = still * damped.eigenvalues[k];
                    *kink = *kink + (rate.re + rate.re);
                }
                size = size + c.re.abs() + c.im.abs();
                let coefficients = &mut head[1 + count + 2 * k..];
                (coefficients[0][place], coefficients[1][place]) =
                    ((c.re + c.re).lanes, (-(c.im + c.im)).lanes);
                let modulus = c.norm_squared().sqrt();
                bounds[count + k][place] = (modulus + modulus).lanes;
            }
            for (kink, to) in kinks.iter().zip(&mut bounds[count + n..]) {
                to[place] = kink.abs().lanes;
            }
            if request.quasi_static {
                starts[index] = first_value(&of.constant, &feeds, &first).lanes;
            }
            for (feed, to) in feeds.iter().zip(&mut head[1..]) {
                to[place] = feed.lanes;
                size = size + feed.abs();
            }
        }
        let accurate =
            undamped.accurate.and(damped.accurate).and(size.less_than(size.constant(MAX_ROW_SIZE)));
        let before = match kept {
            Some(_) => Real::new(simd, to.accurate.vectors::<S>()[0]),
            None => Real::splat(simd, 1.0),
        };
        to.accurate.clear::<S>(1)[0] = accurate.select(before, undamped.zero).lanes;
    }
}

/// A row under the first values of the excitation.
#[inline(always)]
fn first_value<S: Simd>(constant: &Real<S>, feeds: &[Real<S>], first: &[Real<S>]) -> Real<S> {
    let mut start = *constant;
    for (feed, &value) in feeds.iter().zip(first) {
        start = feed.mul_add(value, start);
    }
    start
}
