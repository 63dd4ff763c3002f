//! The integration tests: one binary, one file a subject.

mod blended;
mod browser;
mod c_header;
mod cli;
mod colour;
mod comparisons;
mod conformance;
mod edits;
mod events;
mod fast;
mod foreign;
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
mod limits;
mod loaders;
mod measured;
mod models;
#[cfg(feature = "probe")]
mod optional;
mod python;
mod results_document;
mod seal;
mod splats;
mod stress;
mod trace_file;
mod unbiased;
mod util;
mod view;
