//! The kit of the stochastic designs: which samples a fragment may write, and what becomes of
//! them.

pub mod depth_bits;
pub mod dither;
pub mod fast;
mod methods;
pub mod pixel_order;
pub mod reference_value;
pub mod subset;
pub mod surface;
pub mod tracked;

pub use methods::*;
