//! LK's claims about sampling: expectation, a study; figure 5 and pixel orders, which count
//! samples and compare rows of pictures and so are none.

use serde::Serialize;

use crate::study::publications::experiment::{Frames, Lab, parse, studies};
use crate::study::publications::{Effort, capture, pictures, replay};
use crate::study::record::Record;
use screendoor_scene::capture::CaptureOptions;
use screendoor_trace::error::Result;
use screendoor_trace::trace::Trace;

/// How many samples a far surface keeps under a near one, both α = 0.5 at 16
/// samples.
#[derive(Clone, Debug, Serialize)]
pub struct FarSamples {
    /// The part of figure 5 that it is.
    pub part: &'static str,
    /// The design.
    pub design: String,
    /// Whether the near surface was drawn first.
    pub near_first: bool,
    /// Fewest and most over the pixels.
    pub range: [u32; 2],
}

/// The mean error of a design over many seeds.
#[derive(Clone, Debug, Serialize)]
pub struct MeanError {
    /// The scene; a built-in one's name begins with `builtin:`.
    pub scene: String,
    /// Frame side in pixels.
    pub side: u32,
    /// The run: mean and error are those over the covered pixels.
    pub run: Record,
}

/// How far even and odd rows of an even surface lie apart.
#[derive(Clone, Debug, Serialize)]
pub struct RowDifference {
    /// The design.
    pub design: String,
    /// Root mean square over seeds and alphas, in 8-bit units.
    pub difference: f64,
}

/// The scene of which expectations are measured at several sample counts: in random order,
/// so that surfaces mix.
pub const MIXED: &str = "builtin:cloth";

/// Mean errors on every scene that there is, at 8 samples with a quarter of the seeds; of
/// [`MIXED`] in a larger frame, at several counts with all seeds.
pub(super) fn means(lab: &Lab<'_>, effort: Effort) -> Result<Vec<MeanError>> {
    let few = (effort.seeds_of_means / 4).max(2);
    let closely = Frames::new(effort.comparison_side, 64, effort.seeds_of_means);
    let briefly = Frames::new(effort.claims_side(), 64, few);
    let mixed = parse(studies::EXPECTATIONS_CLOSELY)?.only(|scene| scene.drawn() == MIXED);
    let mut list = Vec::new();
    for study in [mixed.in_frames(closely), parse(studies::EXPECTATIONS)?.in_frames(briefly)] {
        let results = lab.measure(study)?.results;
        for run in results.records {
            let entry = results.study.scenes.iter().find(|scene| scene.name == run.scene);
            let Some(entry) = entry else { continue };
            list.push(MeanError { scene: entry.title(), side: entry.frame()[0], run });
        }
    }
    Ok(list)
}

/// A trace of `builtin:layers` with parameters.
pub(super) fn layers(spec: &str, side: u32, samples: u32) -> Result<Trace> {
    let options =
        CaptureOptions { width: side, height: side, samples, ..CaptureOptions::default() };
    capture(&format!("builtin:layers:{spec}"), &options, false)
}

pub(super) fn far_samples() -> Result<Vec<FarSamples>> {
    const SAMPLES: u32 = 16;
    let parts = [
        ("a", "lk:sort=false,compact=false", true),
        ("b", "lk:sort=false", true),
        ("c", "lk:sort=false", false),
        ("d", "lk", false),
        ("d", "lk", true),
        ("", "enderton", true),
        ("", "enderton", false),
    ];
    let mut list = Vec::new();
    for (part, design, near_first) in parts {
        let trace = layers(&format!("count=2,alpha=0.5,near-first={near_first}"), 64, SAMPLES)?;
        let picture = replay(design, &trace, SAMPLES, 0)?;
        // Both surfaces are white: what the far one keeps is what is white beyond
        // the near one's half.
        let mut range = [u32::MAX, 0];
        for y in 0..64 {
            for x in 0..64 {
                let white = (picture.picture.get(x, y)[0] * f64::from(SAMPLES)).round() as u32;
                let far = white.saturating_sub(SAMPLES / 2);
                range = [range[0].min(far), range[1].max(far)];
            }
        }
        list.push(FarSamples { part, design: design.to_string(), near_first, range });
    }
    Ok(list)
}

pub(super) fn pixel_orders(effort: Effort) -> Result<Vec<RowDifference>> {
    let specs = [
        "lk",
        "lk:pixel-order=morton",
        "lk:pixel-order=scanline",
        "lk:reference=white",
        "lk:reference=radical-inverse",
        "lk:pixel-order=morton,reference=radical-inverse",
    ];
    let mut list = Vec::new();
    for spec in specs {
        let (mut sum, mut count) = (0.0, 0.0);
        for alpha in [0.1, 0.2, 0.3, 0.45, 0.6] {
            let trace = layers(&format!("count=1,alpha={alpha}"), 128, 4)?;
            for picture in pictures(spec, &trace, 4, effort.seeds_of_means.min(32))? {
                let picture = picture?;
                let mut rows = [0.0; 2];
                for y in 0..128 {
                    rows[y as usize % 2] +=
                        (0..128).map(|x| picture.get(x, y)[0]).sum::<f64>() / (64.0 * 128.0);
                }
                let difference = (rows[0] - rows[1]) * 255.0;
                sum += difference * difference;
                count += 1.0;
            }
        }
        list.push(RowDifference { design: spec.to_string(), difference: f64::sqrt(sum / count) });
    }
    Ok(list)
}
