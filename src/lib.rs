//! Models of a raster-operations unit for order-independent transparency.
#![warn(missing_docs)]

pub mod error;
pub mod output;
pub mod param;
pub mod random;
pub mod tile;
pub mod trace;
