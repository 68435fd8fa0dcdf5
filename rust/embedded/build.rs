//! Leaves out the C start-up files and libraries on Linux, so that nothing but this program and the core is linked.

fn main() {
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        for argument in ["-nostartfiles", "-nostdlib", "-static"] {
            println!("cargo:rustc-link-arg-bins={argument}");
        }
    }
}
