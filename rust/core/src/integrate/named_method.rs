//! The methods by name, for a choice at run time.

use super::control::Control;
use super::exact::Exact;
use super::exponential::Exponential;
use super::method::{CompiledRun, Output, Summary};
use super::radau::Radau;
use super::rk45::Rk45;
use super::run::run_scaled;
use super::start::Start;
use crate::error::RunError;
use crate::excitation::{Excitation, ScaledExcitation};
use crate::output::Record;
use crate::system::System;

/// Writes the enumeration of the methods, from a row for each: its variant, its name and the method; and their compiled runs.
macro_rules! named_methods {
    ($($(#[$doc:meta])* $variant:ident, $name:literal, $method:ident;)*) => {
        $(impl CompiledRun for $method {
            fn run_compiled(
                &self,
                system: &System,
                control: Control,
                start: Start,
                scaled: &ScaledExcitation,
                output: Output,
                record: &mut dyn Record,
            ) -> Result<Summary, RunError> {
                run_scaled(system, self, control, start, scaled, output, record)
            }
        })*

        /// A method chosen by its name at run time.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum NamedMethod {
            $($(#[$doc])* $variant,)*
        }

        impl NamedMethod {
            /// All methods.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The name of the method.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// Its compiled run.
            pub(crate) fn method(self) -> &'static dyn CompiledRun {
                match self {
                    $(Self::$variant => &$method,)*
                }
            }
        }
    };
}

named_methods! {
    /// [`Exact`].
    Exact, "exact", Exact;
    /// [`Exponential`].
    Exponential, "exponential", Exponential;
    /// [`Rk45`].
    Rk45, "rk45", Rk45;
    /// [`Radau`].
    Implicit, "implicit", Radau;
}

impl NamedMethod {
    /// The method of that name, as in [`NamedMethod::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|method| method.name() == name)
    }

    /// [`super::run_from`] with this method.
    ///
    /// # Errors
    /// As [`super::run_from`].
    pub fn run(
        self,
        system: &System,
        control: Control,
        start: Start,
        excitation: &Excitation,
        output: Output,
        record: &mut dyn Record,
    ) -> Result<Summary, RunError> {
        let scaled = ScaledExcitation::unscaled(excitation);
        self.method().run_compiled(system, control, start, &scaled, output, record)
    }
}
