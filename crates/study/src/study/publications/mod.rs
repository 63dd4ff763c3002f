//! The experiments of Laine and Karras 2011, on scenes that we have.

pub mod beyond;
pub mod claims;
pub mod costs;
pub mod examples;
pub mod experiment;
mod figures;
pub mod hashes;
pub mod methods;
mod noise;
pub mod programs;
mod reproduced;
mod sampling;
pub mod screen_door;
pub mod shadows;
pub mod splats;
mod table_1;

use serde::Serialize;

pub use figures::NamedPicture;
pub use noise::{BLOCKS, CORRELATION_SEEDS, EdgeNoise, FigureNoise, Noise};
pub use reproduced::{Reproduced, measure_publication};
pub use sampling::{FarSamples, MIXED, MeanError, RowDifference};
pub use table_1::{Aspect, COUNTS, DESIGNS, Published, Table1, Variation};

use crate::study::engine::FAST;
use crate::study::measure::replays;
use crate::study::publications::experiment::Lab;
use screendoor_designs::configure;
use screendoor_rop::{ReplayOptions, Replayed};
pub use screendoor_scene::capture::Order;
use screendoor_scene::capture::{Capture, CaptureOptions, PatternKind, pattern};
use screendoor_scene::scene;
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;
use screendoor_trace::trace::{
    ColourFormat, DepthPlane, Fragment, Header, SampleMask, SamplePattern, Trace, TraceWriter,
    Unorm32, WriteOptions,
};

/// How much to spend.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Effort {
    /// Seeds of each run of table 1.
    pub seeds: u32,
    /// Seeds of each expectation.
    pub seeds_of_means: u32,
    /// Frame side in pixels of table 1.
    pub side: u32,
    /// Frame side in pixels of what all scenes are tried for: the comparison of all
    /// designs, Wyman's claim, the views of table 1; with half of it what is said of variants.
    pub comparison_side: u32,
    /// Only what the publications print or claim, on built-in scenes: no other views, no
    /// expectations, no pixel orders, no hashes, no gallery.
    pub brief: bool,
}

impl Effort {
    /// What goes with every study: the publications' own figures within a minute on two
    /// cores, all of them together.
    pub const fn brief() -> Self {
        Effort { seeds: 4, seeds_of_means: 16, side: 384, comparison_side: 96, brief: true }
    }
}

/// Everything that is reproduced.
#[derive(Debug)]
pub struct Publications {
    /// What was spent.
    pub effort: Effort,
    /// Table 1 on one scene after the other.
    pub table_1: Vec<Table1>,
    /// Scenes of table 1 whose models were not given.
    pub missing: Vec<String>,
    /// The ratio of table 1 on every scene, seen in several ways; none where brief.
    pub variations: Vec<Variation>,
    /// Figure 5: samples left to the far surface.
    pub far_samples: Vec<FarSamples>,
    /// Mean errors of `lk` and its ablations on every scene; none where brief.
    pub means: Vec<MeanError>,
    /// Row structure of the pixel orders; none where brief.
    pub pixel_orders: Vec<RowDifference>,
    /// Noise of figures 1, 3 and 6.
    pub noise: FigureNoise,
    /// The built-in scenes, composited exactly; none where brief.
    pub gallery: Vec<(String, Picture)>,
    /// Pictures by name.
    pub pictures: Vec<NamedPicture>,
}

/// Runs all experiments.
///
/// # Errors
/// As [`Lab`] measures.
pub fn reproduce(lab: &Lab<'_>, effort: Effort) -> Result<Publications> {
    let (table_1, missing) = table_1::tables(lab, effort)?;
    let (variations, means) = match effort.brief {
        true => (Vec::new(), Vec::new()),
        false => (table_1::vary(lab, effort)?, sampling::means(lab, effort)?),
    };
    (lab.watch)("figures", 0, 1);
    let (pictures, noise) = figures::figures(lab, effort)?;
    let (pixel_orders, gallery) = match effort.brief {
        true => (Vec::new(), Vec::new()),
        false => (sampling::pixel_orders(effort)?, figures::gallery()?),
    };
    Ok(Publications {
        effort,
        table_1,
        missing,
        variations,
        far_samples: sampling::far_samples()?,
        means,
        pixel_orders,
        noise,
        gallery,
        pictures,
    })
}

/// Bytes that the exact answer's fragments may take at a time.
const MEMORY: u64 = 1 << 30;

fn capture(source: &str, options: &CaptureOptions, white: bool) -> Result<Trace> {
    let mut scene = scene::load(source)?;
    if white {
        scene.whiten();
    }
    Capture::new(&scene, options)?.to_memory(|_, _| ())
}

/// A trace of whole layers, nearest first, over every pixel of a square frame; the
/// nearest is the first primitive and is drawn first.
fn whole_layers(
    side: u32,
    samples: u32,
    background: [f32; 3],
    layers: &[([f32; 3], f32)],
) -> Result<Trace> {
    let depths = (1..).map(|i: u32| Unorm32(i << 24));
    let layers = depths.zip(layers).map(|(z, (colour, alpha))| (z, *colour, *alpha));
    layers_at(side, pattern(PatternKind::Standard, samples)?, background, layers)
}

/// A trace of whole layers at these depths, with their colours and alphas, drawn in this order.
fn layers_at(
    side: u32,
    pattern: SamplePattern,
    background: [f32; 3],
    layers: impl Iterator<Item = (Unorm32, [f32; 3], f32)>,
) -> Result<Trace> {
    let coverage = SampleMask::first(pattern.samples());
    let header = Header {
        width: side,
        height: side,
        pattern,
        background,
        colour: ColourFormat::F32,
        source: "whole layers".to_string(),
        camera: "none".to_string(),
        ..Header::default()
    };
    let mut writer = TraceWriter::new(Vec::new(), "memory", header, WriteOptions::default())?;
    for (i, (z, colour, alpha)) in layers.enumerate() {
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            writer.push(&Fragment {
                x: x as u16,
                y: y as u16,
                coverage,
                depth: DepthPlane { z, dzdx: 0, dzdy: 0 },
                colour,
                alpha,
                primitive: i as u32,
                object: i as u32,
                ..Fragment::default()
            })?;
        }
    }
    Trace::from_bytes(writer.finish()?.0, "memory")
}

fn replay(spec: &str, trace: &Trace, samples: u32, seed: u32) -> Result<Replayed> {
    configure(spec, &[])?.replay(trace, samples, seed, &options())
}

fn options() -> ReplayOptions<'static> {
    ReplayOptions { memory: MEMORY, ..ReplayOptions::default() }
}

/// A design's pictures, seed after seed.
fn pictures<'a>(
    spec: &str,
    trace: &'a Trace,
    samples: u32,
    seeds: u32,
) -> Result<impl Iterator<Item = Result<Picture>> + 'a> {
    let design = configure(spec, &[])?;
    Ok(replays(FAST, design, trace, samples, 0..seeds, options())
        .map(|seed| Ok(seed?.replayed.picture)))
}
