//! Static equilibrium of a body on links of any laws.
//!
//! The energy `U(y) = Σ E(c·y) - w·y` of elastic links under a weight is convex, and the body rests at its minimum. In the coordinates y
//! the nominal stiffness is the identity, so `ε |y|² / 2` are centring springs in all links, ε times as stiff as the links. They make the
//! minimum unique where the body is free within its clearance, and fade away: of all positions of rest remains the one of least `|y|`.

#[cfg(test)]
mod tests;

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use crate::model::Law;

/// A position of rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Equilibrium {
    /// y, √J.
    pub position: [f64; 6],
    /// Unit directions y, orthogonal to each other, which no link resists at rest.
    pub loose: [[f64; 6]; 6],
    /// How many of `loose` there are.
    pub loose_count: usize,
}

/// Stiffness of the centring springs as they fade: the last is where its rounding and its own displacement weigh the same.
const CENTRING: [f64; 4] = [1e-2, 1e-4, 1e-6, 1e-8];

/// A stiffness below this part of the nominal or the largest one is none, and a force below this part of all forces is none: rounding
/// leaves 1e-15.
pub(crate) const NEGLIGIBLE: f64 = 1e-12;

/// A residual that is hardly more than rounding.
const ROUNDING: f64 = 1e-14;

/// An edge is passed when the deflection is beyond it by more than this part: roundings of what a soft direction has let go. The true
/// force decides on the balance.
const AT_EDGE: f64 = 1e-11;

/// Newton steps at each stiffness of the centring springs: a handful does, a scene of a hundred edges may need some dozen.
const MAX_STEPS: usize = 100;

/// The position of rest of least `|y|` under `weight`, of the `springs` (law, c) with the deflection `c·y`, over the first `count` entries.
///
/// # Errors
/// The direction of y, of length 1, in which the body leaves: nothing resists it, or nothing enough. Zeros for numbers beyond their range.
pub(crate) fn equilibrium<'a>(
    springs: impl Iterator<Item = (&'a Law, [f64; 6])> + Clone,
    weight: &[f64; 6],
    count: usize,
) -> Result<Equilibrium, [f64; 6]> {
    let within = |v: &[f64; 6]| Vector6::from_fn(|i, _| if i < count { v[i] } else { 0.0 });
    let statics =
        Statics { springs: springs.map(|(law, c)| (law, within(&c))), weight: within(weight), count };
    // The position of linear links of nominal stiffness.
    let mut y = statics.weight;
    for centring in CENTRING {
        y = statics.settle(y, centring, MAX_STEPS)?;
    }
    for _ in 0..MAX_STEPS {
        if let Some(found) = statics.polish(&y, true).or_else(|| statics.polish(&y, false)) {
            return Ok(found);
        }
        // The centring springs hid an edge.
        y = statics.settle(y, 0.0, 1)?;
    }
    // No scene is known that comes here: where the body is pulled still.
    Err(unit(&statics.pull(&y, 0.0).force).into())
}

struct Statics<I> {
    springs: I,
    weight: Vector6<f64>,
    count: usize,
}

/// Force and the size of its terms.
struct Residual {
    force: Vector6<f64>,
    size: f64,
}

impl Residual {
    /// Smallest where nothing but roundings is left.
    fn relative(&self) -> f64 {
        if self.size > 0.0 { self.force.norm() / self.size } else { 0.0 }
    }
}

/// Stiffnesses and directions.
type Modes = SymmetricEigen<f64, nalgebra::U6>;

impl<'a, I: Iterator<Item = (&'a Law, Vector6<f64>)> + Clone> Statics<I> {
    /// What pulls the body on from y: the weight that the links and centring springs do not carry there.
    fn pull(&self, y: &Vector6<f64>, centring: f64) -> Residual {
        let mut force = self.weight - y * centring;
        let mut size = self.weight.norm() + centring * y.norm();
        for (law, c) in self.springs.clone() {
            let d = c.dot(y);
            let load = law.force(d);
            force -= c * load;
            size += (load.abs() + law.tangent(d) * c.abs().dot(&y.abs())) * c.norm();
        }
        Residual { force, size }
    }

    /// Tangent stiffness at y, the segments of piecewise linear laws being those of `reference`; none if it is out of range.
    fn stiffness(&self, y: &Vector6<f64>, reference: &Vector6<f64>, centring: f64) -> Option<Modes> {
        let mut sum = Matrix6::zeros();
        for (law, c) in self.springs.clone() {
            let at = if law.is_piecewise_linear() { reference } else { y };
            sum += c * c.transpose() * law.tangent(c.dot(at));
        }
        for i in 0..6 {
            sum[(i, i)] += if i < self.count { centring } else { 1.0 };
        }
        SymmetricEigen::try_new(sum, f64::EPSILON, 1000)
    }

