//! The core without std and without an allocator: one scene, all four methods, running peaks; exits with 0 if they agree.
//!
//! On a microcontroller the start-up code calls the entry point; here Linux calls it, on x86-64 and AArch64.
#![no_std]
#![no_main]

mod memory;

use core::panic::PanicInfo;

use guideload::{
    Body, Control, Exact, Excitation, Exponential, Extremes, Free, Method, Output, Part, Peaks, Radau, Rk45,
    Scene, System, Wrench, carriage_links, group_load, run,
};
use nalgebra::{Matrix3, Vector3};

/// Acceleration of the cart every 20 ms: accelerate, cruise, decelerate.
const MOTION: [[f64; 3]; 16] = {
    let mut motion = [[0.0; 3]; 16];
    let mut k = 2;
    while k < 6 {
        motion[k][0] = 2.2;
        motion[k + 7][0] = -2.2;
        k += 1;
    }
    motion
};

/// Peak resultant load of guide 2 by each method, N; `None` if anything is refused.
fn peaks() -> Option<[f64; 4]> {
    let inertia = Matrix3::new(420.0, 15.0, -8.0, 15.0, 310.0, 22.0, -8.0, 22.0, 380.0);
    let body = Body::new(1250.0, Vector3::new(0.12, -0.65, 0.18), inertia).ok()?;
    let centers = [Vector3::new(0.0, 0.05, -0.35), Vector3::new(0.0, 0.05, 0.35)];
    let guides = [
        carriage_links(centers[0], 0.6, [120e6; 2], [100e3; 2]).ok()?,
        carriage_links(centers[1], 0.6, [120e6; 2], [100e3; 2]).ok()?,
    ];
    let scene =
        Scene::new(body, guides.as_flattened(), Vector3::new(0.0, -9.80665, 0.0), Free::GUIDED).ok()?;
    let system = System::new(&scene).ok()?;
    let loads = [group_load(&system, 4..8, centers[1], Part::Total)];
    let excitation = Excitation::uniform(0.0, 0.02, &MOTION).ok()?;
    Some([
        peak(&system, &Exact, &excitation, &loads)?,
        peak(&system, &Exponential, &excitation, &loads)?,
        peak(&system, &Rk45, &excitation, &loads)?,
        peak(&system, &Radau, &excitation, &loads)?,
    ])
}

fn peak<M: Method>(system: &System, method: &M, excitation: &Excitation, loads: &[Wrench; 1]) -> Option<f64> {
    let mut extremes = [Extremes::NONE; 1];
    let mut record = Peaks::new(system, excitation, loads, &mut extremes);
    let control = Control::Adaptive { rtol: 1e-6 };
    run(system, method, control, excitation, Output::Samples, &mut record).ok()?;
    Some(extremes[0].largest[6])
}

/// 0 if the methods agree, 1 if not.
fn verdict() -> i32 {
    match peaks() {
        Some([exact, others @ ..]) if others.iter().all(|other| (other - exact).abs() < 1e-5 * exact) => 0,
        _ => 1,
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    exit(2)
}

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
core::arch::global_asm!(".globl _start", "_start:", "and rsp, -16", "call {}", sym start);
#[cfg(all(target_os = "linux", target_arch = "aarch64"))]
core::arch::global_asm!(".globl _start", "_start:", "bl {}", sym start);

/// Called by the entry point with an aligned stack.
extern "C" fn start() -> ! {
    exit(verdict())
}

fn exit(code: i32) -> ! {
    #[cfg(all(target_os = "linux", target_arch = "x86_64"))]
    // SAFETY: system call 60 is exit; it does not return.
    unsafe {
        core::arch::asm!("syscall", in("rax") 60, in("rdi") code, options(noreturn));
    }
    #[cfg(all(target_os = "linux", target_arch = "aarch64"))]
    // SAFETY: system call 93 is exit; it does not return.
    unsafe {
        core::arch::asm!("svc 0", in("x8") 93, in("x0") code, options(noreturn));
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = code;
        loop {}
    }
}
