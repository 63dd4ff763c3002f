//! The experiments of Laine and Karras 2011, on scenes that we have.

use std::path::Path;

use serde::Serialize;

use crate::capture::{CameraOptions, Capture, CaptureOptions, Faces, Order};
use crate::design::{Configured, configure};
use crate::error::Result;
use crate::metrics::{Ensemble, Estimate, PixelClasses, Region, errors};
use crate::picture::Picture;
use crate::rop::{ReplayOptions, Replayed};
use crate::scene;
use crate::study::{Plan, Run, measure};
use crate::tile::TileGrid;
use crate::trace::{Statistics, Trace, statistics};

/// Sample counts of LK's table 1.
pub const COUNTS: [u32; 5] = [4, 8, 16, 32, 64];
/// The designs of our table: LK's own, the comparison as it describes it, and
/// sampling without any stratification.
pub const DESIGNS: [&str; 3] = ["lk", "enderton", "enderton:mask=naive"];

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
    pub pictures: Vec<(&'static str, Picture)>,
}

/// A scene of table 1 and how it is captured.
#[derive(Clone, Copy, Debug)]
struct Table1Scene {
    name: &'static str,
    /// A built-in scene, or a file in the models' folder.
    source: &'static str,
    origin: &'static str,
    stands_for: Published,
    alpha: f32,
    white: bool,
    order: Order,
}

/// Which column of the published table a scene stands beside.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub enum Published {
    /// White, untextured, α = 0.3.
    Motor,
    /// Textured, α = 0.4, triangles in random order.
    Cloth,
}

impl Published {
    /// RMSE of LK and of its comparison at [`COUNTS`] (LK table 1).
    pub fn rmse(self) -> [[f64; 2]; 5] {
        match self {
            Published::Motor => [[29.5, 36.3], [17.9, 25.3], [10.3, 17.2], [6.3, 12.1], [4.0, 8.7]],
            Published::Cloth => [[17.0, 19.3], [9.7, 12.3], [5.6, 8.4], [3.3, 5.8], [2.0, 4.1]],
        }
    }
}

const SCENES: [Table1Scene; 4] = [
    Table1Scene {
        name: "cycloidal",
        source: "cycloidal.glb",
        origin: "CAD motor, 376 520 triangles (trimesh repository, MIT)",
        stands_for: Published::Motor,
        alpha: 0.3,
        white: true,
        order: Order::Api,
    },
    Table1Scene {
        name: "engine",
        source: "builtin:engine",
        origin: "built-in",
        stands_for: Published::Motor,
        alpha: 0.3,
        white: true,
        order: Order::Api,
    },
    Table1Scene {
        name: "drape",
        source: "codimipc_multilayer_drape.obj",
        origin: "multi-layer garment, 84 159 triangles, untextured (Codim-IPC repository, Apache-2.0)",
        stands_for: Published::Cloth,
        alpha: 0.4,
        white: false,
        order: Order::Random,
    },
    Table1Scene {
        name: "cloth",
        source: "builtin:cloth",
        origin: "built-in",
        stands_for: Published::Cloth,
        alpha: 0.4,
        white: false,
        order: Order::Random,
    },
];

/// Table 1 on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct Table1 {
    /// A short name.
    pub name: &'static str,
    /// Where the scene comes from.
    pub origin: &'static str,
    /// What it stands beside.
    pub stands_for: Published,
    /// Its trace in numbers.
    pub statistics: Statistics,
    /// Runs of [`DESIGNS`], sample count after sample count.
    pub runs: Vec<Run>,
}

/// One way to see a scene, at 16 samples.
#[derive(Clone, Debug, Serialize)]
pub struct Variation {
    /// Which scene.
    pub scene: &'static str,
    /// What differs.
    pub what: String,
    /// Fragments per covered pixel.
    pub fragments_per_pixel: f64,
    /// Share of the covered pixels that an edge crosses.
    pub edge_share: f64,
    /// RMSE over the covered pixels of [`DESIGNS`].
    pub rmse: [Estimate; 3],
}

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

