//! The kit of the designs that blend or add up all fragments.

pub mod accumulators;
pub mod blend_buffer;
pub mod moments;
pub mod view_depth;
