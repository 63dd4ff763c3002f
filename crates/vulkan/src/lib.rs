//! Captures of other programs: what the Vulkan layer recorded, as traces.
//!
//! The way through: [`Captures`] is what the layer left in a folder, checked; [`Listing`] says
//! what passes it holds; [`Conversion`] makes the header and the fragments of a trace of one of
//! the images that were drawn into.

#![warn(missing_docs)]

mod background;
mod blend;
mod convert;
mod depth;
mod folder;
mod format;
mod fragments;
mod frame;
mod listing;
mod plan;
mod records;
mod target;
mod warnings;

pub use convert::{Conversion, ConvertOptions, Converted, Dropped, Object, Refusal};
pub use depth::DepthRule;
pub use folder::Captures;
pub use listing::{ListedDevice, ListedPass, ListedTarget, Listing};
pub use target::TargetChoice;

pub use screendoor_vulkan_layer::settings::Span;
