//! What the raster-operations units share: pixel state, surface tracking, sample
//! order, reference values, event counts, and the replay.

#![warn(missing_docs)]

pub mod blended;
pub mod contract;
pub mod in_lanes;
mod lanes;
pub mod layered;
mod replay;
pub mod resolve;
mod shaders;
pub mod stochastic;
pub mod visibility;

pub use blended::{accumulators, view_depth};
pub use contract::{colour, over_opaque};
pub use layered::layers;
pub use stochastic::{depth_bits, fast, tracked};

pub use blended::accumulators::{Accumulators, Coverage};
pub use blended::blend_buffer::BlendBuffer;
pub use blended::functions;
pub use blended::in_lanes::{SumLanes, Summed};
pub use blended::moments::{Factors, MOST_MOMENTS, MomentCount, Moments, OfMoments};
pub use blended::view_depth::ViewDepth;
pub use contract::blueprint::Blueprint;
pub use contract::colour::ColourStore;
pub use contract::contents::{Contents, SampleContents};
pub use contract::design::Design;
pub use contract::event::{
    Event, EventCounts, Listen, NoProbe, Probe, Record, ReferenceRecord, Remark,
    network_comparators,
};
pub use contract::frame::{Frame, Site};
pub use contract::info::{Family, Info};
pub use contract::layout::{Field as LayoutField, Group as LayoutGroup, Layout, StateBits};
pub use contract::opacity::Threshold;
pub use contract::over_opaque::{Opaque, OverOpaque, Transparent};
pub use contract::port::Port;
pub use contract::primitive_depths::PrimitiveDepths;
pub use contract::promise::Promise;
pub use contract::promises::{OpaquePromise, OrderPromise, Promises};
pub use contract::samples::{SampleList, Samples, in_sample_order, sort_by_stored_depth};
pub use contract::shader::Shader;
pub use contract::tiled::{BlockList, Blocks, Listener, TileState, TiledDesign};
pub use contract::words::{
    Constant, Declaration, Field, OnDevice, PixelWords, Ranks, TILE, TileWords,
};
pub use layered::bounded::{Bounded, Eviction};
pub use layered::in_lanes::{BoundedInLanes, EvictedLanes};
pub use layered::lanes::{ColumnsInLanes, LayerLanes, ListLanes};
pub use layered::normalise::{Normalise, VisibilitySums};
pub use replay::{
    ExplainLimits, Explanation, Implementation, ReplayOptions, Replayed, Step, draw_pixel, explain,
    replay,
};
pub use shaders::SHADERS;
pub use stochastic::dither::{BAYER, BLUE_NOISE, Dither, stratified};
pub use stochastic::pixel_order::{PixelIndex, PixelOrder};
pub use stochastic::reference_value::{Reference, ReferenceKey, prehash, scramble_lk2011};
pub use stochastic::subset::{random_subset, visible_independent, visible_stratified};
pub use stochastic::surface::{CoveredMask, SurfaceRule, SurfaceTracker, Tracked};
pub use stochastic::{Round, Sampler, Stochastic};
pub use visibility::VisibilityMap;
