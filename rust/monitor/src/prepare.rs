//! The constants of a monitor from a scene, on a PC.

use core::fmt;

use guideload::{EquivalentLoad, SampledSystem, System, Wrench, eigenvalues};

use crate::input::MOST_TICKS;
use crate::prepared::{Carriage, FRACTION, InputSettings, Prepared};
use crate::record::crc32;
use guideload_life::Exponent;
use guideload_life::Real;

/// Fraction to which the vibration at a restart decays until loads count as settled.
const SETTLED: f64 = 0.01;

/// How the loads of a carriage are judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// Rule of the equivalent load.
    pub rule: EquivalentLoad,
    /// Limit of the equivalent load, N; infinite: none.
    pub limit: f64,
    /// Width of a bin of the histogram, N.
    pub bin: f64,
    /// `∫ P^p |v| dt` that uses up the rating life, N^p m; 0 if unknown.
    pub capacity: f64,
}

/// What a monitor needs besides the scene.
#[derive(Debug, Clone, Copy)]
pub struct Settings<'a> {
    /// Period of sampling, s.
    pub period: f64,
    /// Travel per count, m; negative if the counter counts backwards.
    pub quantum: f64,
    /// Encoder and clock.
    pub input: InputSettings,
    /// Weights of the second differences, the oldest first: of the acceleration in counts per period², and of the velocity, in addition to
    /// the last step, in counts per period.
    pub taps: &'a [[f64; 2]],
    /// Samples after the instant of an estimate.
    pub lag: u32,
    /// Exponent of the life.
    pub exponent: Exponent,
}

/// Why a monitor cannot be prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PrepareError {
    /// The scene is not linear.
    NotLinear,
    /// A mode does not decay.
    Undamped,
    /// More of something than there are places.
    Places {
        /// Of what.
        what: &'static str,
        /// Needed.
        needed: usize,
        /// There are.
        places: usize,
    },
    /// Ticks per period of which stamps of 32 bits hold too few periods, or none.
    Ticks {
        /// As given.
        got: u32,
    },
    /// A setting that is not in its range.
    Setting {
        /// Its name.
        name: &'static str,
        /// Its range, in words.
        expected: &'static str,
        /// As given.
        got: f64,
    },
    /// A constant that is not finite in f64 or f32.
    OutOfRange,
}

impl core::error::Error for PrepareError {}

impl fmt::Display for PrepareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotLinear => f.write_str(
                "a monitor needs linear links: contact changes and preloaded contacts would take a number of operations that has no bound; \
                 give every link a single stiffness",
            ),
            Self::Undamped => f.write_str(
                "a mode has no damping, so that an error of its state never decays: give the links damping",
            ),
            Self::Places { what, needed, places } => {
                write!(f, "{what}: {needed} are needed, and the monitor has places for {places}")
            }
            Self::Ticks { got } => write!(
                f,
                "ticks: expected 1 to {MOST_TICKS} per period, with which stamps of 32 bits tell early samples from late ones, got {got}"
            ),
            Self::Setting { name, expected, got } => write!(f, "{name}: expected {expected}, got {got:?}"),
            Self::OutOfRange => {
                f.write_str("a constant of the monitor is out of the range of its numbers: check the units of the machine")
            }
        }
    }
}

