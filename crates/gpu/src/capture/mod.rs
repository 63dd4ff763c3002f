//! Capture by a GPU: its own raster pipeline finds which samples a triangle covers, and a
//! fragment shader appends what it is run for to a buffer.
//!
//! Two things stand here. [`FragmentBuffer`] with [`append_wgsl`] records the fragments of
//! any wgpu program: `docs/GPU_CAPTURE.md` shows how. [`GpuCapture`] uses them to draw our
//! scenes, and holds our own rasteriser against the adapter's ([`CrossCheck`]).

mod check;
mod fragments;
mod positions;
mod rasteriser;
mod scene;

pub use crate::differences::{CrossCheck, Difference};
pub use fragments::{APPEND_WGSL, Captured, FragmentBuffer, RawFragment, append_wgsl, in_order};
pub use positions::sample_positions;
pub use scene::GpuCapture;
