//! The C interface, `rust/monitor-c`, with std: its laws, and attacks on it.

#[path = "../../monitor-c/src/lib.rs"]
mod interface;
