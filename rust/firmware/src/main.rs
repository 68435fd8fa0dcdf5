//! Replays counts from flash through a monitor, and prints over semihosting.
//!
//! Under QEMU with `-icount shift=0` each instruction takes 1 ns of virtual time, so the SysTick timer counts instructions.
#![no_std]
#![no_main]

mod semihosting;

use core::panic::PanicInfo;
use core::ptr::{addr_of_mut, read_volatile, write_volatile};

use cortex_m_rt::entry;
use guideload_monitor::Monitor;
use semihosting::{exit, print, print_number, print_real};

include!(concat!(env!("GUIDELOAD_GENERATED"), "/monitor.rs"));
include!(concat!(env!("GUIDELOAD_GENERATED"), "/counts.rs"));

type ThisMonitor = Monitor<f32, STATES, CARRIAGES, DIFFERENCES>;

static mut MONITOR: ThisMonitor = Monitor::NEW;

/// The SysTick timer: control, reload value, current value.
const SYSTICK: [*mut u32; 3] = [0xE000_E010 as *mut u32, 0xE000_E014 as *mut u32, 0xE000_E018 as *mut u32];

/// Ticks since the timer was read as `start`; it counts down, 24 bits.
fn ticks_since(start: u32) -> u32 {
    start.wrapping_sub(ticks()) & 0xFF_FFFF
}

fn ticks() -> u32 {
    // SAFETY: a register of every Cortex-M.
    unsafe { read_volatile(SYSTICK[2]) }
}

fn start_timer() {
    // SAFETY: registers of every Cortex-M; nothing else uses the timer.
    unsafe {
        write_volatile(SYSTICK[1], 0xFF_FFFF);
        write_volatile(SYSTICK[2], 0);
        write_volatile(SYSTICK[0], 5); // on, clock of the processor, no interrupt
    }
}

/// Ticks that some hundred thousand instructions take, to tell instructions from ticks.
fn ticks_of_loop(rounds: u32) -> u32 {
    let start = ticks();
    // SAFETY: counts a register down.
    unsafe {
        core::arch::asm!("2:", "subs {0}, {0}, #1", "bne 2b", inout(reg) rounds => _, options(nomem, nostack));
    }
    ticks_since(start)
}

#[entry]
fn main() -> ! {
    // SAFETY: the only reference; there is no interrupt.
    let monitor = unsafe { &mut *addr_of_mut!(MONITOR) };
    start_timer();
    print("loop ");
    print_number(u64::from(ticks_of_loop(100_000)));
    print("\n");
    let (mut total, mut worst) = (0_u64, 0);
    let (mut measured, mut steady) = (0_u64, false);
    for (k, &count) in COUNTS.iter().enumerate() {
        let start = ticks();
        monitor.push(&PREPARED, k as u32, count);
        let took = ticks_since(start);
        // Until the first loads a sample takes less.
        if steady {
            total += u64::from(took);
            measured += 1;
            worst = u32::max(worst, took);
        }
        steady = monitor.motion().is_some();
        if k % PRINTED == 0 && steady {
            print("loads ");
            print_number(monitor.period());
            for load in monitor.loads().iter().flatten() {
                print(" ");
                print_real(*load);
            }
            print("\n");
        }
    }
    print("ticks ");
    print_number(total);
    print(" ");
    print_number(measured);
    print(" ");
    print_number(u64::from(worst));
    print("\nbytes ");
    print_number(size_of::<ThisMonitor>() as u64);
    print(" ");
    print_number(size_of_val(&PREPARED) as u64);
    print("\ndistance ");
    print_real(monitor.totals().distance.value() as f32);
    for (carriage, totals) in monitor.totals().carriages.iter().enumerate() {
        print("\ncarriage ");
        print_number(carriage as u64);
        print(" ");
        print_real(totals.power.value() as f32);
        for (smallest, largest) in totals.smallest.iter().zip(&totals.largest) {
            print(" ");
            print_real(*smallest);
            print(" ");
            print_real(*largest);
        }
    }
    print("\n");
    exit()
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    print("panic\n");
    exit()
}
