//! Errors and their messages. Each message names the field, what was expected, what was given, and what to do. (The errors of batches are in
//! `batch`.)

/// Conversions of errors into the variants of another that hold them.
macro_rules! from_variants {
    ($error:ident: $($variant:ident($of:ident)),+) => {$(
        impl From<$of> for $error {
            fn from(error: $of) -> Self {
                Self::$variant(error)
            }
        }
    )+};
}

pub(crate) use from_variants;

mod excitation;
mod run;
mod scene;
mod stopped;

pub use excitation::ExcitationError;
pub use run::{OtherMethod, RunError};
pub use scene::SceneError;
pub use stopped::Stopped;
