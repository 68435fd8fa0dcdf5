//! Laws of the monitor.

mod agreement;
mod common;
mod record;
mod samples;
mod settings;
mod slow;
