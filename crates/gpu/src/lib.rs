//! The wgpu compute port: the same replay on a GPU, for comparison and for its bits.
//!
//! A design that can run there describes itself as a [`screendoor_rop::Port`]: its parameters
//! become a shader's constants, its pixels' state words in memory. The shaders in
//! `gpu/shaders` are twins of the Rust files of the same name. What decides is integer
//! arithmetic on both sides, so that the stochastic family leaves the same bits.

#![warn(missing_docs)]

mod bin;
pub mod capture;
mod chunk;
mod device;
mod params;
mod replay;
mod shader;
#[cfg(test)]
mod tests;
mod time;

/// The most by which a channel of a blending design's picture may differ from the plain
/// text's, as a share of one plus its value: these designs compute in single precision
/// here and in double precision there.
pub const TOLERANCE: f64 = 1e-5;

pub use device::{Adapter, Gpu};
pub use replay::{GpuOptions, GpuRun, GpuSeconds, Threads, replay};
