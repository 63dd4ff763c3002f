//! This project's own designs, `residual` and `merging`, beside those that they grew from: error
//! and bias over many seeds on every scene that there is.

use crate::study::publications::Effort;
use crate::study::publications::experiment::{Frames, Lab, parse, studies};
use crate::study::results::Results;
use screendoor_trace::error::Result;

/// What was measured.
#[derive(Debug)]
pub struct Beyond {
    /// Frame side in pixels.
    pub side: u32,
    /// What the study has, over so many seeds as it says.
    pub results: Results,
    /// Models that were not given.
    pub missing: Vec<String>,
}

/// Measures them: half as many seeds as expectations have, in frames of two thirds of the
/// comparison's side.
///
/// # Errors
/// As [`Lab`] measures.
pub fn beyond(lab: &Lab<'_>, effort: Effort) -> Result<Beyond> {
    let side = (effort.comparison_side * 2 / 3).max(16);
    let frames = Frames::new(side, 64, effort.seeds_of_means.div_ceil(2).max(2));
    let found = lab.measure(parse(studies::BEYOND)?.in_frames(frames))?;
    Ok(Beyond { side, results: found.results, missing: found.missing })
}
