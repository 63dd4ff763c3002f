//! Captures of other programs: what the Vulkan layer recorded, as traces.

#[doc(inline)]
pub use screendoor_trace::{error, output, param, picture, trace};
