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

impl Contents {
    /// A list as a value of a field: whoever shows it may part it at '; '.
    pub fn list(items: impl IntoIterator<Item = String>) -> String {
        let items: Vec<String> = items.into_iter().collect();
        if items.is_empty() { "none".into() } else { items.join("; ") }
    }
}

/// What a sample holds.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct SampleContents {
    /// Its depth.
    pub depth: Unorm32,
    /// Its colour, as the trace has them.
    pub colour: [f32; 3],
}