/// Error that is left when pixels are averaged over square blocks.
#[derive(Clone, Debug, Serialize)]
pub struct Dithering {
    /// The design.
    pub design: String,
    /// RMSE over blocks of [`BLOCKS`] pixels a side.
    pub rmse: [f64; 4],
}

/// Sides of the blocks of [`Dithering`].
pub const BLOCKS: [u32; 4] = [1, 2, 4, 8];

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
    let mut publications = Publications {
        effort,
        table_1: Vec::new(),
        missing: Vec::new(),
        variations: Vec::new(),
        far_samples: far_samples()?,
        means: Vec::new(),
        pixel_orders: pixel_orders(effort)?,
        dithering: Vec::new(),
        gallery: gallery()?,
        pictures: Vec::new(),
    };
    for spec in SCENES {
        let Some(source) = locate(spec.source, models) else {
            publications.missing.push(spec.source);
            continue;
        };
        let base = spec.options(effort.side);
        let trace = capture(&source, &base, spec.white)?;
        let plan =
            Plan { designs: designs(&DESIGNS)?, samples: COUNTS.to_vec(), seeds: effort.seeds };
        let measured = measure(&trace, &plan, MEMORY, |what, done, total| {
            progress(&format!("{}: {what}", spec.name), done, total);
        })?;
        publications.table_1.push(Table1 {
            name: spec.name,
            origin: spec.origin,
            stands_for: spec.stands_for,
            statistics: statistics(&trace, |_| ())?,
            runs: measured.runs.into_iter().map(|m| m.run).collect(),
        });
        for (i, (what, options)) in variations(&base).into_iter().enumerate() {
            progress(&format!("{}: {what}", spec.name), i as u64, 11);
            let variation = vary(&spec, &source, what, &options, effort)?;
            publications.variations.push(variation);
        }
        if spec.stands_for == Published::Cloth {
            progress(&format!("{}: expectations", spec.name), 0, 1);
            let options = CaptureOptions { width: 256, height: 256, ..base };
            let trace = capture(&source, &options, spec.white)?;
            if publications.means.is_empty() {
                publications.means = means(&trace, effort, &mut progress)?;
            }
        }
    }
    progress("figures", 0, 1);
    figures(&mut publications, effort)?;
    Ok(publications)
}

/// Bytes that the exact answer's fragments may take at a time.
const MEMORY: u64 = 1 << 30;

impl Table1Scene {
    fn options(&self, side: u32) -> CaptureOptions {
        CaptureOptions {
            width: side,
            height: side,
            alpha: Some(self.alpha),
            faces: Faces::Both,
            order: self.order,
            ..CaptureOptions::default()
        }
    }
}

fn locate(source: &str, models: Option<&Path>) -> Option<String> {
    if source.starts_with("builtin:") {
        return Some(source.to_string());
    }
    let path = models?.join(source);
    path.is_file().then(|| path.display().to_string())
}

fn capture(source: &str, options: &CaptureOptions, white: bool) -> Result<Trace> {
    let mut scene = scene::load(source)?;
    if white {
        scene.whiten();
    }
    Capture::new(&scene, options)?.to_memory(|_, _| ())
}

fn designs(specs: &[&str]) -> Result<Vec<Configured>> {
    specs.iter().map(|spec| configure(spec, &[])).collect()
}

fn replay(spec: &str, trace: &Trace, samples: u32, seed: u32) -> Result<Replayed> {
    let options = ReplayOptions { memory: MEMORY, ..ReplayOptions::default() };
    configure(spec, &[])?.replay(trace, samples, seed, &options)
}

