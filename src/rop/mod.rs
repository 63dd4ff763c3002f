//! What the raster-operations units share: pixel state, surface tracking, sample
//! order, reference values, event counts, and the replay.

pub mod accumulators;
mod blend_buffer;
pub mod colour;
pub mod depth_bits;
mod design;
mod dither;
mod event;
pub mod fast;
pub mod layers;
mod layout;
mod moments;
mod normalise;
mod opacity;
pub mod over_opaque;
mod pixel_order;
mod port;
mod primitive_depths;
mod promise;
mod reference_value;
mod replay;
mod samples;
pub mod stochastic;
mod subset;
mod surface;
pub mod tracked;
pub mod view_depth;

pub use accumulators::{Accumulators, Coverage};
pub use blend_buffer::BlendBuffer;
pub use colour::ColourStore;
pub use design::{
    Blueprint, Contents, Design, Family, Frame, Info, OpaquePromise, OrderPromise, Promises, Site,
    StateBits,
};
pub use dither::{BAYER, BLUE_NOISE, Dither, Ranks, TILE, stratified};
pub use event::{
    Event, EventCounts, Listen, NoProbe, Probe, Record, ReferenceRecord, network_comparators,
};
pub use layout::{Field as LayoutField, Group as LayoutGroup, Layout};
pub use moments::{MomentCount, Moments};
pub use normalise::{Normalise, Sums};
pub use opacity::Threshold;
pub use over_opaque::{Opaque, OverOpaque, Transparent};
pub use pixel_order::{PixelIndex, PixelOrder};
pub use port::{Constant, Declaration, Field, OnDevice, PixelWords, Port, TileWords};
pub use primitive_depths::PrimitiveDepths;
pub use promise::Promise;
pub use reference_value::{Reference, ReferenceKey, prehash, scramble_lk2011};
pub use replay::{
    Engine, ExplainLimits, Explanation, ReplayOptions, Replayed, Step, TileState, Told, Which,
    draw_pixel, explain, replay,
};
pub use samples::{SampleContents, SampleList, Samples, in_sample_order, sort_by_stored_depth};
pub use stochastic::{Round, Sampler, Stochastic};
pub use subset::{random_subset, visible_independent, visible_stratified};
pub use surface::{CoveredMask, SurfaceRule, SurfaceTracker, Tracked};
pub use view_depth::ViewDepth;
