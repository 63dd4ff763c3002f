//! LK table 1 on scenes that we have, and how its ratio depends on what is seen.

use std::path::Path;

use serde::Serialize;

use crate::metrics::{Estimate, PixelClasses, errors};
use crate::study::comparison::SceneSpec;
use crate::study::publications::{Effort, MEMORY, capture, designs, replay};
use crate::study::{Plan, Run, measure};
use screendoor_scene::capture::{CameraOptions, Capture, CaptureOptions, Faces, Order};
use screendoor_scene::scene;
use screendoor_trace::error::Result;
use screendoor_trace::trace::{SampleMask, Statistics, Trace, statistics};

/// Sample counts of LK's table 1.
pub const COUNTS: [u32; 5] = [4, 8, 16, 32, 64];
/// The designs of our table: LK's own, the comparison as it describes it, and
/// sampling without any stratification.
pub const DESIGNS: [&str; 3] = ["lk", "enderton", "enderton:mask=naive"];

/// A scene of table 1 and how it is captured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Table1Scene {
    pub name: &'static str,
    /// A built-in scene, or a file in the models' folder.
    pub source: &'static str,
    origin: &'static str,
    pub stands_for: Published,
    alpha: f32,
    pub white: bool,
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

pub(super) const SCENES: [Table1Scene; 4] = [
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
    /// Which scene; a built-in one's name begins with `builtin:`.
    pub scene: &'static str,
    /// What differs.
    #[serde(skip)]
    pub aspect: Aspect,
    /// How it is seen.
    pub what: String,
    /// Fragments per covered pixel.
    pub fragments_per_pixel: f64,
    /// Share of the covered pixels that an edge crosses.
    pub edge_share: f64,
    /// RMSE over the covered pixels of [`DESIGNS`].
    pub rmse: [Estimate; 3],
}

/// What a variation varies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Aspect {
    /// Nothing: the scene as the table has it, its triangles in this order.
    Nothing(Order),
    /// From where it is seen.
    Angle,
    /// The frame's side, in pixels.
    Size(u32),
    /// The order of the triangles.
    Order(Order),
    /// The colour behind.
    Background,
}

impl Table1Scene {
    /// How it is captured, in a square frame.
    pub fn options(&self, side: u32) -> CaptureOptions {
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

impl Table1Scene {
    /// Whether it needs no file.
    pub fn is_built_in(&self) -> bool {
        scene::path_of(self.source).is_none()
    }

    /// The scene as it can be loaded; `None` for a model that is not there.
    pub fn locate(&self, models: Option<&Path>) -> Option<String> {
        let Some(file) = scene::path_of(self.source) else {
            return Some(self.source.to_string());
        };
        let path = models?.join(file);
        path.is_file().then(|| path.display().to_string())
    }

    /// Runs the table on the scene at `source`.
    pub fn measure(
        &self,
        source: &str,
        effort: Effort,
        progress: &mut dyn FnMut(&str, u64, u64),
    ) -> Result<Table1> {
        let trace = capture(source, &self.options(effort.side), self.white)?;
        let plan =
            Plan { designs: designs(&DESIGNS)?, samples: COUNTS.to_vec(), seeds: effort.seeds };
        let measured = measure(&trace, &plan, MEMORY, |what, done, total| {
            progress(&format!("{}: {what}", self.name), done, total);
        })?;
        Ok(Table1 {
            name: self.name,
            origin: self.origin,
            stands_for: self.stands_for,
            statistics: statistics(&trace, |_| ())?,
            runs: measured.runs.into_iter().map(|m| m.run).collect(),
        })
    }
}

/// Every scene that there is, seen in several ways.
///
/// # Errors
/// As [`screendoor_scene::scene::load`] and [`screendoor_designs::Configured::replay`].
pub(super) fn vary(
    models: Option<&Path>,
    effort: Effort,
    progress: &mut dyn FnMut(&str, u64, u64),
) -> Result<Vec<Variation>> {
    let mut list = Vec::new();
    for spec in SceneSpec::all(models) {
        let Some(scene) = spec.load(models)? else { continue };
        let ways = variations(&spec.options(effort.comparison_side));
        let total = ways.len() as u64;
        for (done, way) in ways.into_iter().enumerate() {
            progress(&format!("{}: {}", spec.label(), way.what), done as u64, total);
            let trace = Capture::new(&scene, &way.options)?.to_memory(|_, _| ())?;
            list.push(variation(spec.label(), way, &trace, effort)?);
        }
    }
    Ok(list)
}

/// One way to see a scene.
struct Way {
    aspect: Aspect,
    what: String,
    options: CaptureOptions,
}

/// Other ways to see a scene: angles, sizes, orders, backgrounds.
fn variations(base: &CaptureOptions) -> Vec<Way> {
    let mut list = Vec::new();
    let mut add = |aspect, what: &str, options| {
        list.push(Way { aspect, what: what.to_string(), options });
    };
    let side = base.width;
    add(Aspect::Nothing(base.order), &format!("{side}×{side} pixels, its order"), base.clone());
    for yaw in [120.0, 210.0, 300.0] {
        let camera = CameraOptions { angle: Some([yaw, 20.0]), ..base.camera };
        add(Aspect::Angle, &format!("from {yaw}°"), CaptureOptions { camera, ..base.clone() });
    }
    for side in [base.width * 2, base.width / 2] {
        let what = format!("{side}×{side} pixels");
        add(
            Aspect::Size(side),
            &what,
            CaptureOptions { width: side, height: side, ..base.clone() },
        );
    }
    for (what, order) in [
        ("triangles in API order", Order::Api),
        ("triangles in random order", Order::Random),
        ("near to far", Order::NearToFar),
        ("far to near", Order::FarToNear),
    ] {
        if order != base.order {
            add(Aspect::Order(order), what, CaptureOptions { order, ..base.clone() });
        }
    }
    let white = CaptureOptions { background: Some([1.0; 3]), ..base.clone() };
    add(Aspect::Background, "white background", white);
    list
}

fn variation(scene: &'static str, way: Way, trace: &Trace, effort: Effort) -> Result<Variation> {
    const SAMPLES: u32 = 16;
    let classes = PixelClasses::of(trace, SAMPLES)?;
    let exact = replay("exact", trace, SAMPLES, 0)?.picture;
    let mut rmse = Vec::new();
    let mut fragments = 0;
    for design in DESIGNS {
        let mut squares = Vec::new();
        for seed in 0..effort.seeds {
            let replayed = replay(design, trace, SAMPLES, seed)?;
            let e = errors(&replayed.picture, &exact, &classes.covered).rmse;
            squares.push(e * e);
        }
        rmse.push(Estimate::of(&squares).sqrt());
    }
    for batch in trace.batches() {
        let mask = SampleMask::first(SAMPLES);
        let batch = batch?;
        fragments += (0..batch.len()).filter(|i| !(batch.coverage(*i) & mask).is_empty()).count();
    }
    let covered = classes.covered.pixels().max(1) as f64;
    Ok(Variation {
        scene,
        aspect: way.aspect,
        what: way.what,
        fragments_per_pixel: fragments as f64 / covered,
        edge_share: classes.edges.pixels() as f64 / covered,
        rmse: rmse.try_into().expect("one a design"),
    })
}
