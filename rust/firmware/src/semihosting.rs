//! Output to the debugger or emulator. Numbers are printed as bits in hexadecimal: formatting of `core` could panic.

/// Calls an operation of the host.
fn call(operation: u32, argument: *const u8) {
    // SAFETY: the operations used here read the argument and nothing else.
    unsafe {
        core::arch::asm!("bkpt #0xAB", inout("r0") operation => _, in("r1") argument, options(nostack));
    }
}

/// Bytes of a line, ended by zero.
fn write(text: impl Iterator<Item = u8>) {
    let mut buffer = [0; 64];
    for (to, from) in buffer.iter_mut().take(63).zip(text) {
        *to = from;
    }
    call(0x04, buffer.as_ptr()); // SYS_WRITE0
}

/// Prints a text of up to 63 characters.
pub fn print(text: &str) {
    write(text.bytes());
}

/// Prints a number in hexadecimal.
pub fn print_number(number: u64) {
    let digits = (0..16).rev().map(|digit| (number >> (4 * digit) & 0xF) as u8);
    write(digits.map(|digit| if digit < 10 { b'0' + digit } else { b'a' + digit - 10 }));
}

/// Prints the bits of a number in hexadecimal.
pub fn print_real(number: f32) {
    print_number(u64::from(number.to_bits()));
}

/// Ends the emulator with success.
pub fn exit() -> ! {
    call(0x18, 0x20026 as *const u8); // SYS_EXIT, ADP_Stopped_ApplicationExit
    loop {}
}
