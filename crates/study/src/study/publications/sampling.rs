//! LK's claims about sampling: expectation, figure 5, pixel orders.

use std::path::Path;

use serde::Serialize;

use crate::metrics::{Ensemble, Estimate, PixelClasses};
use crate::study::comparison::SceneSpec;
use crate::study::publications::{Effort, capture, replay};
use screendoor_designs::configure;
use screendoor_scene::capture::{Capture, CaptureOptions};
use screendoor_trace::error::Result;
use screendoor_trace::trace::{Trace, tied_fragments};

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
    pub scene: &'static str,
    /// Frame side in pixels.
    pub side: u32,
    /// How many seeds.
    pub seeds: u32,
    /// The design.
    pub design: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether it is declared unbiased.
    pub unbiased: bool,
    /// Mean of picture minus exact over the covered pixels, in 8-bit units.
    pub mean: Estimate,
    /// Root of the mean square error.
    pub rmse: Estimate,
}

/// How far even and odd rows of an even surface lie apart.
#[derive(Clone, Debug, Serialize)]
pub struct RowDifference {
    /// The design.
    pub design: String,
    /// Root mean square over seeds and alphas, in 8-bit units.
    pub difference: f64,
}

/// The designs whose expectations are measured.
const MEAN_DESIGNS: [&str; 7] = [
    "lk",
    "lk:track=covered",
    "lk:surfaces=every-fragment",
    "lk:sort=false,compact=false",
    "lk:reference=white",
    "enderton",
    "enderton:mask=naive",
];

/// The scene of which expectations are measured at several sample counts: in random order,
/// so that surfaces mix.
pub const MIXED: &str = "builtin:cloth";

/// Mean errors on every scene that there is, at 8 samples with a quarter of the seeds; of
/// [`MIXED`] in a larger frame, at several counts with all seeds.
pub(super) fn means(
    models: Option<&Path>,
    effort: Effort,
    progress: &mut dyn FnMut(&str, u64, u64),
) -> Result<Vec<MeanError>> {
    let mut list = Vec::new();
    let few = (effort.seeds_of_means / 4).max(2);
    let closely = (effort.comparison_side, effort.seeds_of_means, [4, 8, 16, 64].as_slice());
    let briefly = (effort.claims_side(), few, [8].as_slice());
    let mixed = SceneSpec::all(models).filter(|spec| spec.label() == MIXED);
    let each = SceneSpec::all(models).map(|spec| (spec, briefly));
    let all = mixed.map(|spec| (spec, closely)).chain(each);
    let total = SceneSpec::all(models).count() as u64 + 1;
    for (done, (spec, (side, seeds, counts))) in all.enumerate() {
        progress(&format!("expectations: {}", spec.label()), done as u64, total);
        let Some(scene) = spec.load(models)? else { continue };
        let options = CaptureOptions { samples: 64, ..spec.options(side) };
        let trace = Capture::new(&scene, &options)?.to_memory(|_, _| ())?;
        for samples in counts {
            let exact = replay("exact", &trace, *samples, 0)?.picture;
            let covered = PixelClasses::of(&trace, *samples)?.covered;
            let tied = tied_fragments(&trace, *samples)?;
            for variant in MEAN_DESIGNS {
                let mut ensemble = Ensemble::new(&exact, &[&covered]);
                for seed in 0..seeds {
                    ensemble.add(&replay(variant, &trace, *samples, seed)?.picture);
                }
                let design = configure(variant, &[])?;
                let e = &ensemble.finish()[0];
                list.push(MeanError {
                    scene: spec.label(),
                    side,
                    seeds,
                    design: design.label(),
                    samples: *samples,
                    unbiased: design.promises().unbiased.holds(tied),
                    mean: e.mean,
                    rmse: e.rmse,
                });
            }
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
            for seed in 0..effort.seeds_of_means.min(32) {
                let picture = replay(spec, &trace, 4, seed)?.picture;
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
