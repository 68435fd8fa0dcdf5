//! What a C program keeps, a monitor's memory and its constants: recognised before it is used.
//!
//! Each type that is read from there is `FromBytes`: any bytes are a value of it. References to it live within a closure.

use guideload_monitor::{Monitor, Prepared, RecordError, crc32};
use zerocopy::FromBytes;

/// Places for entries of the state, carriages and second differences, as in the header.
pub(crate) const STATES: usize = 12;
pub(crate) const CARRIAGES: usize = 8;
pub(crate) const DIFFERENCES: usize = 128;

pub(crate) type State = Monitor<f32, STATES, CARRIAGES, DIFFERENCES>;

/// First word of constants: "GLC" and the version of their layout, as in the header.
pub(crate) const LAYOUT: u32 = 0x474C_4303;
/// First word of a started memory: "GLM" and the version of its layout.
const STARTED: u32 = 0x474C_4D04;

/// Constants of a machine, as in the header.
#[derive(Debug, Clone, Copy, FromBytes)]
#[repr(C)]
pub struct Constants {
    pub(crate) layout: u32,
    pub(crate) prepared: Prepared<f32, STATES, CARRIAGES, DIFFERENCES>,
    /// Checksum of `prepared`.
    pub(crate) check: u32,
}

const WORDS: usize = 1191;
const _: () = assert!(size_of::<Constants>() == 4 * (WORDS + 2) && align_of::<Constants>() == 4);

/// Memory of a monitor, as in the header.
#[derive(Debug, Clone, FromBytes)]
#[repr(C)]
pub struct Memory {
    pub(crate) words: [u64; 560],
}

/// What is in the memory of a monitor.
#[derive(FromBytes)]
#[repr(C)]
struct Content {
    started: u32,
    /// Size of the state, which differs between processors and versions.
    size: u16,
    /// Number of carriages.
    carriages: u16,
    /// Checksum of the constants.
    constants: u32,
    /// The three words before, mixed.
    mixed: u32,
    state: State,
}

const _: () =
    assert!(size_of::<Content>() <= size_of::<Memory>() && size_of::<Memory>() <= u16::MAX as usize);
const _: () = assert!(align_of::<Content>() <= align_of::<Memory>());

/// Why a call is not made; the number is its error in the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum Fault {
    Null = -1,
    NoCarriage = -2,
    Misaligned = -3,
    NotStarted = -4,
    DamagedConstants = -5,
    OtherConstants = -6,
    NotFinite = -7,
    TooShort = -11,
    NotARecord = -12,
    DamagedRecord = -13,
    OtherMachine = -14,
}

impl From<RecordError> for Fault {
    fn from(error: RecordError) -> Self {
        match error {
            RecordError::TooShort => Self::TooShort,
            RecordError::NotARecord => Self::NotARecord,
            RecordError::Damaged => Self::DamagedRecord,
            RecordError::OtherMachine => Self::OtherMachine,
        }
    }
}

impl Constants {
    /// Whether they are as they were built.
    fn check(&self) -> Result<(), Fault> {
        let is_whole = self.layout == LAYOUT && self.check == self.checksum() && self.prepared.is_valid();
        if is_whole { Ok(()) } else { Err(Fault::DamagedConstants) }
    }

    /// CRC-32 of the words of the constants, the low byte of each first.
    pub(crate) fn checksum(&self) -> u32 {
        // SAFETY: constants of f32 are WORDS numbers of four bytes, by the assertion above without any between them; all are words.
        let words = unsafe { &*(&raw const self.prepared).cast::<[u32; WORDS]>() };
        words.iter().fold(0, |crc, word| crc32(crc, &word.to_le_bytes()))
    }
}

impl Content {
    fn new(constants: &Constants) -> Self {
        let mut content = Self {
            started: STARTED,
            size: size_of::<State>() as u16,
            carriages: constants.prepared.carriage_count as u16,
            constants: constants.check,
            mixed: 0,
            state: State::NEW,
        };
        content.mixed = content.mix();
        content
    }

    fn mix(&self) -> u32 {
        !(self.started ^ (u32::from(self.size) << 16 | u32::from(self.carriages)) ^ self.constants)
    }

