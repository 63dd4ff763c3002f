//! The integration tests: one binary, one file a subject.

mod blended;
mod browser;
mod cli;
mod colour;
mod comparisons;
mod conformance;
mod events;
mod fast;
mod fuzz;
mod golden;
mod gpu;
mod gpu_capture;
mod guarantees;
mod hostile;
mod inputs;
mod large;
mod layering;
mod layers;
mod loaders;
mod models;
mod python;
mod stress;
mod trace_file;
mod unbiased;
mod util;
