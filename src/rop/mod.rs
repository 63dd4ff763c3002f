//! What the raster-operations units share: pixel state, surface tracking, sample
//! order, reference values, event counts, and the replay.

pub mod depth_bits;
mod design;
mod event;
pub mod layers;
mod normalise;
mod opacity;
pub mod over_opaque;
mod pixel_order;
mod reference_value;
mod replay;
mod samples;
mod subset;
mod surface;

pub use design::{
    Blueprint, Contents, Design, Family, Frame, Info, OrderPromise, Promises, Site, StateBits,
};
pub use event::{EventCounts, NoProbe, Probe, Record, ReferenceRecord};
pub use normalise::{Normalise, Sums};
pub use opacity::Threshold;
pub use over_opaque::{Opaque, OverOpaque, Transparent};
pub use pixel_order::{PixelIndex, PixelOrder};
pub use reference_value::{Reference, ReferenceKey, scramble_lk2011};
pub use replay::{Explanation, ReplayOptions, Replayed, Step, draw_pixel, explain, replay};
pub use samples::{SampleContents, SampleList, Samples, in_sample_order, sort_by_stored_depth};
pub use subset::{random_subset, visible_independent, visible_stratified};
pub use surface::{CoveredMask, SurfaceRule, SurfaceTracker, Tracked};
