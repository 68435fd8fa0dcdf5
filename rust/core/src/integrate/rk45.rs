//! Dormand-Prince 5(4): explicit, for scenes that are not stiff.

use super::method::Method;
use super::tableau::DORMAND_PRINCE;
use crate::equations::{Equations, StageData};
use crate::excitation::{Instant, Ramp, Values};
use crate::numeric::float::add_scaled;
use crate::system::State;

/// The explicit Runge-Kutta pair of Dormand and Prince, order 5, error estimate of order 4.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rk45;

/// Stage derivatives of the last step.
#[derive(Debug, Clone)]
pub struct Stages {
    rates: [State; 7],
    /// Key, state, excitation and instant to which the last rate belongs: it is the first stage of the next step if that starts there.
    end: Option<(u32, State, Values, Instant)>,
    /// At the nodes, of which the last two are the same.
    stage_data: StageData,
}

impl Method for Rk45 {
    type Memory = Stages;
    const ERROR_ORDER: Option<u32> = Some(4);
    const STABLE: bool = false;

    fn memory(&self) -> Stages {
        Stages { rates: [[0.0; 12]; 7], end: None, stage_data: StageData::NONE }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn step<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Stages,
        ramp: &Ramp,
        state: &State,
    ) -> (State, State) {
        let tableau = &DORMAND_PRINCE;
        let Stages { rates, end, stage_data } = memory;
        equations.prepare(ramp, &tableau.c[..6], stage_data);
        rates[0] = match end {
            Some((key, at, values, instant))
                if *key == equations.key()
                    && at == state
                    && values == ramp.start
                    && instant.meets(&ramp.begin) =>
            {
                rates[6]
            }
            _ => equations.rate(state, &ramp.force(0.0), (stage_data, 0)),
        };
        let mut next = *state;
        for stage in 1..7 {
            next = *state;
            for (rate, weight) in rates.iter().zip(&tableau.a[stage - 1]).take(stage) {
                add_scaled(&mut next, rate, ramp.h * weight);
            }
            let at = (&*stage_data, if stage < 6 { stage } else { 5 });
            rates[stage] = equations.rate(&next, &ramp.force(tableau.c[stage]), at);
        }
        let mut error = [0.0; 12];
        for (rate, weight) in rates.iter().zip(&tableau.error) {
            add_scaled(&mut error, rate, ramp.h * weight);
        }
        *end = Some((equations.key(), next, *ramp.end, ramp.begin));
        (next, error)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn between<E: Equations>(
        &self,
        _: &E,
        memory: &mut Stages,
        ramp: &Ramp,
        state: &State,
        theta: f64,
    ) -> State {
        let mut there = *state;
        for (rate, polynomial) in memory.rates.iter().zip(&DORMAND_PRINCE.dense) {
            let weight = polynomial.iter().rev().fold(0.0, |sum, p| (sum + p) * theta);
            add_scaled(&mut there, rate, ramp.h * weight);
        }
        there
    }
}
