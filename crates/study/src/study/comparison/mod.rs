//! All designs over the same fragments: error and bias, state and passes; and the
//! question who wins at equal state.

mod contenders;

use std::path::Path;

use serde::Serialize;

pub use contenders::{Contender, SLAB_CLAIM, SLAB_LAYERS, SLAB_LIMIT, SLAB_RIVALS, contenders};

use crate::metrics::{Ensemble, EnsembleErrors, PixelClasses};
use crate::study::comparison::contenders::claimed;
use crate::study::publications::claims::{Trial, dial};
use screendoor_designs::{REFERENCE, configure};
use screendoor_rop::ReplayOptions;
use screendoor_scene::capture::{Capture, CaptureOptions, Faces, Order, PatternKind};
use screendoor_scene::scene::{self, Scene};
use screendoor_trace::error::Result;
use screendoor_trace::trace::{Statistics, Trace, statistics};

/// Samples per pixel, or layers, that every design is run with.
pub const COUNTS: [u32; 5] = [2, 4, 8, 16, 32];

/// A scene of the comparison and how it is captured.
#[derive(Clone, Copy, Debug)]
pub(in crate::study) struct SceneSpec {
    name: &'static str,
    /// A file in the models' folder, or a built-in scene.
    source: &'static str,
    texture: Option<&'static str>,
    /// The alpha of surfaces that have none of their own.
    alpha: Option<f32>,
    order: Order,
}

const fn scene(name: &'static str, source: &'static str, alpha: Option<f32>) -> SceneSpec {
    SceneSpec { name, source, texture: None, alpha, order: Order::Api }
}

const MODELS: [SceneSpec; 9] = [
    scene("cycloidal", "cycloidal.glb", Some(0.3)),
    SceneSpec {
        order: Order::Random,
        ..scene("drape", "codimipc_multilayer_drape.obj", Some(0.4))
    },
    scene("sheen cloth", "SheenCloth/SheenCloth.gltf", Some(0.4)),
    SceneSpec { texture: Some("oak_leaf_color.png"), ..scene("oak", "oak_large_leaves.obj", None) },
    scene("mohawk", "Ratboy_mohawk.tfx", None),
    scene("smoke", "openusd_smoke_000003.vdb", Some(0.05)),
    scene("guitar", "guitar.compressed.ply", None),
    scene("lamp", "StainedGlassLamp/StainedGlassLamp.gltf", None),
    scene("neon sign", "love_neon_sign.glb", None),
];

/// What stands for the models where they are not given.
const BUILT_IN: [SceneSpec; 5] = [
    scene("engine", "builtin:engine", Some(0.3)),
    SceneSpec { order: Order::Random, ..scene("cloth", "builtin:cloth", Some(0.4)) },
    scene("foliage", "builtin:foliage", None),
    scene("hair", "builtin:hair", None),
    scene("smoke", "builtin:smoke", None),
];

/// One contender at one count on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The contender's place in the list.
    pub contender: usize,
    /// Samples, and layers where it has layers.
    pub count: u32,
    /// Bytes of state per pixel.
    pub state_bytes: f64,
    /// Whether the state grows with the fragments.
    pub unbounded: bool,
    /// Passes over the trace.
    pub passes: u32,
    /// Errors over the covered pixels against the exact picture of the same samples.
    pub errors: EnsembleErrors,
}

/// One scene with the results of all contenders.
#[derive(Clone, Debug, Serialize)]
pub struct ComparedScene {
    /// A short name.
    pub name: &'static str,
    /// The trace in numbers.
    pub statistics: Statistics,
    /// Contender after contender, count after count.
    pub results: Vec<Outcome>,
}

impl ComparedScene {
    /// A contender's result at a count.
    pub fn result(&self, contender: usize, count: u32) -> Option<&Outcome> {
        self.results.iter().find(|r| r.contender == contender && r.count == count)
    }

