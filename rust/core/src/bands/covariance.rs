//! Exact covariance of the deviations of the motion and of the machine's state.

use super::schedule::{Event, Response};
use crate::equations::three_sums;
use crate::numeric::float::add_scaled;
use crate::smoother::{MAX_ORDER, MarkovStep, Square};

/// Covariances within the interval between two samples: of a, the acceleration at its start, d, the state of the motion at its end, and
/// z, the state of the machine at the present time.
#[derive(Debug, Clone)]
pub(super) struct Covariance {
    order: usize,
    derivative: usize,
    /// m/s² per unit of d[derivative].
    unit: f64,
    a: f64,
    d: Square,
    a_d: [f64; MAX_ORDER],
    a_z: [f64; 12],
    d_z: [[f64; 12]; MAX_ORDER],
    pub z: [[f64; 12]; 12],
    /// z at the first sample per m/s² of its acceleration, until that sample.
    start: Option<[f64; 12]>,
}

impl Covariance {
    pub fn new(order: usize, derivative: usize, start: [f64; 12]) -> Self {
        Self {
            order,
            derivative,
            unit: 0.0,
            a: 0.0,
            d: [[0.0; MAX_ORDER]; MAX_ORDER],
            a_d: [0.0; MAX_ORDER],
            a_z: [0.0; 12],
            d_z: [[0.0; 12]; MAX_ORDER],
            z: [[0.0; 12]; 12],
            start: Some(start),
        }
    }

    /// Advances by one event.
    #[inline(always)]
    pub fn follow(&mut self, step: &Event) {
        match step {
            Event::Sample { step, unit } => self.begin(step, *unit),
            Event::Part { response, from, to } => self.advance(response, *from, *to),
            Event::Instant { .. } => {}
        }
    }

    /// Variance of the acceleration at a fraction of the interval, (m/s²)².
    #[inline(always)]
    pub fn acceleration(&self, at: f64) -> f64 {
        let rest = 1.0 - at;
        let (across, after) = self.end();
        rest * rest * self.a + 2.0 * at * rest * across + at * at * after
    }

    /// Covariance of the accelerations at both ends of the interval, and variance of the one at its end.
    #[inline(always)]
    fn end(&self) -> (f64, f64) {
        let at = self.derivative;
        (self.unit * self.a_d[at], self.unit * self.unit * self.d[at][at])
    }

    /// Begins the interval to the next sample.
    #[inline(always)]
    fn begin(&mut self, step: &MarkovStep, unit: f64) {
        let (order, at) = (self.order, self.derivative);
        (_, self.a) = self.end();
        self.a_z = self.d_z[at].map(|x| self.unit * x);
        for i in 0..order {
            let carried: f64 = (0..order).map(|j| step.transition[i][j] * self.d[j][at]).sum();
            self.a_d[i] = self.unit * carried;
        }
        self.d = step.covariance(&self.d);
        let across = self.d_z;
        for i in 0..order {
            self.d_z[i] = [0.0; 12];
            for j in 0..order {
                add_scaled(&mut self.d_z[i], &across[j], step.transition[i][j]);
            }
        }
        self.unit = unit;
        if let Some(start) = self.start.take() {
            let (_, variance) = self.end();
            for i in 0..order {
                self.d_z[i] = start.map(|z| unit * self.d[i][at] * z);
            }
            self.z = start.map(|column| start.map(|row| variance * column * row));
        }
    }

    /// z' = transition z + g a + h unit d[derivative].
    #[inline(always)]
    fn advance(&mut self, response: &Response, from: f64, to: f64) {
        let at = self.derivative;
        let (mut g, mut h) = ([0.0; 12], [0.0; 12]);
        for i in 0..12 {
            g[i] = (1.0 - from) * response.start[i] + (1.0 - to) * response.end[i];
            h[i] = from * response.start[i] + to * response.end[i];
        }
        let (across, after) = self.end();
        let carried = three_sums([[0.0; 12]; 3], &response.transition, &self.a_z);
        let mut by_g = carried;
        self.a_z = carried;
        for i in 0..12 {
            by_g[i] += 0.5 * self.a * g[i] + across * h[i];
            self.a_z[i] += self.a * g[i] + across * h[i];
        }
        let mut by_h = [0.0; 12];
        for d in 0..self.order {
            let mut carried = three_sums([[0.0; 12]; 3], &response.transition, &self.d_z[d]);
            if d == at {
                by_h = carried.map(|x| self.unit * x);
                add_scaled(&mut by_h, &h, 0.5 * after);
            }
            add_scaled(&mut carried, &g, self.a_d[d]);
            add_scaled(&mut carried, &h, self.unit * self.d[d][at]);
            self.d_z[d] = carried;
        }
        let mut half = [[0.0; 12]; 12];
        for j in 0..12 {
            half[j] = three_sums([[0.0; 12]; 3], &response.transition, &self.z[j]);
        }
        // half transition^T: column j is the sum over i of column i of half times transition[i][j].
        for j in 0..12 {
            let mut column = [0.0; 12];
            for i in 0..12 {
                add_scaled(&mut column, &half[i], response.transition[i][j]);
            }
            add_scaled(&mut column, &g, by_g[j]);
            add_scaled(&mut column, &by_g, g[j]);
            add_scaled(&mut column, &h, by_h[j]);
            add_scaled(&mut column, &by_h, h[j]);
            self.z[j] = column;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Watch;
    use crate::bands::schedule::{Deviation, Schedule};
    use crate::smoother::{Posterior, PosteriorInput, ProcessNoise};
    use crate::yardstick::{cart_links, cart_on};

    /// An interval in one piece and in three: z, and the acceleration at the end, are the same.
    #[test]
    fn instants_between_samples_change_nothing() {
        let system = cart_on(&cart_links(1e5));
        let (step, variance, segment) = ([1.0; 9], [1.0; 10], [0; 9]);
        let mut covariance = [0.0; 9];
        (covariance[0], covariance[4], covariance[8]) = (3.0, 3.0, 3.0);
        let given = PosteriorInput {
            step: &step,
            variance: &variance,
            covariance: &covariance,
            noise: ProcessNoise { segment: &segment, density: &[0.7], oscillator: None },
            watch: Watch::NEVER,
        };
        let posterior = Posterior::new(3, given).expect("memory").expect("order 3");
        let time: [f64; 10] = core::array::from_fn(|k| 0.004 * k as f64);
        let unit: [f64; 10] = core::array::from_fn(|k| 1.0 + 0.1 * k as f64);
        let deviation =
            Deviation { posterior: &posterior, time: &time, derivative: 2, unit: &unit, quasi_static: true };
        let mut cut: Vec<f64> = time.to_vec();
        cut.extend(time[..9].iter().flat_map(|t| [t + 0.0011, t + 0.0029]));
        cut.sort_by(f64::total_cmp);
        let follow = |instants: &[f64]| {
            let mut covariance = Covariance::new(3, 2, deviation.start(&system));
            for step in Schedule::new(&system, deviation, instants) {
                covariance.follow(&step);
            }
            covariance
        };
        let (whole, parts) = (follow(&time), follow(&cut));
        let size = whole.z.as_flattened().iter().fold(0.0, |size, x| f64::max(size, x.abs()));
        assert!(size > 0.0);
        for (a, b) in whole.z.as_flattened().iter().zip(parts.z.as_flattened()) {
            assert!((a - b).abs() < 1e-12 * size, "{a} {b}");
        }
        assert_eq!(whole.acceleration(1.0), parts.acceleration(1.0));
        assert!((whole.acceleration(0.0) / whole.a - 1.0).abs() < 1e-15);
    }
}
