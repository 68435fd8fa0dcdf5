//! C interface of the load monitor; its documentation is `include/guideload_monitor.h`.
#![no_std]
#![allow(clippy::missing_safety_doc)] // the contract of the pointers is in the header

use core::panic::PanicInfo;

use guideload_monitor::{BINS, COMPONENTS, Monitor, Prepared, QUANTITIES, RecordError, record_length};

/// Places for entries of the state, carriages and second differences, as in the header.
const STATES: usize = 12;
const CARRIAGES: usize = 8;
const DIFFERENCES: usize = 128;

type Constants = Prepared<f32, STATES, CARRIAGES, DIFFERENCES>;
type State = Monitor<f32, STATES, CARRIAGES, DIFFERENCES>;

/// Memory of a monitor, as in the header.
#[repr(C)]
pub struct Memory {
    words: [u64; 560],
}

const _: () =
    assert!(size_of::<State>() <= size_of::<Memory>() && align_of::<State>() <= align_of::<Memory>());
const _: () = assert!(size_of::<Constants>() == 4764);

/// Errors; those of a record are less than this by their number.
const NULL: i32 = -1;
const NO_CARRIAGE: i32 = -2;
const RECORD: i32 = -10;

/// Totals of one carriage, as in the header.
#[repr(C)]
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

/// Starts a monitor in the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_start(memory: *mut Memory) -> i32 {
    if memory.is_null() {
        return NULL;
    }
    // SAFETY: the caller vouches for the memory, which is large and aligned enough by the assertion above.
    unsafe { memory.cast::<State>().write(State::NEW) };
    0
}

/// The monitor in the memory, and its constants.
unsafe fn both<'a>(
    memory: *mut Memory,
    prepared: *const Constants,
) -> Option<(&'a mut State, &'a Constants)> {
    // SAFETY: the caller vouches for a started monitor that no other call uses, and for constants of this layout.
    unsafe { Some((memory.cast::<State>().as_mut()?, prepared.as_ref()?)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_push(
    memory: *mut Memory,
    prepared: *const Constants,
    stamp: u32,
    count: u32,
) -> i32 {
    // SAFETY: as the header says.
    match unsafe { both(memory, prepared) } {
        Some((state, prepared)) => state.push(prepared, stamp, count) as i32,
        None => NULL,
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_loads(
    memory: *const Memory,
    carriage: u32,
    loads: *mut [f32; COMPONENTS],
) -> i32 {
    // SAFETY: as the header says.
    let (Some(state), Some(loads)) = (unsafe { (memory.cast::<State>().as_ref(), loads.as_mut()) }) else {
        return NULL;
    };
    let Some(found) = state.loads().get(carriage as usize) else { return NO_CARRIAGE };
    *loads = *found;
    i32::from(state.is_settling())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_period(memory: *const Memory) -> u64 {
    // SAFETY: as the header says.
    unsafe { memory.cast::<State>().as_ref() }.map_or(0, State::period)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_totals(
    memory: *mut Memory,
    prepared: *const Constants,
    carriage: u32,
    report: *mut CarriageReport,
) -> i32 {
    // SAFETY: as the header says.
    let (Some((state, prepared)), Some(report)) = (unsafe { (both(memory, prepared), report.as_mut()) })
    else {
        return NULL;
    };
    let totals = state.totals();
    let Some(of) = totals.carriages.get(carriage as usize) else { return NO_CARRIAGE };
    *report = CarriageReport {
        smallest: of.smallest,
        largest: of.largest,
        period_of_smallest: of.period_of_smallest,
        period_of_largest: of.period_of_largest,
        power: of.power.value(),
        life_used: totals.life_used(prepared, carriage as usize).unwrap_or(-1.0),
        histogram: of.histogram,
        above_limit: of.above_limit,
        limit_exceeded: of.limit_exceeded,
    };
    0
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_record_length(prepared: *const Constants) -> u32 {
    // SAFETY: as the header says.
    let carriages = unsafe { prepared.as_ref() }.map_or(0, |prepared| prepared.carriage_count as usize);
    record_length(carriages.min(CARRIAGES)) as u32
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_save(
    memory: *mut Memory,
    prepared: *const Constants,
    number: u64,
    place: *mut u8,
    length: u32,
) -> i32 {
    // SAFETY: as the header says.
    let Some((state, prepared)) = (unsafe { both(memory, prepared) }) else { return NULL };
    if place.is_null() {
        return NULL;
    }
    // SAFETY: the caller vouches for `length` bytes.
    let place = unsafe { core::slice::from_raw_parts_mut(place, length as usize) };
    state.save(prepared, number, place).map_or_else(code, |length| length as i32)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn guideload_restore(
    memory: *mut Memory,
    prepared: *const Constants,
    first: *const u8,
    second: *const u8,
    length: u32,
    number: *mut u64,
) -> i32 {
    // SAFETY: as the header says.
    let (Some((state, prepared)), Some(number)) = (unsafe { (both(memory, prepared), number.as_mut()) })
    else {
        return NULL;
    };
    if first.is_null() || second.is_null() {
        return NULL;
    }
    // SAFETY: the caller vouches for `length` bytes at both.
    let places = unsafe { [first, second].map(|place| core::slice::from_raw_parts(place, length as usize)) };
    state.restore(prepared, places).map_or_else(code, |found| {
        *number = found;
        0
    })
}

fn code(error: RecordError) -> i32 {
    RECORD - error as i32
}

/// Text of an error, ended by zero.
#[unsafe(no_mangle)]
pub extern "C" fn guideload_error_text(error: i32) -> *const core::ffi::c_char {
    let text = match error {
        NULL => c"a pointer is null",
        NO_CARRIAGE => c"there is no carriage of this index",
        -11 => c"the place for the record is too short: it needs guideload_record_length bytes",
        -12 => c"no record of this version: nothing was saved here yet, or another program wrote it",
        -13 => c"checksum of the record is wrong: it was cut off or damaged; use the other place",
        -14 => c"the record is of other constants: save under the new ones, or keep the old ones",
        0.. => c"no error",
        _ => c"unknown error",
    };
    text.as_ptr()
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}
