//! Static equilibrium on links of any laws.
//!
//! The energy `U(y) = Σ E(c·y - e) - w·y` of elastic links under a weight is convex, and its minimum is the position of rest. In the
//! coordinates y the nominal stiffness is the identity, and linear links without weight rest at y = 0, so `ε |y|² / 2` is the energy of centring springs parallel to all links, ε times as
//! stiff as the links. They make the minimum unique where the body is free within its clearance. As ε falls to zero the minimum tends to
//! the position of rest with the least `|y|`.

#[cfg(test)]
mod tests;

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use crate::model::Law;

/// A position of rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Equilibrium {
    /// y, √J.
    pub position: [f64; 6],
    /// Orthonormal directions y that no link resists at rest.
    pub loose: [[f64; 6]; 6],
    /// Number of directions in `loose`.
    pub loose_count: usize,
}

/// Relative stiffness ε of the centring springs, stage by stage. At the last stage rounding and the springs displace the body by the same
/// order.
const CENTRING: [f64; 4] = [1e-2, 1e-4, 1e-6, 1e-8];

/// A stiffness below this fraction of the nominal or the largest one, or a force below this fraction of all forces, counts as zero.
/// Rounding errors are about 1e-15.
pub(crate) const NEGLIGIBLE: f64 = 1e-12;

/// Relative residual at which the equilibrium is exact up to rounding.
const EXACT_RESIDUAL: f64 = 1e-14;

/// Relative deflection beyond its edge up to which a link still counts as at the edge: rounding of deflections along soft directions.
/// The balance uses the true force.
const AT_EDGE: f64 = 1e-11;

/// Largest force out of balance as a fraction of the weight. Rounding of the deflections is less than this even where links bear the
/// weight a billion times as softly as others would.
const OUT_OF_BALANCE: f64 = 1e-6;

/// Deflection of a link, as a fraction of its largest one in a motion of the same length, up to which the motion does not move it.
/// Rounding of a direction is about 1e-15. A link that resists by less bears the weight 1e18 times as softly as its nominal stiffness.
const UNMOVED: f64 = 1e-9;

/// Largest number of Newton steps at each stiffness of the centring springs. Most scenes need a handful, one with a hundred edges some
/// dozens.
const MAX_STEPS: usize = 100;

/// The position of rest with the least `|y|` under `weight`, on `springs` (law, c, e) with the deflection `c·y - e`, over the first `count`
/// entries.
///
/// # Errors
/// The unit direction y in which the body leaves its links, because they do not resist enough. Zeros if numbers overflow.
pub(crate) fn equilibrium<'a>(
    springs: impl Iterator<Item = (&'a Law, [f64; 6], f64)> + Clone,
    weight: &[f64; 6],
    count: usize,
) -> Result<Equilibrium, [f64; 6]> {
    let within = |v: &[f64; 6]| Vector6::from_fn(|i, _| if i < count { v[i] } else { 0.0 });
    let statics =
        Statics { springs: springs.map(|(law, c, e)| (law, within(&c), e)), weight: within(weight), count };
    // Start: the position on linear links of nominal stiffness.
    let mut y = statics.weight;
    for centring in CENTRING {
        y = statics.minimise(y, centring, MAX_STEPS)?;
    }
    for _ in 0..MAX_STEPS {
        if let Some(found) = statics.refine(&y, true).or_else(|| statics.refine(&y, false)) {
            return if statics.holds(&found.position.into()) { Ok(found) } else { Err(unit(&y).into()) };
        }
        // The centring springs have hidden an edge.
        y = statics.minimise(y, 0.0, 1)?;
    }
    // No known scene leads here. The error is the direction of the remaining force.
    Err(unit(&statics.residual(&y, 0.0).force).into())
}

struct Statics<I> {
    springs: I,
    weight: Vector6<f64>,
    count: usize,
}

/// Force out of balance, and the size of the terms that it is a sum of.
struct Residual {
    force: Vector6<f64>,
    size: f64,
}

impl Residual {
    /// Force over the size of its terms; about 1e-15 in equilibrium.
    fn relative(&self) -> f64 {
        if self.size > 0.0 { self.force.norm() / self.size } else { 0.0 }
    }
}