    /// A contender's error at a size of state between those of its counts: a line
    /// between the logarithms of sizes and errors. `None` outside of them.
    fn error_at(&self, contender: usize, bytes: f64) -> Option<f64> {
        let own = |r: &&Outcome| r.contender == contender && !r.unbounded;
        // Errors below this are rounding.
        let point = |r: &Outcome| (r.state_bytes.ln(), r.errors.rmse.value.max(1e-3).ln());
        let points: Vec<(f64, f64)> = self.results.iter().filter(own).map(point).collect();
        let at = bytes.ln();
        let (a, b) = points.iter().zip(points.get(1..)?).find(|(a, b)| a.0 <= at && at <= b.0)?;
        let share = if b.0 > a.0 { (at - a.0) / (b.0 - a.0) } else { 0.0 };
        Some((a.1 + share * (b.1 - a.1)).exp())
    }
}

/// The whole comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Frame side in pixels.
    pub side: u32,
    /// Seeds of each design that has any.
    pub seeds: u32,
    /// Who is compared.
    pub contenders: Vec<Contender>,
    /// On what.
    pub scenes: Vec<ComparedScene>,
    /// The same scenes with all samples at the pixels' centres, as Enderton et al. and
    /// Wyman show theirs; with what [`SLAB_CLAIM`] is about alone.
    pub without_antialiasing: Vec<ComparedScene>,
    /// SLAB along its dial from noise to bias, without antialiasing.
    pub dial: Trial,
    /// Models that were not given.
    pub missing: Vec<&'static str>,
}

/// Compares all designs on the models in a folder, or on built-in scenes where no
/// folder is given.
///
/// # Errors
/// As [`scene::load`] and [`screendoor_designs::Configured::replay`].
pub fn compare(
    models: Option<&Path>,
    side: u32,
    seeds: u32,
    progress: impl FnMut(&str, u64, u64),
) -> Result<Comparison> {
    compare_some(models, side, seeds, |_, _| true, progress)
}

/// As [`compare`], but only what [`SLAB_CLAIM`] is about.
///
/// # Errors
/// As [`compare`].
pub fn compare_slab(
    models: Option<&Path>,
    side: u32,
    seeds: u32,
    progress: impl FnMut(&str, u64, u64),
) -> Result<Comparison> {
    compare_some(models, side, seeds, claimed, progress)
}

fn compare_some(
    models: Option<&Path>,
    side: u32,
    seeds: u32,
    wanted: fn(&Contender, u32) -> bool,
    mut progress: impl FnMut(&str, u64, u64),
) -> Result<Comparison> {
    let contenders = contenders();
    let specs: &[SceneSpec] = if models.is_some() { &MODELS } else { &BUILT_IN };
    let total = (specs.len() * contenders.len()) as u64;
    let (mut scenes, mut without_antialiasing) = (Vec::new(), Vec::new());
    let mut missing = Vec::new();
    for (i, spec) in specs.iter().enumerate() {
        let Some(trace) = spec.capture(models, side, PatternKind::Auto)? else {
            missing.push(spec.source);
            continue;
        };
        let before = (i * contenders.len()) as u64;
        let watch = |done: usize| progress(spec.name, before + done as u64, total);
        scenes.push(compared(spec.name, &trace, &contenders, wanted, seeds, watch)?);
        if let Some(trace) = spec.capture(models, side, PatternKind::Centre)? {
            let compared = compared(spec.name, &trace, &contenders, claimed, seeds, |_| ())?;
            without_antialiasing.push(compared);
        }
    }
    progress("SLAB's dial", total, total);
    let dial = dial(models, side, seeds)?;
    Ok(Comparison { side, seeds, contenders, scenes, without_antialiasing, dial, missing })
}

