//! The laws that the core keeps, through its public interface. One binary, a file per theme, in the order of the data.

mod common;
mod contacts;
mod edges;
mod mixed;

mod assembly;
mod batch;
mod changes;
mod dynamics;
mod excitation;
mod extremes;
mod invariance;
mod lanes;
mod law;
mod loads;
mod methods;
mod modes;
mod orders;
mod stability;
mod statics;
