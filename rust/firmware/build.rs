//! Puts the memory map where the linker finds it, and the constants and counts, which `tests/firmware.py` makes, where the program does.

use std::path::PathBuf;

fn main() {
    let here = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("set by cargo"));
    println!("cargo:rustc-link-search={}", here.display());
    let generated =
        std::env::var("GUIDELOAD_GENERATED").unwrap_or_else(|_| here.join("generated").display().to_string());
    println!("cargo:rustc-env=GUIDELOAD_GENERATED={generated}");
    println!("cargo:rerun-if-env-changed=GUIDELOAD_GENERATED");
    println!("cargo:rerun-if-changed={generated}");
    println!("cargo:rerun-if-changed=memory.x");
}