impl SceneSpec {
    /// Every scene that there is: the built-in ones, and the models where a folder is given.
    pub(in crate::study) fn all(models: Option<&Path>) -> impl Iterator<Item = &'static Self> {
        let given = if models.is_some() { MODELS.as_slice() } else { &[] };
        given.iter().chain(&BUILT_IN)
    }

    /// A name that no other scene has.
    pub(in crate::study) fn label(&self) -> &'static str {
        if scene::path_of(self.source).is_none() { self.source } else { self.name }
    }

    /// Its trace at 32 samples; `None` where the model is not there.
    pub(in crate::study) fn capture(
        &self,
        models: Option<&Path>,
        side: u32,
        pattern: PatternKind,
    ) -> Result<Option<Trace>> {
        let Some(scene) = self.load(models)? else { return Ok(None) };
        let options = CaptureOptions { pattern, ..self.options(side) };
        Ok(Some(Capture::new(&scene, &options)?.to_memory(|_, _| ())?))
    }

    /// The scene; `None` where the model is not there.
    pub(in crate::study) fn load(&self, models: Option<&Path>) -> Result<Option<Scene>> {
        let in_folder = |file: &str| models.map(|m| m.join(file)).filter(|p| p.is_file());
        let source = match scene::path_of(self.source) {
            None => self.source.to_string(),
            Some(_) => match in_folder(self.source) {
                Some(path) => path.display().to_string(),
                None => return Ok(None),
            },
        };
        let mut scene = scene::load(&source)?;
        if let Some(texture) = self.texture.and_then(in_folder) {
            scene.apply_texture(&texture)?;
        }
        Ok(Some(scene))
    }

    /// How it is captured, in a square frame with 32 samples.
    pub(in crate::study) fn options(&self, side: u32) -> CaptureOptions {
        CaptureOptions {
            width: side,
            height: side,
            samples: 32,
            alpha: self.alpha,
            faces: Faces::Both,
            order: self.order,
            ..CaptureOptions::default()
        }
    }
}

fn compared(
    name: &'static str,
    trace: &Trace,
    contenders: &[Contender],
    wanted: fn(&Contender, u32) -> bool,
    seeds: u32,
    mut progress: impl FnMut(usize),
) -> Result<ComparedScene> {
    let statistics = statistics(trace, |_| ())?;
    let options = ReplayOptions { memory: 1 << 30, ..ReplayOptions::default() };
    let exact = configure(REFERENCE, &[])?;
    let mut references = Vec::new();
    for count in COUNTS.into_iter().filter(|n| contenders.iter().any(|c| wanted(c, *n))) {
        let reference = exact.replay(trace, count, 0, &options)?.picture;
        references.push((count, reference, PixelClasses::of(trace, count)?.covered));
    }
    let mut results = Vec::new();
    for (contender, spec) in contenders.iter().enumerate() {
        progress(contender);
        for (count, reference, covered) in references.iter().filter(|(n, ..)| wanted(spec, *n)) {
            let design = spec.at(*count)?;
            let seeds = if design.promises().seeded { seeds } else { 1 };
            let mut ensemble = Ensemble::new(reference, &[covered]);
            for seed in 0..seeds {
                ensemble.add(&design.replay(trace, *count, seed, &options)?.picture);
            }
            let engine = design.build(&design.frame(trace, *count, 0)?, options.engine)?;
            let (bits, passes) = (engine.state_bits(), engine.passes());
            results.push(Outcome {
                contender,
                count: *count,
                state_bytes: f64::from(bits.total()) / 8.0,
                unbounded: bits.unbounded,
                passes,
                errors: ensemble.finish().swap_remove(0),
            });
        }
    }
    Ok(ComparedScene { name, statistics, results })
}

/// Two contenders at equal state over all scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Duel {
    /// Scenes on which the first has the smaller error by more than 2 %.
    pub won: u32,
    /// Scenes on which the second has.
    pub lost: u32,
    /// Scenes on which neither has.
    pub even: u32,
}

impl Comparison {
    /// Who of two has the smaller error with the same bytes of state: on each scene the
    /// geometric mean of the errors' ratio over the state sizes of either that lie
    /// between the least and the greatest of both.
    pub fn duel(&self, a: usize, b: usize) -> Duel {
        let mut duel = Duel::default();
        for scene in &self.scenes {
            let of_either = scene.results.iter().filter(|r| [a, b].contains(&r.contender));
            let logs: Vec<f64> = of_either
                .filter_map(|r| {
                    let error = |contender| scene.error_at(contender, r.state_bytes);
                    Some((error(a)? / error(b)?).ln())
                })
                .collect();
            if logs.is_empty() {
                continue;
            }
            let ratio = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
            if ratio < 0.98 {
                duel.won += 1;
            } else if ratio > 1.0 / 0.98 {
                duel.lost += 1;
            } else {
                duel.even += 1;
            }
        }
        duel
    }

    /// The contender with a label.
    pub fn contender(&self, label: &str) -> Option<usize> {
        self.contenders.iter().position(|c| c.label == label)
    }
}