/// Principal stiffnesses and directions.
type Modes = SymmetricEigen<f64, nalgebra::U6>;

impl<'a, I: Iterator<Item = (&'a Law, Vector6<f64>, f64)> + Clone> Statics<I> {
    /// Force out of balance at y: the weight less what links and centring springs carry.
    fn residual(&self, y: &Vector6<f64>, centring: f64) -> Residual {
        let mut force = self.weight - y * centring;
        let mut size = self.weight.norm() + centring * y.norm();
        for (law, c, e) in self.springs.clone() {
            let d = c.dot(y) - e;
            let load = law.force(d);
            force -= c * load;
            size += (load.abs() + law.tangent(d) * (c.abs().dot(&y.abs()) + e.abs())) * c.norm();
        }
        Residual { force, size }
    }

    /// Whether y is an equilibrium beyond doubt: the loads balance the weight, not only up to rounding of deflections that may be huge; and
    /// it is stable: farther along y the links bear more than the weight. (No law falls, so a position of balance is stable against all
    /// else.)
    fn holds(&self, y: &Vector6<f64>) -> bool {
        let (direction, mut loads) = (unit(y), 0.0);
        let (mut pull, mut resists) = (self.weight.dot(&direction), false);
        for (law, c, e) in self.springs.clone() {
            loads += law.force(c.dot(y) - e).abs() * c.norm();
            let along = c.dot(&direction);
            if along.abs() > UNMOVED * c.norm() {
                let last = if along > 0.0 { law.edges().len() } else { 0 };
                let (load, stiffness) = law.segment(last);
                pull -= along * load;
                resists |= stiffness > 0.0;
            }
        }
        let weight = self.weight.norm();
        let balances = self.residual(y, 0.0).force.norm() <= OUT_OF_BALANCE * weight + NEGLIGIBLE * loads;
        balances && (resists || pull <= OUT_OF_BALANCE * weight + NEGLIGIBLE * loads)
    }

    /// Tangent stiffness at y, with piecewise linear laws on their segments at `reference`; none if it is out of range.
    fn stiffness(&self, y: &Vector6<f64>, reference: &Vector6<f64>, centring: f64) -> Option<Modes> {
        let mut sum = Matrix6::zeros();
        for (law, c, e) in self.springs.clone() {
            let at = if law.is_piecewise_linear() { reference } else { y };
            sum += c * c.transpose() * law.tangent(c.dot(at) - e);
        }
        for i in 0..6 {
            sum[(i, i)] += if i < self.count { centring } else { 1.0 };
        }
        SymmetricEigen::try_new(sum, f64::EPSILON, 1000)
    }

    /// At most `steps` Newton steps towards the minimum of the energy with centring springs.
    fn minimise(&self, mut y: Vector6<f64>, centring: f64, steps: usize) -> Result<Vector6<f64>, [f64; 6]> {
        let mut residual = self.residual(&y, centring);
        for _ in 0..steps {
            if residual.relative() <= f64::EPSILON {
                break;
            }
            let modes = self.stiffness(&y, &y, centring).ok_or([0.0; 6])?;
            let (resisted, free) = split(&modes, &residual.force);
            let step = if free.norm() > NEGLIGIBLE * residual.size {
                self.extend(&y, &free, centring)?
            } else {
                resisted
            };
            let next = y + step * self.step_fraction(&y, &step, &residual, centring);
            let left = self.residual(&next, centring);
            let rounding = left.relative() <= EXACT_RESIDUAL && left.relative() >= 0.5 * residual.relative();
            if next == y {
                break;
            }
            (y, residual) = (next, left);
            if rounding {
                break;
            }
        }
        Ok(y)
    }

    /// Extends a step along a direction without stiffness until a link resists.
    fn extend(&self, y: &Vector6<f64>, free: &Vector6<f64>, centring: f64) -> Result<Vector6<f64>, [f64; 6]> {
        let direction = unit(free);
        let mut length = y.norm() + free.norm();
        for _ in 0..60 {
            if self.residual(&(y + direction * length), centring).force.dot(&direction) <= 0.0 {
                return Ok(direction * length);
            }
            length *= 2.0;
        }
        Err(direction.into())
    }

