//! Models of a raster-operations unit (ROP) that draws transparent surfaces in any
//! order by stochastic sampling.
//!
//! GPUs cannot draw transparent surfaces in any order without sorting. Stochastic
//! transparency can: every fragment covers a random share of a pixel's samples,
//! and an ordinary depth test does the rest. Laine and Karras (2011) showed that a
//! ROP with a few bits of state per pixel halves its noise. This crate replays
//! recorded streams of fragments through such ROPs, bit for bit, and reports what
//! each design costs and how far its picture is from the exact one.
//!
//! ```
//! use screendoor::capture::{Capture, CaptureOptions};
//! use screendoor::design::configure;
//! use screendoor::metrics::{Region, errors};
//! use screendoor::rop::ReplayOptions;
//!
//! // A scene becomes a trace …
//! let scene = screendoor::scene::load("builtin:ramps")?;
//! let options = CaptureOptions { width: 64, height: 64, ..CaptureOptions::default() };
//! let trace = Capture::new(&scene, &options)?.to_memory(|_, _| ())?;
//!
//! // … which is replayed through designs …
//! let replay = |design: &str| {
//!     configure(design, &[])?.replay(&trace, 16, 1, &ReplayOptions::default())
//! };
//! let (lk, exact) = (replay("lk")?, replay("exact")?);
//!
//! // … and held against the exact picture.
//! let error = errors(&lk.picture, &exact.picture, &Region::frame(lk.picture.grid()));
//! assert!(error.rmse < 8.0, "{} of 255", error.rmse);
//! # Ok::<(), screendoor::error::Error>(())
//! ```
//!
//! The way through: [`scene`] → [`capture`] → [`trace`] → [`rop`] with a
//! [`design`] → [`resolve`] → [`metrics`] → [`study`] → [`report`]. Reading order,
//! rules and limits stand in `docs/ARCHITECTURE.md`.

#![warn(missing_docs)]

pub mod cli;

pub use screendoor_designs as design;
pub use screendoor_gpu as gpu;
pub use screendoor_report as report;
pub use screendoor_rop as rop;
pub use screendoor_rop::resolve;
pub use screendoor_scene::{capture, scene};
pub use screendoor_study::{metrics, post, study};
pub use screendoor_trace::{edit, error, options, output, param, picture, random, tile, trace};
pub use screendoor_vulkan as vulkan;

/// The worked example of `docs/ADD_A_DESIGN.md`, compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../docs/ADD_A_DESIGN.md")]
pub struct AddADesign;

/// The example of `docs/GPU_CAPTURE.md`, compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../docs/GPU_CAPTURE.md")]
pub struct GpuCapture;