/// Other ways to see a scene: angles, sizes, orders, backgrounds.
fn variations(base: &CaptureOptions) -> Vec<(String, CaptureOptions)> {
    let mut list = vec![("as above".to_string(), base.clone())];
    for yaw in [120.0, 210.0, 300.0] {
        let camera = CameraOptions { angle: Some([yaw, 20.0]), ..base.camera };
        list.push((format!("from {yaw}°"), CaptureOptions { camera, ..base.clone() }));
    }
    for part in [2, 4, 8] {
        let (width, height) = (base.width / part, base.height / part);
        let what = format!("{width}×{height} pixels");
        list.push((what, CaptureOptions { width, height, ..base.clone() }));
    }
    for (what, order) in [
        ("triangles in API order", Order::Api),
        ("triangles in random order", Order::Random),
        ("near to far", Order::NearToFar),
        ("far to near", Order::FarToNear),
    ] {
        if order != base.order {
            list.push((what.to_string(), CaptureOptions { order, ..base.clone() }));
        }
    }
    let white = CaptureOptions { background: Some([1.0; 3]), ..base.clone() };
    list.push(("white background".to_string(), white));
    list
}

fn vary(
    spec: &Table1Scene,
    source: &str,
    what: String,
    options: &CaptureOptions,
    effort: Effort,
) -> Result<Variation> {
    const SAMPLES: u32 = 16;
    let trace = capture(source, options, spec.white)?;
    let classes = PixelClasses::of(&trace, SAMPLES)?;
    let exact = replay("exact", &trace, SAMPLES, 0)?.picture;
    let mut rmse = Vec::new();
    let mut fragments = 0;
    for design in DESIGNS {
        let mut squares = Vec::new();
        for seed in 0..effort.seeds {
            let replayed = replay(design, &trace, SAMPLES, seed)?;
            let e = errors(&replayed.picture, &exact, &classes.covered).rmse;
            squares.push(e * e);
        }
        rmse.push(Estimate::of(&squares).sqrt());
    }
    for batch in trace.batches() {
        let mask = crate::trace::SampleMask::first(SAMPLES);
        let batch = batch?;
        fragments += (0..batch.len()).filter(|i| !(batch.coverage(*i) & mask).is_empty()).count();
    }
    let covered = classes.covered.pixels().max(1) as f64;
    Ok(Variation {
        scene: spec.name,
        what,
        fragments_per_pixel: fragments as f64 / covered,
        edge_share: classes.edges.pixels() as f64 / covered,
        rmse: rmse.try_into().expect("one a design"),
    })
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

fn means(
    trace: &Trace,
    effort: Effort,
    progress: &mut impl FnMut(&str, u64, u64),
) -> Result<Vec<MeanError>> {
    let mut list = Vec::new();
    let counts = [4, 8, 16, 64];
    let total = (counts.len() * MEAN_DESIGNS.len()) as u64;
    for samples in counts {
        let exact = replay("exact", trace, samples, 0)?.picture;
        let covered = PixelClasses::of(trace, samples)?.covered;
        for spec in MEAN_DESIGNS {
            progress(&format!("expectation of {spec} at {samples}"), list.len() as u64, total);
            let mut ensemble = Ensemble::new(&exact, &[&covered]);
            for seed in 0..effort.seeds_of_means {
                ensemble.add(&replay(spec, trace, samples, seed)?.picture);
            }
            let design = configure(spec, &[])?;
            let e = &ensemble.finish()[0];
            list.push(MeanError {
                design: design.label(),
                samples,
                unbiased: design.promises().unbiased,
                mean: e.mean,
                rmse: e.rmse,
            });
        }
    }
    Ok(list)
}

fn layers(spec: &str, side: u32, samples: u32) -> Result<Trace> {
    let options =
        CaptureOptions { width: side, height: side, samples, ..CaptureOptions::default() };
    capture(&format!("builtin:layers:{spec}"), &options, false)
}

fn far_samples() -> Result<Vec<FarSamples>> {
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

fn pixel_orders(effort: Effort) -> Result<Vec<RowDifference>> {
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

/// Every built-in scene that looks like something, small.
fn gallery() -> Result<Vec<(String, Picture)>> {
    const SIDE: u32 = 300;
    let scenes = scene::builtin::BUILTINS.iter().filter(|b| b.name != "layers");
    scenes
        .map(|builtin| {
            let options = CaptureOptions {
                width: SIDE,
                height: SIDE,
                samples: 16,
                ..CaptureOptions::default()
            };
            let trace = capture(&format!("builtin:{}", builtin.name), &options, false)?;
            Ok((format!("`{}`", builtin.name), replay("exact", &trace, 16, 0)?.picture))
        })
        .collect()
}

/// The picture averaged over blocks of `side` × `side` pixels.
fn averaged(picture: &Picture, side: u32) -> Picture {
    let grid = TileGrid::new(picture.width() / side, picture.height() / side);
    Picture::from_fn(grid, |x, y| {
        let mut sum = [0.0; 3];
        for (dx, dy) in (0..side).flat_map(|dy| (0..side).map(move |dx| (dx, dy))) {
            let colour = picture.get(x * side + dx, y * side + dy);
            sum.iter_mut().zip(colour).for_each(|(s, c)| *s += c);
        }
        sum.map(|s| s / f64::from(side * side))
    })
}

/// A rectangle of a picture.
fn crop(picture: &Picture, [x0, y0]: [u32; 2], side: u32) -> Picture {
    Picture::from_fn(TileGrid::new(side, side), |x, y| picture.get(x0 + x, y0 + y))
}

fn figures(publications: &mut Publications, effort: Effort) -> Result<()> {
    let pictures = &mut publications.pictures;
    // Figure 1, left: the ramps.
    let options =
        CaptureOptions { width: 256, height: 256, samples: 16, ..CaptureOptions::default() };
    let ramps = capture("builtin:ramps", &options, false)?;
    let exact = replay("exact", &ramps, 16, 0)?.picture;
    for (name, spec) in [("figure-1-enderton", "enderton"), ("figure-1-lk", "lk")] {
        let picture = replay(spec, &ramps, 16, 0)?.picture;
        let rmse = BLOCKS.map(|side| {
            let (a, b) = (averaged(&picture, side), averaged(&exact, side));
            errors(&a, &b, &Region::frame(a.grid())).rmse
        });
        publications.dithering.push(Dithering { design: spec.to_string(), rmse });
        pictures.push((name, picture));
    }
    // Figure 3: eight white layers of alpha 0.1 at 8 samples.
    let eight = layers("count=8,alpha=0.1", 128, 8)?;
    for (name, spec) in [
        ("figure-3-lk2011", "lk"),
        ("figure-3-sobol", "lk:reference=sobol"),
        ("figure-3-sobol-static", "lk:reference=sobol,sort=false,compact=false"),
        ("figure-3-lk2011-static", "lk:sort=false,compact=false"),
        ("figure-3-radical-inverse", "lk:reference=radical-inverse,sort=false,compact=false"),
        ("figure-3-white", "lk:reference=white"),
    ] {
        pictures.push((name, replay(spec, &eight, 8, 0)?.picture));
    }
    // Figures 1, right, 6 and 10: the cloth, triangles in random order.
    let side = effort.side;
    let spec = SCENES.iter().find(|s| s.source == "builtin:cloth").expect("it is in the list");
    let cloth = capture(spec.source, &spec.options(side), false)?;
    let inset = [side * 3 / 8, side * 5 / 16];
    let corner = |p: &Picture| crop(p, inset, side / 4);
    pictures.push(("cloth-exact", replay("exact", &cloth, 64, 0)?.picture));
    for (name, spec, samples) in [
        ("figure-1-cloth-enderton", "enderton", 64),
        ("figure-1-cloth-lk", "lk", 64),
        ("figure-6-unsorted", "lk:sort=false", 16),
        ("figure-6-sorted", "lk", 16),
    ] {
        pictures.push((name, corner(&replay(spec, &cloth, samples, 0)?.picture)));
    }
    for (name, spec) in [("figure-10-enderton", "enderton"), ("figure-10-lk", "lk")] {
        pictures.push((name, replay(spec, &cloth, 16, 0)?.picture));
    }
    // Figure 9: the motor.
    let spec = SCENES.iter().find(|s| s.source == "builtin:engine").expect("it is in the list");
    let engine = capture(spec.source, &spec.options(side), spec.white)?;
    for (name, design) in [("figure-9-enderton", "enderton"), ("figure-9-lk", "lk")] {
        pictures.push((name, replay(design, &engine, 16, 0)?.picture));
    }
    Ok(())
}
