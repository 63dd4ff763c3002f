//! Measurements of screendoor: metrics, studies, the suite of hard cases and the publications'
//! experiments.

#![warn(missing_docs)]

pub mod metrics;
pub mod post;
pub mod study;