    fn check(&self) -> Result<(), Fault> {
        let is_started = self.started == STARTED
            && usize::from(self.size) == size_of::<State>()
            && self.mixed == self.mix();
        if is_started { Ok(()) } else { Err(Fault::NotStarted) }
    }

    fn belongs_to(&self, constants: &Constants) -> Result<(), Fault> {
        let is_same = constants.layout == LAYOUT && self.constants == constants.check;
        if is_same { Ok(()) } else { Err(Fault::OtherConstants) }
    }
}

/// Whether a pointer may be followed, as far as that can be told.
fn check<T>(pointer: *const T) -> Result<(), Fault> {
    if pointer.is_null() {
        Err(Fault::Null)
    } else if !pointer.is_aligned() {
        Err(Fault::Misaligned)
    } else {
        Ok(())
    }
}

/// Starts a monitor for constants that are whole.
///
/// # Safety
/// A pointer that is neither null nor misaligned points to memory of its type, which nothing else uses during the call.
pub(crate) unsafe fn start(memory: *mut Memory, constants: *const Constants) -> Result<(), Fault> {
    check(memory)?;
    // SAFETY: the contract of this function.
    let content = unsafe {
        with(constants, |constants| {
            constants.check()?;
            Ok(Content::new(constants))
        })?
    };
    // SAFETY: checked; large and aligned enough by the assertions above; the contract of this function.
    unsafe { memory.cast::<Content>().write(content) };
    Ok(())
}

/// Uses what a program wrote.
///
/// # Safety
/// As of [`start`], but others may read the memory too.
pub(crate) unsafe fn with<T: FromBytes, R>(
    pointer: *const T,
    use_it: impl FnOnce(&T) -> Result<R, Fault>,
) -> Result<R, Fault> {
    check(pointer)?;
    // SAFETY: checked; any bytes are a `T`; the contract of this function.
    use_it(unsafe { &*pointer })
}

/// Place of a carriage, of some.
pub(crate) fn place(carriage: u32, carriages: u32) -> Result<usize, Fault> {
    if carriage < carriages { Ok(carriage as usize) } else { Err(Fault::NoCarriage) }
}

/// Reads a started monitor, given its number of carriages.
///
/// # Safety
/// As of [`with`].
pub(crate) unsafe fn with_state<R>(
    memory: *const Memory,
    read: impl FnOnce(&State, u32) -> Result<R, Fault>,
) -> Result<R, Fault> {
    check(memory)?;
    // SAFETY: checked, as the memory is as large and as aligned as its content; the contract of this function.
    unsafe {
        with(memory.cast::<Content>(), |content| {
            content.check()?;
            read(&content.state, content.carriages.into())
        })
    }
}

/// Reads a started monitor and its constants.
///
/// # Safety
/// As of [`with`].
pub(crate) unsafe fn with_both<R>(
    memory: *const Memory,
    constants: *const Constants,
    read: impl FnOnce(&State, &Constants) -> Result<R, Fault>,
) -> Result<R, Fault> {
    check(memory)?;
    // SAFETY: checked; the contract of this function.
    unsafe {
        with(constants, |constants| {
            with(memory.cast::<Content>(), |content| {
                content.check()?;
                content.belongs_to(constants)?;
                read(&content.state, constants)
            })
        })
    }
}

/// Changes a started monitor, with its constants.
///
/// # Safety
/// As of [`start`].
pub(crate) unsafe fn change<R>(
    memory: *mut Memory,
    constants: *const Constants,
    change: impl FnOnce(&mut State, &Constants) -> Result<R, Fault>,
) -> Result<R, Fault> {
    check(memory)?;
    // SAFETY: checked; any bytes are a content; the contract of this function.
    unsafe {
        with(constants, |constants| {
            let content = &mut *memory.cast::<Content>();
            content.check()?;
            content.belongs_to(constants)?;
            change(&mut content.state, constants)
        })
    }
}

/// Writes a result.
///
/// # Safety
/// As of [`start`].
pub(crate) unsafe fn write<T>(to: *mut T, value: T) -> Result<(), Fault> {
    check(to)?;
    // SAFETY: checked; the contract of this function.
    unsafe { to.write(value) };
    Ok(())
}
