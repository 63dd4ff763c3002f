//! A pixel's story as a document.

use serde::Serialize;

use crate::design::Configured;
use crate::error::Result;
use crate::param::Values;
use crate::rop::{Explanation, Site};
use crate::trace::Trace;

/// What a design does at one pixel, with all that names the run: what
/// `screendoor explain --json` writes.
#[derive(Debug, Serialize)]
pub struct Explained<'a> {
    /// The trace.
    pub trace: &'a str,
    /// The design's name.
    pub design: &'a str,
    /// Its parameters.
    pub parameters: &'a Values,
    /// Column and row.
    pub pixel: [u16; 2],
    /// Samples per pixel.
    pub samples: u32,
    /// The seed.
    pub seed: u32,
    /// Fragment by fragment. Passes that do not look at a fragment are left out.
    #[serde(flatten)]
    pub explanation: Explanation,
}

impl<'a> Explained<'a> {
    /// Replays the pixel. `place` names the trace; `progress` is told rows.
    ///
    /// # Errors
    /// As [`Configured::explain`].
    pub fn of(
        design: &'a Configured,
        (trace, place): (&Trace, &'a str),
        samples: u32,
        seed: u32,
        site: Site,
        progress: &dyn Fn(u64, u64),
    ) -> Result<Self> {
        let mut explanation = design.explain(trace, samples, seed, site, progress)?;
        // A pass for opaque fragments does not look at the others.
        let passes = explanation.passes();
        explanation.steps.retain(|step| passes == 1 || !step.record.is_idle());
        Ok(Explained {
            trace: place,
            design: design.info().name,
            parameters: design.values(),
            pixel: [site.x, site.y],
            samples,
            seed,
            explanation,
        })
    }
}
