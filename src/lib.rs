//! Models of a raster-operations unit for order-independent transparency.
#![warn(missing_docs)]

pub mod capture;
pub mod cli;
pub mod design;
pub mod error;
pub mod metrics;
pub mod output;
pub mod param;
pub mod picture;
pub mod random;
pub mod report;
pub mod rop;
pub mod scene;
pub mod study;
pub mod tile;
pub mod trace;
