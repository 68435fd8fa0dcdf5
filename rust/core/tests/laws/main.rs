//! Tests of physical and numerical laws through the public interface. One binary, one file per topic, in the order of the data.

mod common;
mod contacts;
mod edges;
mod mixed;

mod assembly;
mod batch;
mod changes;
mod dynamics;
mod excitation;
mod exponential;
mod extremes;
mod invariance;
mod lanes;
mod law;
mod life;
mod loads;
mod long_steps;
mod methods;
mod modes;
mod offsets;
mod orders;
mod peaks;
mod riders;
mod stability;
mod start;
mod statics;
