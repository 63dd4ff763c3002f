//! The width of the depth buffer, a parameter of designs that have one.

use crate::param::{Param, Values};

crate::options! {
    /// How many bits a stored depth has.
    pub enum DepthBits {
        Full = "32": "as the trace has them",
        Medium = "24": "the upper 24",
        Narrow = "16": "the upper 16",
    }
}

/// The parameter's declaration.
pub const PARAM: Param = Param::choice::<DepthBits>("depth-bits", "32", "bits of a stored depth");

/// The parameter's value: 32, 24 or 16.
pub fn of(values: &Values) -> u32 {
    match values.choice(PARAM.name) {
        DepthBits::Full => 32,
        DepthBits::Medium => 24,
        DepthBits::Narrow => 16,
    }
}
