//! A tabulated law, linear between its points.

use crate::error::SceneError;

/// Largest number of points of a curve.
pub const MAX_CURVE_POINTS: usize = 16;

/// Relative change of slope below which three points lie on a line: rounding of the table.
const STRAIGHT: f64 = 1e-12;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Curve {
    /// Number of edges.
    count: usize,
    /// Inner points at which the slope changes, m and N.
    edge: [f64; MAX_CURVE_POINTS - 2],
    load: [f64; MAX_CURVE_POINTS - 2],
    /// Slope of each segment, one more than edges, N/m.
    stiffness: [f64; MAX_CURVE_POINTS - 1],
    /// Index of the segment that contains δ = 0, and the force there, N.
    origin: usize,
    load_at_zero: f64,
}

impl Curve {
    pub(super) fn new(points: &[[f64; 2]]) -> Result<Self, SceneError> {
        if !(2..=MAX_CURVE_POINTS).contains(&points.len()) {
            return Err(SceneError::CurvePoints { max: MAX_CURVE_POINTS, got: points.len() });
        }
        if !points.as_flattened().iter().all(|x| x.is_finite()) {
            return Err(SceneError::NotFinite { field: "curve" });
        }
        for (before, pair) in points.windows(2).enumerate() {
            let ([d, load], [next_d, next_load], index) = (pair[0], pair[1], before + 1);
            if d >= next_d {
                return Err(SceneError::CurveOrder { index, before: d, got: next_d });
            }
            if load > next_load {
                return Err(SceneError::CurveFalls { index, before: load, got: next_load });
            }
        }
        let (first, last) = (points[0], points[points.len() - 1]);
        if first[1] == last[1] {
            return Err(SceneError::CurveFlat { load: first[1] });
        }
        let mut curve = Self {
            count: 0,
            edge: [0.0; MAX_CURVE_POINTS - 2],
            load: [0.0; MAX_CURVE_POINTS - 2],
            stiffness: [0.0; MAX_CURVE_POINTS - 1],
            origin: 0,
            load_at_zero: 0.0,
        };
        let mut corner = first;
        for pair in points[1..].windows(2) {
            let (before, after) = (slope(corner, pair[0]), slope(pair[0], pair[1]));
            if (after - before).abs() <= STRAIGHT * f64::max(before, after) {
                continue;
            }
            [curve.edge[curve.count], curve.load[curve.count]] = pair[0];
            curve.stiffness[curve.count] = before;
            curve.count += 1;
            corner = pair[0];
        }
        curve.stiffness[curve.count] = slope(corner, last);
        curve.origin = curve.edges().iter().filter(|&&edge| edge <= 0.0).count();
        let ends = |index: usize| [curve.edge[index], curve.load[index]];
        let [a, b] = [
            if curve.origin == 0 { first } else { ends(curve.origin - 1) },
            if curve.origin == curve.count { last } else { ends(curve.origin) },
        ];
        curve.load_at_zero = if curve.stiffness[curve.origin] == 0.0 {
            a[1]
        } else if b[0] - a[0] < f64::MAX {
            // One symmetric expression, so that an odd curve gives exactly zero.
            a[1] * (b[0] / (b[0] - a[0])) - b[1] * (a[0] / (b[0] - a[0]))
        } else {
            f64::INFINITY
        };
        let all = [curve.nominal(), curve.load_at_zero];
        if !all.iter().all(|x| x.is_finite()) || curve.nominal() == 0.0 {
            return Err(SceneError::OutOfRange { what: "curve: its slope" });
        }
        Ok(curve)
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            load: self.load.map(|x| x * factor),
            stiffness: self.stiffness.map(|x| x * factor),
            load_at_zero: self.load_at_zero * factor,
            ..*self
        }
    }

    /// Force at zero and stiffness, if the curve has no edges.
    pub(super) fn straight(&self) -> Option<(f64, f64)> {
        (self.count == 0).then_some((self.load_at_zero, self.stiffness[0]))
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn nominal(&self) -> f64 {
        self.stiffness.iter().fold(0.0, |most, &k| f64::max(most, k))
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn edges(&self) -> &[f64] {
        &self.edge[..self.count]
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn segment_of(&self, d: f64) -> usize {
        let mut segment = 0;
        for &edge in self.edges() {
            segment += usize::from(edge <= d);
        }
        segment
    }

    /// The point of a segment nearest to δ = 0.
    #[cfg_attr(feature = "std", inline(always))]
    fn anchor(&self, segment: usize) -> (f64, f64) {
        if segment == self.origin {
            (0.0, self.load_at_zero)
        } else {
            let nearer = if segment > self.origin { segment - 1 } else { segment };
            (self.edge[nearer], self.load[nearer])
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn force(&self, d: f64) -> f64 {
        let segment = self.segment_of(d);
        let (at, load) = self.anchor(segment);
        load + self.stiffness[segment] * (d - at)
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn segment(&self, index: usize) -> (f64, f64) {
        let index = usize::min(index, self.count);
        let ((at, load), stiffness) = (self.anchor(index), self.stiffness[index]);
        (load - stiffness * at, stiffness)
    }

    /// Integral from 0 to `d`: trapezia segment by segment.
    pub(super) fn energy(&self, d: f64) -> f64 {
        let (last, mut energy) = (self.segment_of(d), 0.0);
        let mut segment = self.origin;
        loop {
            let ((at, load), stiffness) = (self.anchor(segment), self.stiffness[segment]);
            let end = match segment {
                _ if segment == last => d,
                _ if segment < last => self.edge[segment],
                _ => self.edge[segment - 1],
            };
            energy += (end - at) * (load + 0.5 * stiffness * (end - at));
            match segment {
                _ if segment == last => return energy,
                _ if segment < last => segment += 1,
                _ => segment -= 1,
            }
        }
    }
}

fn slope([d, load]: [f64; 2], [next_d, next_load]: [f64; 2]) -> f64 {
    (next_load - load) / (next_d - d)
}
