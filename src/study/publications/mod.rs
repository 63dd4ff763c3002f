//! The experiments of Laine and Karras 2011, on scenes that we have.

pub mod examples;
mod figures;
pub mod hashes;
pub mod methods;
mod sampling;
mod table_1;

use std::path::Path;

use serde::Serialize;

pub use figures::{BLOCKS, Dithering, NamedPicture};
pub use sampling::{FarSamples, MeanError, RowDifference};
pub use table_1::{Aspect, COUNTS, DESIGNS, Published, Table1, Variation};

pub use crate::capture::Order;
use crate::capture::{Capture, CaptureOptions, PatternKind, pattern};
use crate::design::{Configured, configure};
use crate::error::Result;
use crate::picture::Picture;
use crate::rop::{ReplayOptions, Replayed};
use crate::scene;
use crate::trace::{
    ColourFormat, DepthPlane, Fragment, Header, SampleMask, Trace, TraceWriter, Unorm32,
    WriteOptions,
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
}

/// Everything that is reproduced.
#[derive(Debug)]
pub struct Publications {
    /// What was spent.
    pub effort: Effort,
    /// Table 1 on one scene after the other.
    pub table_1: Vec<Table1>,
    /// Scenes of table 1 whose models were not given.
    pub missing: Vec<&'static str>,
    /// The ratio of table 1 as the scene is seen otherwise.
    pub variations: Vec<Variation>,
    /// Figure 5: samples left to the far surface.
    pub far_samples: Vec<FarSamples>,
    /// Mean errors of `lk` and its ablations.
    pub means: Vec<MeanError>,
    /// Row structure of the pixel orders.
    pub pixel_orders: Vec<RowDifference>,
    /// Noise of figure 1's ramps, averaged over blocks of pixels.
    pub dithering: Vec<Dithering>,
    /// The built-in scenes, composited exactly.
    pub gallery: Vec<(String, Picture)>,
    /// Pictures by name.
    pub pictures: Vec<NamedPicture>,
}

/// Runs all experiments. Models are looked for in the folder `models`.
/// `progress` is told what runs.
///
/// # Errors
/// As [`scene::load`] and [`Configured::replay`].
pub fn reproduce(
    models: Option<&Path>,
    effort: Effort,
    mut progress: impl FnMut(&str, u64, u64),
) -> Result<Publications> {
    let (mut tables, mut variations, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    let mut means = Vec::new();
    for spec in table_1::SCENES {
        let Some(source) = spec.locate(models) else {
            missing.push(spec.source);
            continue;
        };
        tables.push(spec.measure(&source, effort, &mut progress)?);
        variations.extend(spec.vary(&source, effort, &mut progress)?);
        // Expectations on the first scene in random order: there surfaces mix.
        if spec.stands_for == Published::Cloth && means.is_empty() {
            let trace = capture(&source, &spec.options(256), spec.white)?;
            means = sampling::means(&trace, effort, &mut progress)?;
        }
    }
    progress("figures", 0, 1);
    let (pictures, dithering) = figures::figures(effort)?;
    Ok(Publications {
        effort,
        table_1: tables,
        missing,
        variations,
        far_samples: sampling::far_samples()?,
        means,
        pixel_orders: sampling::pixel_orders(effort)?,
        dithering,
        gallery: figures::gallery()?,
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
    let header = Header {
        width: side,
        height: side,
        pattern: pattern(PatternKind::Standard, samples)?,
        background,
        colour: ColourFormat::F32,
        source: format!("{} whole layers", layers.len()),
        camera: "none".to_string(),
        constants: Default::default(),
    };
    let mut writer = TraceWriter::new(Vec::new(), "memory", header, WriteOptions::default())?;
    for (i, (colour, alpha)) in layers.iter().enumerate() {
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            writer.push(&Fragment {
                x: x as u16,
                y: y as u16,
                coverage: SampleMask::first(samples),
                depth: DepthPlane { z: Unorm32((i as u32 + 1) << 24), dzdx: 0, dzdy: 0 },
                colour: *colour,
                alpha: *alpha,
                primitive: i as u32,
                object: i as u32,
            })?;
        }
    }
    Trace::from_bytes(writer.finish()?.0, "memory")
}

fn designs(specs: &[&str]) -> Result<Vec<Configured>> {
    specs.iter().map(|spec| configure(spec, &[])).collect()
}

fn replay(spec: &str, trace: &Trace, samples: u32, seed: u32) -> Result<Replayed> {
    let options = ReplayOptions { memory: MEMORY, ..ReplayOptions::default() };
    configure(spec, &[])?.replay(trace, samples, seed, &options)
}
