//! The wgpu compute port: the same replay on a GPU, for comparison and for its bits.
//!
//! A design that can run there describes itself as a [`screendoor_rop::Port`]: its parameters
//! become a shader's constants, its pixels' state words in memory. The shaders in
//! `shaders` are twins of the Rust files of the same name. What decides is integer
//! arithmetic on both sides, so that the stochastic family leaves the same bits.

#![warn(missing_docs)]

#[cfg(not(feature = "wgpu"))]
mod absent;
#[cfg(feature = "wgpu")]
mod bin;
#[cfg(feature = "wgpu")]
pub mod capture;
#[cfg(feature = "wgpu")]
mod chunk;
#[cfg(feature = "wgpu")]
mod device;
mod differences;
#[cfg(feature = "wgpu")]
mod guard;
#[cfg(feature = "wgpu")]
mod kept;
#[cfg(feature = "wgpu")]
mod loaders;
mod options;
#[cfg(feature = "wgpu")]
mod params;
#[cfg(feature = "wgpu")]
mod program;
#[cfg(feature = "wgpu")]
mod replay;
#[cfg(feature = "wgpu")]
mod shader;
#[cfg(all(test, feature = "wgpu"))]
mod tests;
#[cfg(feature = "wgpu")]
mod time;
#[cfg(feature = "wgpu")]
mod unroll;

/// The most by which a channel of a blending design's picture may differ from the plain
/// text's, as a share of one plus its value: these designs compute in single precision
/// here and in double precision there.
pub const TOLERANCE: f64 = 1e-5;

#[cfg(not(feature = "wgpu"))]
pub use absent::{Gpu, capture, replay};
#[cfg(feature = "wgpu")]
pub use device::Gpu;
pub use options::{Adapter, GpuOptions, GpuSeconds, Threads};
#[cfg(feature = "wgpu")]
pub use replay::{GpuRun, replay};
