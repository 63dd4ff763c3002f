//! The kit of the stochastic designs: which samples a fragment may write, and what becomes of
//! them.

pub mod comb;
pub mod depth_bits;
pub(crate) mod dither;
pub mod fast;
mod methods;
pub(crate) mod pixel_order;
pub(crate) mod reference_value;
pub(crate) mod subset;
pub(crate) mod surface;
pub mod tracked;

pub use methods::*;
