//! The kit of the designs that blend or add up all fragments.

pub mod accumulators;
pub(crate) mod blend_buffer;
pub mod functions;
pub(crate) mod in_lanes;
pub(crate) mod moments;
pub mod view_depth;
