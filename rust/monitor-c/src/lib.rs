//! C interface of the load monitor; its documentation is `include/guideload_monitor.h`.
//!
//! All memory is of the C program. Whatever is in it, a call gives an error or a result that is finite: types that are read from it have a
//! value for any bytes, pointers are checked as far as they can be, and results are written when no reference is left.
//!
//! Each function has the same contract: a pointer that is neither null nor misaligned points to memory of its type, or of the stated length,
//! that nothing else writes during the call, nor reads if the call writes it; the pieces of memory do not overlap.
#![cfg_attr(not(test), no_std)]

use guideload_monitor::{BINS, COMPONENTS, QUANTITIES, record_length};

mod memory;
#[cfg(test)]
mod tests;

use memory::{CARRIAGES, Constants, Fault, Memory, change, place, start, with, with_both, with_state, write};

/// Totals of one carriage, as in the header.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct CarriageReport {
    smallest: [f32; QUANTITIES],
    largest: [f32; QUANTITIES],
    period_of_smallest: [u64; QUANTITIES],
    period_of_largest: [u64; QUANTITIES],
    power: f64,
    life_used: f64,
    histogram: [u64; BINS],
    above_limit: u64,
    limit_exceeded: u64,
}

/// Starts a monitor, after a look at the constants.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_start(memory: *mut Memory, constants: *const Constants) -> i32 {
    // SAFETY: the contract of this function.
    code(unsafe { start(memory, constants) }.map(|()| 0))
}

/// Takes a sample; what became of it.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_push(
    memory: *mut Memory,
    constants: *const Constants,
    stamp: u32,
    count: u32,
) -> i32 {
    // SAFETY: the contract of this function.
    code(unsafe {
        change(memory, constants, |state, constants| {
            let sample = state.push(&constants.prepared, stamp, count);
            if state.is_finite() { Ok(sample as i32) } else { Err(Fault::NotFinite) }
        })
    })
}

/// Loads of a carriage; 1 while they depend on the start.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_loads(
    memory: *const Memory,
    carriage: u32,
    loads: *mut [f32; COMPONENTS],
) -> i32 {
    // SAFETY: the contract of this function.
    let found = unsafe {
        with_state(memory, |state, carriages| {
            let found = state.loads().get(place(carriage, carriages)?).ok_or(Fault::NoCarriage)?;
            if state.is_finite() { Ok((*found, state.is_settling())) } else { Err(Fault::NotFinite) }
        })
    };
    // SAFETY: the contract of this function.
    code(found.and_then(|(found, settling)| unsafe { write(loads, found) }.map(|()| settling.into())))
}

/// Number of the period of the loads.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_period(memory: *const Memory, period: *mut u64) -> i32 {
    // SAFETY: the contract of this function.
    let found = unsafe { with_state(memory, |state, _| Ok(state.period())) };
    // SAFETY: the contract of this function.
    code(found.and_then(|found| unsafe { write(period, found) }).map(|()| 0))
}

/// Totals of a carriage; 1 while there are no extremes.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_totals(
    memory: *const Memory,
    constants: *const Constants,
    carriage: u32,
    report: *mut CarriageReport,
) -> i32 {
    // SAFETY: the contract of this function.
    let found = unsafe {
        with_both(memory, constants, |state, constants| {
            let totals = state.totals();
            let carriage = place(carriage, constants.prepared.carriage_count)?;
            let of = totals.carriages.get(carriage).ok_or(Fault::NoCarriage)?;
            let life_used = totals.life_used(&constants.prepared, carriage).unwrap_or(-1.0);
            if !(of.is_finite() && life_used.is_finite()) {
                return Err(Fault::NotFinite);
            }
            let has_extremes = of.has_extremes();
            let [smallest, largest] = [of.smallest, of.largest]
                .map(|extremes| if has_extremes { extremes } else { [0.0; QUANTITIES] });
            let found = CarriageReport {
                smallest,
                largest,
                period_of_smallest: of.period_of_smallest,
                period_of_largest: of.period_of_largest,
                power: of.power.value(),
                life_used,
                histogram: of.histogram,
                above_limit: of.above_limit,
                limit_exceeded: of.limit_exceeded,
            };
            Ok((found, i32::from(!has_extremes)))
        })
    };
    // SAFETY: the contract of this function.
    code(found.and_then(|(found, none_yet)| unsafe { write(report, found) }.map(|()| none_yet)))
}

/// Bytes of a record; 0 without constants.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_record_length(constants: *const Constants) -> u32 {
    // SAFETY: the contract of this function.
    unsafe { with(constants, |constants| Ok(length_of_record(constants) as u32)) }.unwrap_or(0)
}

/// Writes the totals as a record; its length.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_save(
    memory: *const Memory,
    constants: *const Constants,
    number: u64,
    place: *mut u8,
    length: u32,
) -> i32 {
    // SAFETY: the contract of this function; the slice is not longer than a record.
    code(unsafe {
        with_both(memory, constants, |state, constants| {
            if place.is_null() {
                return Err(Fault::Null);
            }
            if !state.totals().is_finite() {
                return Err(Fault::NotFinite);
            }
            let length = length_of_record(constants).min(length as usize);
            let place = core::slice::from_raw_parts_mut(place, length);
            Ok(state.save(&constants.prepared, number, place)? as i32)
        })
    })
}

/// Goes on with the newer of two records, and gives its number.
///
/// # Safety
/// The contract of the interface, see above.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_restore(
    memory: *mut Memory,
    constants: *const Constants,
    first: *const u8,
    second: *const u8,
    length: u32,
    number: *mut u64,
) -> i32 {
    // SAFETY: the contract of this function; the slices are not longer than a record. A first write shows whether the last one will do.
    code(unsafe {
        write(number, 0).and_then(|()| {
            let found = change(memory, constants, |state, constants| {
                if first.is_null() || second.is_null() {
                    return Err(Fault::Null);
                }
                let length = length_of_record(constants).min(length as usize);
                let places = [first, second].map(|place| core::slice::from_raw_parts(place, length));
                Ok(state.restore(&constants.prepared, places)?)
            })?;
            write(number, found).map(|()| 0)
        })
    })
}

/// Bytes of a record of the carriages that there are.
fn length_of_record(constants: &Constants) -> usize {
    record_length((constants.prepared.carriage_count as usize).min(CARRIAGES))
}

fn code(result: Result<i32, Fault>) -> i32 {
    result.unwrap_or_else(|fault| fault as i32)
}

/// Text of an error, ended by zero.
#[unsafe(no_mangle)]
pub extern "C" fn guideload_error_text(error: i32) -> *const core::ffi::c_char {
    let text = match error {
        -1 => c"a pointer is null",
        -2 => c"there is no carriage of this index",
        -3 => c"a pointer is not aligned as its type needs",
        -4 => c"the memory has no monitor of this version, or was overwritten: call guideload_start",
        -5 => c"the constants are damaged or of another version: build them again with `guideload monitor build`",
        -6 => c"the monitor was started with other constants: call guideload_start with these",
        -7 => c"a number is not finite, as memory or constants were overwritten: start again, and restore a record",
        -11 => c"the place for the record is too short: it needs guideload_record_length bytes",
        -12 => c"no record of this version: nothing was saved here yet, or another program wrote it",
        -13 => c"checksum of the record is wrong: it was cut off or damaged; use the other place",
        -14 => c"the record is of other constants: save under the new ones, or keep the old ones",
        0.. => c"no error",
        _ => c"unknown error",
    };
    text.as_ptr()
}

#[cfg(not(test))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
