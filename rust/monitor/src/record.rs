//! The totals as a record of bytes, for memory that keeps them without power.
//!
//! Keep two places, and save to that of the older record: if power fails while one is written, the other is whole.

use crate::flag::Flag;
use crate::input::Counters;
use crate::monitor::Monitor;
use crate::prepared::Prepared;
use crate::sum::Sum;
use crate::totals::{BINS, QUANTITIES, Totals};
use guideload_life::COMPONENTS;
use guideload_life::Real;

/// Start of a record, with the version of its layout.
const MAGIC: [u8; 8] = *b"GLMON\0\0\x01";

/// Why a record cannot be written or used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum RecordError {
    /// The place is smaller than `record_length`.
    TooShort = 1,
    /// Not a record, or one of another version.
    NotARecord = 2,
    /// Its checksum is wrong: it was not written to its end, or the memory is damaged.
    Damaged = 3,
    /// It is of other constants: another machine or other settings.
    OtherMachine = 4,
}

impl core::fmt::Display for RecordError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.text())
    }
}

impl core::error::Error for RecordError {}

impl RecordError {
    /// What is wrong, and the way out.
    pub const fn text(self) -> &'static str {
        match self {
            Self::TooShort => {
                "the place for the record is too short: it needs the length that record_length gives"
            }
            Self::NotARecord => {
                "no record of this version: nothing was saved here yet, or another program wrote it"
            }
            Self::Damaged => {
                "checksum of the record is wrong: it was cut off or damaged; use the other place"
            }
            Self::OtherMachine => {
                "the record is of other constants: save under the new ones, or keep the old ones"
            }
        }
    }
}

const HEADER: usize = MAGIC.len() + 4 + 8 + 8; // id, number, clock
const OF_ALL: usize = 8 * (2 + 2 + 10); // periods, settling; distance; counters
const OF_CARRIAGE: usize = QUANTITIES * 4 * 8 + 16 + 8 * (BINS + 2) + 1;
const CHECKSUM: usize = 4;

/// Length of a record of some carriages, bytes.
pub const fn record_length(carriages: usize) -> usize {
    HEADER + OF_ALL + carriages * OF_CARRIAGE + CHECKSUM
}

/// CRC-32 of ISO 3309, as of zip and Ethernet, continued from `crc`; 0 at the start.
pub fn crc32(crc: u32, bytes: &[u8]) -> u32 {
    let mut crc = !crc;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
        }
    }
    !crc
}

/// Writes bytes one after the other, as far as there is room.
struct Writer<'a> {
    rest: core::slice::IterMut<'a, u8>,
}

impl Writer<'_> {
    fn bytes(&mut self, bytes: &[u8]) {
        // In this order: the first iterator of a zip is asked first, and may end without a loss for the second.
        for (&from, to) in bytes.iter().zip(self.rest.by_ref()) {
            *to = from;
        }
    }
    fn number(&mut self, number: u64) {
        self.bytes(&number.to_le_bytes());
    }
    fn numbers(&mut self, numbers: &[u64]) {
        for &number in numbers {
            self.number(number);
        }
    }
    fn reals<T: Real>(&mut self, reals: [T; 2]) {
        for real in reals {
            self.number(real.to_f64().to_bits());
        }
    }
}

/// Reads bytes one after the other; zeros past the end.
struct Reader<'a> {
    rest: core::slice::Iter<'a, u8>,
}

impl Reader<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        for (to, &from) in bytes.iter_mut().zip(self.rest.by_ref()) {
            *to = from;
        }
        bytes
    }
    fn number(&mut self) -> u64 {
        u64::from_le_bytes(self.bytes())
    }
    fn real<T: Real>(&mut self) -> T {
        T::from_f64(f64::from_bits(self.number()))
    }
    fn sum<T: Real>(&mut self) -> Sum<T> {
        let parts = [self.real(), self.real()];
        Sum::of_parts(parts)
    }
}

