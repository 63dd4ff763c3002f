//! A pixel's state for people.

use serde::Serialize;

use screendoor_trace::trace::Unorm32;

/// A pixel's state for people.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Contents {
    /// What its samples hold, where the design has samples.
    pub samples: Vec<SampleContents>,
    /// Names and values of what else it holds.
    pub fields: Vec<(&'static str, String)>,
}

/// What a sample holds.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct SampleContents {
    /// Its depth.
    pub depth: Unorm32,
    /// Its linear colour.
    pub colour: [f32; 3],
}