    /// At most `steps` Newton steps towards the minimum of the energy with centring springs.
    fn settle(&self, mut y: Vector6<f64>, centring: f64, steps: usize) -> Result<Vector6<f64>, [f64; 6]> {
        let mut pull = self.pull(&y, centring);
        for _ in 0..steps {
            if pull.relative() <= f64::EPSILON {
                break;
            }
            let modes = self.stiffness(&y, &y, centring).ok_or([0.0; 6])?;
            let (resisted, free) = split(&modes, &pull.force);
            let step = if free.norm() > NEGLIGIBLE * pull.size {
                self.reach(&y, &free, centring)?
            } else {
                resisted
            };
            let next = y + step * self.part(&y, &step, &pull, centring);
            let left = self.pull(&next, centring);
            let rounding = left.relative() <= ROUNDING && left.relative() >= 0.5 * pull.relative();
            if next == y {
                break;
            }
            (y, pull) = (next, left);
            if rounding {
                break;
            }
        }
        Ok(y)
    }

    /// Lengthens a step in a direction that nothing resists at y until something does.
    fn reach(&self, y: &Vector6<f64>, free: &Vector6<f64>, centring: f64) -> Result<Vector6<f64>, [f64; 6]> {
        let direction = unit(free);
        let mut length = y.norm() + free.norm();
        for _ in 0..60 {
            if self.pull(&(y + direction * length), centring).force.dot(&direction) <= 0.0 {
                return Ok(direction * length);
            }
            length *= 2.0;
        }
        Err(direction.into())
    }

    /// How much of a step to go: all of it unless it leads beyond the minimum along it, else to shortly before that.
    fn part(&self, y: &Vector6<f64>, step: &Vector6<f64>, pull: &Residual, centring: f64) -> f64 {
        let whole = self.pull(&(y + step), centring);
        let first = pull.force.dot(step);
        if whole.force.dot(step) >= 0.0 || whole.force.norm() <= 0.5 * pull.force.norm() {
            return 1.0;
        }
        // The energy is convex, so what pulls along the step only falls.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let along = self.pull(&(y + step * middle), centring).force.dot(step);
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

    /// Balance to rounding, without centring springs, from a position y of which the segments are the right ones; none if they are not.
    /// `nearest`: of all positions with these loads the one of least `|y|`, which may lie beyond an edge by what the springs were worth.
    fn polish(&self, reference: &Vector6<f64>, nearest: bool) -> Option<Equilibrium> {
        let mut y = *reference;
        let (mut best, mut least) = (y, f64::INFINITY);
        for _ in 0..MAX_STEPS {
            let modes = self.stiffness(&y, reference, 0.0)?;
            let (step, _) = split(&modes, &self.pull(&y, 0.0).force);
            for direction in loose(&modes).filter(|_| nearest) {
                y -= direction * direction.dot(&y);
            }
            y += step;
            if !self.same_segments(&y, reference) {
                break;
            }
            let left = self.pull(&y, 0.0).relative();
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

    /// Whether all links are at y in the segments in which they are at `reference`, or at their edges.
    fn same_segments(&self, y: &Vector6<f64>, reference: &Vector6<f64>) -> bool {
        let size = y.norm();
        self.springs.clone().filter(|(law, _)| law.is_piecewise_linear()).all(|(law, c)| {
            let (edges, d) = (law.edges(), c.dot(y));
            let segment = law.segment_of(c.dot(reference));
            let beyond = AT_EDGE * (d.abs() + c.norm() * size);
            let above = segment == 0 || d >= edges[segment - 1] - beyond;
            above && (segment == edges.len() || d <= edges[segment] + beyond)
        })
    }
}

/// A stiffness up to this counts as none. Those of the entries past the count are 1, as the nominal one is.
fn threshold(modes: &Modes) -> f64 {
    NEGLIGIBLE * f64::max(modes.eigenvalues.max(), 1.0)
}

/// Directions without stiffness.
fn loose(modes: &Modes) -> impl Iterator<Item = Vector6<f64>> {
    (0..6)
        .filter(|&i| modes.eigenvalues[i] <= threshold(modes))
        .map(|i| modes.eigenvectors.column(i).into_owned())
}

/// The step that a force makes where there is stiffness, and the force where there is none.
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

/// The vector of length 1 in the direction of `v`; zero for none.
fn unit(v: &Vector6<f64>) -> Vector6<f64> {
    let length = v.norm();
    if length > 0.0 && length.is_finite() { v / length } else { Vector6::zeros() }
}
