//! Samplers that renderers of Gaussian splats ship, beside those of this registry, and what keeps
//! layers, on files of splats.

use crate::study::publications::Effort;
use crate::study::publications::beyond::Beyond;
use crate::study::publications::experiment::{Frames, Lab, parse, studies};
use screendoor_trace::error::Result;

/// Measures them: half as many seeds as expectations have, in frames of two thirds of the
/// comparison's side.
///
/// # Errors
/// As [`Lab`] measures.
pub fn splats(lab: &Lab<'_>, effort: Effort) -> Result<Beyond> {
    let side = (effort.comparison_side * 2 / 3).max(16);
    let frames = Frames::new(side, 64, effort.seeds_of_means.div_ceil(2).max(2));
    let found = lab.measure(parse(studies::SPLATS)?.in_frames(frames))?;
    Ok(Beyond { side, results: found.results, missing: found.missing })
}