    /// Fraction of a Newton step to take: 1, or if the energy has a minimum within the step, a point shortly before that minimum.
    fn step_fraction(
        &self,
        y: &Vector6<f64>,
        step: &Vector6<f64>,
        residual: &Residual,
        centring: f64,
    ) -> f64 {
        let whole = self.residual(&(y + step), centring);
        let first = residual.force.dot(step);
        if whole.force.dot(step) >= 0.0 || whole.force.norm() <= 0.5 * residual.force.norm() {
            return 1.0;
        }
        // The energy is convex, so the force along the step decreases.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let along = self.residual(&(y + step * middle), centring).force.dot(step);
            if along >= 0.0 {
                low = middle;
                if along <= 0.1 * first {
                    break;
                }
            } else {
                high = middle;
            }
        }
        low
    }

    /// Newton steps without centring springs, converged to rounding, on the segments at `reference`; none if these are the wrong segments.
    /// `nearest`: return the position with the least `|y|` of all that have the same loads; it may lie beyond an edge by the displacement of
    /// the centring springs.
    fn refine(&self, reference: &Vector6<f64>, nearest: bool) -> Option<Equilibrium> {
        let mut y = *reference;
        let (mut best, mut least) = (y, f64::INFINITY);
        for _ in 0..MAX_STEPS {
            let modes = self.stiffness(&y, reference, 0.0)?;
            let (step, _) = split(&modes, &self.residual(&y, 0.0).force);
            for direction in loose(&modes).filter(|_| nearest) {
                y -= direction * direction.dot(&y);
            }
            y += step;
            if !self.same_segments(&y, reference) {
                break;
            }
            let left = self.residual(&y, 0.0).relative();
            let slow = left > 0.5 * least;
            if left < least {
                (best, least) = (y, left);
            }
            if slow {
                break;
            }
        }
        if least > NEGLIGIBLE {
            return None;
        }
        let modes = self.stiffness(&best, reference, 0.0)?;
        let mut rest = Equilibrium { position: best.into(), loose: [[0.0; 6]; 6], loose_count: 0 };
        for direction in loose(&modes) {
            rest.loose[rest.loose_count] = direction.into();
            rest.loose_count += 1;
        }
        Some(rest)
    }

    /// Whether all links at y are on their segments of `reference`, or at the edges of these.
    fn same_segments(&self, y: &Vector6<f64>, reference: &Vector6<f64>) -> bool {
        let size = y.norm();
        self.springs.clone().filter(|(law, ..)| law.is_piecewise_linear()).all(|(law, c, e)| {
            let (edges, d) = (law.edges(), c.dot(y) - e);
            let segment = law.segment_of(c.dot(reference) - e);
            let beyond = AT_EDGE * (d.abs() + c.norm() * size);
            let above = segment == 0 || d >= edges[segment - 1] - beyond;
            above && (segment == edges.len() || d <= edges[segment] + beyond)
        })
    }
}

/// Stiffness up to which a direction counts as free. Entries past the count have the stiffness 1, as the nominal one is.
fn threshold(modes: &Modes) -> f64 {
    NEGLIGIBLE * f64::max(modes.eigenvalues.max(), 1.0)
}

/// Directions without stiffness.
fn loose(modes: &Modes) -> impl Iterator<Item = Vector6<f64>> {
    (0..6)
        .filter(|&i| modes.eigenvalues[i] <= threshold(modes))
        .map(|i| modes.eigenvectors.column(i).into_owned())
}

/// The Newton step where there is stiffness, and the force where there is none.
fn split(modes: &Modes, force: &Vector6<f64>) -> (Vector6<f64>, Vector6<f64>) {
    let (mut step, mut free) = (Vector6::zeros(), Vector6::zeros());
    for (direction, &stiffness) in modes.eigenvectors.column_iter().zip(&modes.eigenvalues) {
        let along = direction.dot(force);
        if stiffness > threshold(modes) {
            step += direction * (along / stiffness);
        } else {
            free += direction * along;
        }
    }
    (step, free)
}

/// The unit vector along `v`; zero for a zero vector.
fn unit(v: &Vector6<f64>) -> Vector6<f64> {
    let length = v.norm();
    if length > 0.0 && length.is_finite() { v / length } else { Vector6::zeros() }
}
