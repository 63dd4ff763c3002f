//! A Vulkan layer that records the fragments of any program: of each its pixel, coverage, depth,
//! colour, primitive and draw, without a change to the program's picture.
//!
//! The loader opens it as a library; `screendoor capture --vulkan` says that it should, and makes a
//! trace of what it writes ([`log`]).

pub mod log;
pub mod settings;
pub mod spirv;
mod wire;

pub use ash::vk;
pub use wire::Wire;
