//! Captures of other programs: what the Vulkan layer recorded, as traces.
//!
//! The way through: [`Captures`] is what the layer left in a folder, checked; [`Listing`] says
//! what passes it holds; [`Conversion`] makes the header and the fragments of a trace of one of
//! the images that were drawn into.

#![warn(missing_docs)]

mod background;
mod blend;
mod check;
mod convert;
mod depth;
mod depth_images;
mod equation;
mod folder;
mod format;
mod fragments;
mod frame;
mod library;
mod listing;
mod logs;
mod plan;
mod records;
mod run;
mod samples;
mod target;
#[cfg(test)]
mod tests;
mod warnings;

pub use check::{Beyond, Check};
pub use convert::{Conversion, ConvertOptions, Converted, Dropped, Object, Refusal};
pub use depth::DepthRule;
pub use folder::Captures;
pub use library::{LIBRARY_VARIABLE, layer_library};
pub use listing::{ListedDevice, ListedPass, ListedTarget, Listing};
pub use logs::terminate;
pub use run::{Ended, Run, why_nothing};
pub use target::TargetChoice;

pub use screendoor_vulkan_layer::settings::{Settings, Span};
