//! The designs, one file each, and their registry.
//!
//! They know no device, no scene and no study; the compiler says so:
//!
//! ```compile_fail
//! use screendoor_gpu::Gpu;
//! ```

#![warn(missing_docs)]

mod abuffer;
mod adaptive;
mod alpha_to_coverage;
mod blend;
mod depth_peeling;
mod enderton;
mod entry;
mod exact;
mod hashed_alpha;
mod hybrid;
mod kbuffer;
mod lk;
mod mboit;
mod merging;
mod mlab;
mod residual;
mod slab;
mod sorted_blend;
mod systematic;
mod wboit;

pub use abuffer::ABuffer;
pub use adaptive::Adaptive;
pub use alpha_to_coverage::AlphaToCoverage;
pub use blend::Blend;
pub use depth_peeling::DepthPeeling;
pub use enderton::Enderton;
pub use exact::Exact;
pub use hashed_alpha::HashedAlpha;
pub use hybrid::Hybrid;
pub use kbuffer::KBuffer;
pub use lk::LaineKarras;
pub use mboit::MomentBased;
pub use merging::Merging;
pub use mlab::Mlab;
pub use residual::Residual;
pub use slab::Slab;
pub use sorted_blend::SortedBlend;
pub use systematic::Systematic;
pub use wboit::WeightedBlended;

pub use entry::{Configured, Entry};

use screendoor_rop::Blueprint;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::parse_spec;

/// All designs. A static: a constant would be compiled anew, for every sample count,
/// into each crate that names it.
pub static DESIGNS: &[Entry] = &[
    Entry::of::<Exact>(),
    Entry::of::<LaineKarras>(),
    Entry::of::<Systematic>(),
    Entry::of::<Residual>(),
    Entry::of::<Enderton>(),
    Entry::of::<HashedAlpha>(),
    Entry::of::<AlphaToCoverage>(),
    Entry::of::<Slab>(),
    Entry::of::<KBuffer>(),
    Entry::of::<ABuffer>(),
    Entry::of::<Mlab>(),
    Entry::of::<Merging>(),
    Entry::of::<Hybrid>(),
    Entry::of::<Adaptive>(),
    Entry::of::<DepthPeeling>(),
    Entry::of::<Blend>(),
    Entry::of::<SortedBlend>(),
    Entry::of::<WeightedBlended>(),
    Entry::of::<MomentBased>(),
];

/// The name of the design that others are measured against.
pub const REFERENCE: &str = Exact::INFO.name;

/// The design that `spec` names, `NAME` or `NAME:key=value,…`, with `more`
/// settings after those of the spec.
///
/// # Errors
/// [`Error::Config`] for an unknown design or parameter, naming the nearest.
pub fn configure(spec: &str, more: &[(String, String)]) -> Result<Configured> {
    let (name, mut given) = parse_spec(spec)?;
    let Some(entry) = DESIGNS.iter().find(|e| e.info.name == name) else {
        return Err(Error::unknown("design", name, DESIGNS.iter().map(|e| e.info.name)));
    };
    given.extend_from_slice(more);
    entry.configure(&given)
}
