//! A pixel's story as a document.

use serde::Serialize;

use screendoor_designs::Configured;
use screendoor_rop::{ExplainLimits, Explanation, Site};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::picture::Space;
use screendoor_trace::trace::Trace;

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
    /// What the numbers of colours stand for, where it is not light.
    #[serde(skip_serializing_if = "Space::is_linear")]
    pub space: Space,
    /// Fragment by fragment. Passes that do not look at a fragment are left out.
    #[serde(flatten)]
    pub explanation: Explanation,
}

impl<'a> Explained<'a> {
    /// Replays the pixel, within `limits`. `place` names the trace; `progress` is told rows.
    ///
    /// # Errors
    /// As [`Configured::explain`].
    pub fn of(
        design: &'a Configured,
        (trace, place): (&Trace, &'a str),
        samples: u32,
        seed: u32,
        site: Site,
        limits: ExplainLimits,
        progress: &dyn Fn(u64, u64),
    ) -> Result<Self> {
        let limits = ExplainLimits { idle: false, ..limits };
        let explanation = design.explain_within(trace, samples, seed, site, limits, progress)?;
        Ok(Explained {
            trace: place,
            design: design.info().name,
            parameters: design.values(),
            pixel: [site.x, site.y],
            samples,
            seed,
            space: trace.header().space,
            explanation,
        })
    }
}