impl<T: Real, const S: usize, const C: usize, const N: usize> Monitor<T, S, C, N> {
    /// Writes the totals as record `number` to `place`, and returns the record's length. Records count up: restoring uses the larger number.
    /// Slow movement that is not in the totals yet, of less than the settling time, is not saved.
    ///
    /// # Errors
    /// [`RecordError::TooShort`], with nothing written.
    pub fn save(
        &self,
        prepared: &Prepared<T, S, C, N>,
        number: u64,
        place: &mut [u8],
    ) -> Result<usize, RecordError> {
        let carriages = (prepared.carriage_count as usize).min(C);
        let length = record_length(carriages);
        let record = place.get_mut(..length).ok_or(RecordError::TooShort)?;
        let (body, end) = record.split_at_mut_checked(length - CHECKSUM).ok_or(RecordError::TooShort)?;
        let mut to = Writer { rest: body.iter_mut() };
        to.bytes(&MAGIC);
        to.bytes(&prepared.id.to_le_bytes());
        let totals = self.totals();
        to.numbers(&[number, self.clock(), totals.periods, totals.settling]);
        to.reals(totals.distance.parts());
        let Counters { samples, missing, early, jittering, stuck, jumps, wraps, counter_set, restarts, lost } =
            totals.counters;
        to.numbers(&[samples, missing, early, jittering, stuck, jumps, wraps, counter_set, restarts, lost]);
        for carriage in totals.carriages.iter().take(carriages) {
            for k in 0..QUANTITIES {
                to.reals([carriage.smallest[k], carriage.largest[k]]);
                to.numbers(&[carriage.period_of_smallest[k], carriage.period_of_largest[k]]);
            }
            to.reals(carriage.power.parts());
            to.numbers(&carriage.histogram);
            to.numbers(&[carriage.above_limit, carriage.limit_exceeded]);
            to.bytes(&[u8::from(carriage.is_above.is_set())]);
        }
        Writer { rest: end.iter_mut() }.bytes(&crc32(0, body).to_le_bytes());
        Ok(length)
    }

    /// Goes on with the newer of the whole records in two places, and returns its number. Call it before the first sample: what happened
    /// since the record was saved is lost, and the machine counts as at rest.
    ///
    /// # Errors
    /// [`RecordError`] of the first place, if neither has a record that can be used; the monitor is as before.
    pub fn restore(
        &mut self,
        prepared: &Prepared<T, S, C, N>,
        places: [&[u8]; 2],
    ) -> Result<u64, RecordError> {
        let [first, second] = places.map(|place| read::<T, S, C, N>(prepared, place));
        let newer = match (first, second) {
            (Ok(first), Ok(second)) => Ok(if second.0 > first.0 { second } else { first }),
            (Ok(one), Err(_)) | (Err(_), Ok(one)) => Ok(one),
            (Err(error), Err(_)) => Err(error),
        };
        let (number, clock, body) = newer?;
        let totals = totals(body, (prepared.carriage_count as usize).min(C));
        if !totals.is_finite() {
            return Err(RecordError::Damaged);
        }
        self.set_totals(totals, clock);
        Ok(number)
    }
}

/// Number, clock and totals of a record that is whole and belongs to these constants.
fn read<'a, T: Real, const S: usize, const C: usize, const N: usize>(
    prepared: &Prepared<T, S, C, N>,
    place: &'a [u8],
) -> Result<(u64, u64, Reader<'a>), RecordError> {
    let length = record_length((prepared.carriage_count as usize).min(C));
    if place.get(..MAGIC.len()) != Some(&MAGIC) {
        return Err(RecordError::NotARecord);
    }
    let record = place.get(..length).ok_or(RecordError::TooShort)?;
    let (body, end) = record.split_at_checked(length - CHECKSUM).ok_or(RecordError::TooShort)?;
    let mut from = Reader { rest: body.iter() };
    let _: [u8; MAGIC.len()] = from.bytes();
    // Before the checksum, as a record of another number of carriages has another length.
    if u32::from_le_bytes(from.bytes()) != prepared.id {
        return Err(RecordError::OtherMachine);
    }
    if end != crc32(0, body).to_le_bytes() {
        return Err(RecordError::Damaged);
    }
    let (number, clock) = (from.number(), from.number());
    Ok((number, clock, from))
}

fn totals<T: Real, const C: usize>(mut from: Reader<'_>, carriages: usize) -> Totals<T, C> {
    let mut totals = Totals::NONE;
    (totals.periods, totals.settling) = (from.number(), from.number());
    totals.distance = from.sum();
    let counters = &mut totals.counters;
    let Counters { samples, missing, early, jittering, stuck, jumps, wraps, counter_set, restarts, lost } =
        counters;
    for count in [samples, missing, early, jittering, stuck, jumps, wraps, counter_set, restarts, lost] {
        *count = from.number();
    }
    for carriage in totals.carriages.iter_mut().take(carriages) {
        for k in 0..QUANTITIES {
            (carriage.smallest[k], carriage.largest[k]) = (from.real(), from.real());
            (carriage.period_of_smallest[k], carriage.period_of_largest[k]) = (from.number(), from.number());
        }
        carriage.power = from.sum();
        for periods in &mut carriage.histogram {
            *periods = from.number();
        }
        (carriage.above_limit, carriage.limit_exceeded) = (from.number(), from.number());
        carriage.is_above = Flag::new(from.bytes() != [0]);
    }
    totals
}

const _: () = assert!(COMPONENTS + 2 == QUANTITIES);
