//! Scenes for screendoor, from files and built-in generators, and the rasteriser that captures
//! a fragment trace of them.

#![warn(missing_docs)]

pub mod capture;
mod elementary;
pub mod scene;
