//! The width of the depth buffer, a parameter of designs that have one.

use screendoor_trace::param::{Typed, Values};

screendoor_trace::options! {
    /// How many bits a stored depth has.
    pub enum DepthBits {
        Full = "32": "as the trace has them",
        Medium = "24": "the upper 24",
        Narrow = "16": "the upper 16",
    }
}

/// The parameter's declaration.
pub const PARAM: Typed<DepthBits> = Typed::choice("depth-bits", "32", "bits of a stored depth");

/// Whether all depths that the trace tells apart are told apart when stored. Where
/// they are not, the surface drawn last hides one slightly nearer: no promise holds.
pub fn tells_apart(values: &Values) -> bool {
    of(values) == 32
}

/// The parameter's value: 32, 24 or 16.
pub fn of(values: &Values) -> u32 {
    match values.get(PARAM) {
        DepthBits::Full => 32,
        DepthBits::Medium => 24,
        DepthBits::Narrow => 16,
    }
}