/// The constants for a linear scene, whose `loads` are those of the carriages about their centres.
///
/// # Errors
/// [`PrepareError`].
pub fn prepare<T: Real, const S: usize, const C: usize, const N: usize>(
    system: &System,
    loads: &[(Wrench<'_>, Judgement)],
    settings: &Settings<'_>,
) -> Result<Prepared<T, S, C, N>, PrepareError> {
    let got = settings.input.ticks;
    if !(1..=MOST_TICKS).contains(&got) {
        return Err(PrepareError::Ticks { got });
    }
    check(loads, settings)?;
    let modes = system.mode_count();
    let differences = settings.taps.len() + settings.input.most_missing as usize + 1;
    for (what, needed, places) in [
        ("entries of the state", 2 * modes, S),
        ("carriages", loads.len(), C),
        ("second differences", differences, N),
    ] {
        if needed > places {
            return Err(PrepareError::Places { what, needed, places });
        }
    }
    let sampled = SampledSystem::new(system, settings.period).ok_or(PrepareError::NotLinear)?;
    let mut to = Converter { checksum: 0 };
    to.whole_numbers(settings);
    let entries = || (0..modes).chain(6..6 + modes);
    let [from_start, from_end] =
        [sampled.from_start, sampled.from_end].map(|effect| to.places(entries().map(|i| effect[i])));
    let mut change = [[T::ZERO; S]; S];
    for (column, j) in change.iter_mut().zip(entries()) {
        *column = to.places(entries().map(|i| sampled.exp_minus_identity[j][i]));
    }
    let mut carriages = [Carriage::NONE; C];
    for (carriage, (load, judgement)) in carriages.iter_mut().zip(loads) {
        *carriage = to.carriage(load, judgement, entries());
    }
    let step = settings.quantum / f64::from(FRACTION) / settings.period;
    let taps = [
        to.places(settings.taps.iter().map(|[acceleration, _]| acceleration * step / settings.period)),
        to.places(settings.taps.iter().map(|[_, velocity]| velocity * step)),
    ];
    let decay = slowest_decay(system).ok_or(PrepareError::Undamped)?;
    let prepared = Prepared {
        carriage_count: loads.len() as u32,
        input: settings.input,
        tap_count: settings.taps.len() as u32,
        lag: settings.lag,
        settling: ((1.0 / SETTLED).ln() / decay / settings.period).ceil() as u32,
        exponent: settings.exponent as u32,
        period: to.number(settings.period),
        speed_of_step: to.number(step),
        taps,
        change,
        from_start,
        from_end,
        carriages,
        id: to.checksum,
    };
    if prepared.is_valid() { Ok(prepared) } else { Err(PrepareError::OutOfRange) }
}

/// Refuses settings that are not in their range.
fn check(loads: &[(Wrench<'_>, Judgement)], settings: &Settings<'_>) -> Result<(), PrepareError> {
    let Settings { period, quantum, input, taps, .. } = settings;
    let above = |got: f64| got > 0.0 && got.is_finite();
    let not_below = |got: f64| got >= 0.0 && got.is_finite();
    let (positive, from_0) = ("a finite number above 0", "a finite number from 0 on");
    let of_all = [
        ("period", positive, *period, above(*period)),
        ("quantum", "a finite number that is not 0", *quantum, above(quantum.abs())),
        ("taps", "one or more", taps.len() as f64, !taps.is_empty()),
        ("counter_bits", "1 to 32", input.counter_bits.into(), (1..=32).contains(&input.counter_bits)),
        ("most_change", from_0, input.most_change.into(), input.most_change >= 0),
        ("slack", from_0, input.slack.into(), input.slack >= 0),
        ("still", from_0, input.still.into(), input.still >= 0),
    ];
    let of_carriages = loads.iter().flat_map(|(_, Judgement { rule, limit, bin, capacity })| {
        let preload = rule.rule().preload;
        [
            ("limit", "a number above 0, infinite for none", *limit, *limit > 0.0),
            ("bin", positive, *bin, above(*bin)),
            ("capacity", from_0, *capacity, not_below(*capacity)),
            ("preload", from_0, preload, not_below(preload)),
        ]
    });
    match of_all.into_iter().chain(of_carriages).find(|&(.., is_in_range)| !is_in_range) {
        Some((name, expected, got, _)) => Err(PrepareError::Setting { name, expected, got }),
        None => Ok(()),
    }
}

/// The smallest decay rate of all modes, 1/s; none if one does not decay.
fn slowest_decay(system: &System) -> Option<f64> {
    let values = eigenvalues(system)?;
    let rates = values[..2 * system.mode_count()].iter().map(|value| -value.re);
    let slowest = rates.fold(f64::INFINITY, f64::min);
    (slowest > 0.0).then_some(slowest)
}

/// Converts numbers to those of the monitor, with a checksum of them.
struct Converter {
    checksum: u32,
}

impl Converter {
    fn number<T: Real>(&mut self, value: f64) -> T {
        self.checksum = crc32(self.checksum, &value.to_le_bytes());
        T::from_f64(value)
    }

    /// Takes whole numbers into the checksum.
    fn integers(&mut self, values: &[u32]) {
        for value in values {
            self.checksum = crc32(self.checksum, &value.to_le_bytes());
        }
    }

    /// Takes the settings that are whole numbers into the checksum.
    fn whole_numbers(&mut self, settings: &Settings<'_>) {
        let InputSettings { ticks, tolerance, counter_bits, most_change, slack, still, most_missing } =
            settings.input;
        let signed = [most_change, slack, still].map(i32::cast_unsigned);
        self.integers(&[settings.taps.len() as u32, settings.lag, settings.exponent as u32]);
        self.integers(&[ticks, tolerance, counter_bits, most_missing]);
        self.integers(&signed);
    }

    /// Numbers in the first places, and zeros.
    fn places<T: Real, const N: usize>(&mut self, values: impl Iterator<Item = f64>) -> [T; N] {
        let mut places = [T::ZERO; N];
        for (place, value) in places.iter_mut().zip(values) {
            *place = self.number(value);
        }
        places
    }

    fn carriage<T: Real, const S: usize>(
        &mut self,
        load: &Wrench<'_>,
        judgement: &Judgement,
        entries: impl Iterator<Item = usize>,
    ) -> Carriage<T, S> {
        let at_rest = load.at_rest();
        let mut by_state = [[T::ZERO; 5]; S];
        for (column, entry) in by_state.iter_mut().zip(entries) {
            let mut state = [0.0; 12];
            state[entry] = 1.0;
            let loaded = load.at(&state, &[0.0; 9]);
            *column = self.places((1..6).map(|k| loaded[k] - at_rest[k]));
        }
        let rule = judgement.rule.rule();
        self.integers(&[rule.counted, rule.plain, rule.preload_form]);
        Carriage {
            rest: self.places((1..6).map(|k| at_rest[k])),
            by_state,
            rule: rule.map(|value| self.number(value)),
            limit: self.number(judgement.limit),
            bins_per_load: self.number(1.0 / judgement.bin),
            capacity: self.number(judgement.capacity),
        }
    }
}
