//! A study's scenes as traces.

use std::path::Path;

use crate::study::file::SceneEntry;
use crate::study::measure::Subject;
use crate::study::results::{SceneFacts, ShadowFacts};
use crate::study::run::json::put_sealed;
use crate::study::run::shadow::{put_trace, shaded};
use crate::study::run::store::Store;
use screendoor_designs::REFERENCE;
use screendoor_scene::capture::{Capture, CaptureOptions};
use screendoor_scene::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileMap};
use screendoor_trace::trace::{Trace, statistics_within};

/// What runs are told of.
pub(super) type Watch<'a> = &'a (dyn Fn(&str) + Sync);

/// A scene that is being measured.
pub(super) struct OpenScene {
    /// Its trace, with what all runs share.
    pub subject: Subject,
    /// What is told of it.
    pub facts: SceneFacts,
}

impl OpenScene {
    /// Opens the scene's trace; draws it where it is not there yet. `base` is the folder
    /// that the study's paths are seen from.
    ///
    /// # Errors
    /// As [`scene::load`], [`Trace::open`] and [`screendoor_designs::Configured::replay`];
    /// [`Error::Invalid`] where the trace is not the one that was measured before.
    pub(super) fn open(store: &Store, index: usize, base: &Path, watch: Watch<'_>) -> Result<Self> {
        let entry = &store.study().scenes[index];
        let own = store.folder().join(store.trace_name(index));
        let mut drawn = None;
        let (path, shown) = match &entry.trace {
            Some(trace) => (base.join(trace), base.join(trace).display().to_string()),
            None => {
                // What was found of its shadows stands in its facts alone.
                if !own.exists() || entry.shadow.is_some() && store.facts(index)?.is_none() {
                    watch(&format!("capturing {}", entry.name));
                    drawn = Some(draw(store, entry, base, &own)?);
                }
                (own, store.trace_name(index))
            }
        };
        let trace = Trace::open(&path)?;
        let drawn = || match drawn {
            Some(drawn) => Ok(drawn),
            // Drawn by a process that ended before it could say so.
            None if entry.source.is_some() => prepared(entry, base)
                .map(|(scene, _)| Drawn { warnings: scene.warnings, shadow: None }),
            None => Ok(Drawn::default()),
        };
        let facts = facts(store, index, &trace, shown, drawn, watch)?;
        let all = trace.header().pattern.samples();
        watch(&format!("{REFERENCE} at {all} on {}", entry.name));
        let known = (facts.content.clone(), facts.statistics.tied_fragments);
        let memory = store.study().memory << 20;
        let subject = Subject::new(&facts.name, trace, Some(known), memory)?;
        Ok(OpenScene { subject, facts })
    }
}

/// A scene as it is drawn, how, and in its warnings what of either is not honoured.
fn prepared(entry: &SceneEntry, base: &Path) -> Result<(Scene, CaptureOptions)> {
    let mut scene = entry.load(base)?;
    if let Some(texture) = &entry.texture {
        scene.apply_texture(&base.join(texture))?;
    }
    if entry.white {
        scene.whiten();
    }
    let mut chosen = entry.camera_choice(base).choose(&scene.cameras)?;
    scene.warnings.append(&mut chosen.warnings);
    let options = entry.options(chosen)?;
    scene.warnings.extend(options.unused(&scene));
    Ok((scene, options))
}

/// What became known of a scene when it was drawn.
#[derive(Default)]
struct Drawn {
    /// What of it is not drawn.
    warnings: Vec<String>,
    shadow: Option<ShadowFacts>,
}

/// Draws a scene into the trace at `path`.
fn draw(store: &Store, entry: &SceneEntry, base: &Path, path: &Path) -> Result<Drawn> {
    let (mut scene, options) = prepared(entry, base)?;
    let capture = Capture::new(&scene, &options)?;
    let mut dark = false;
    let (rows, shadow) = match &entry.shadow {
        None => (put_trace(path, capture.header(), |w| capture.draw(w, |_, _| ()))?, None),
        Some(shadow) => {
            let (rows, facts) = shaded(store, entry, shadow, (&scene, &capture), path)?;
            dark = facts.error.queries == 0;
            (rows, Some(facts))
        }
    };
    drop(capture);
    if dark {
        let lacks = format!("{}: no fragment has anything of the light's", entry.name);
        scene.warnings.push(lacks);
    }
    if rows == 0 {
        scene.warnings.push(format!("{}: its trace has no fragments", entry.name));
    }
    Ok(Drawn { warnings: scene.warnings, shadow })
}

/// The facts of a scene, written where they are not there yet.
fn facts(
    store: &Store,
    index: usize,
    trace: &Trace,
    shown: String,
    drawn: impl FnOnce() -> Result<Drawn>,
    watch: Watch<'_>,
) -> Result<SceneFacts> {
    let entry = &store.study().scenes[index];
    let view = trace.header().view;
    let content = match trace.content() {
        Some(content) => content.to_string(),
        None => trace.verify(|_| ())?,
    };
    if let Some(facts) = store.facts(index)? {
        if !facts.are_of(&content, view.as_ref()) {
            return Err(Error::invalid(
                trace.place(),
                format_args!("scene '{}' was another one when the study was begun", entry.name),
                "bring its old trace back, or begin in another folder",
            ));
        }
        return Ok(facts);
    }
    watch(&format!("counting {}", entry.name));
    let header = trace.header();
    let Drawn { warnings, shadow } = drawn()?;
    let facts = SceneFacts {
        name: entry.name.clone(),
        trace: shown,
        content,
        size: [header.width, header.height],
        samples: header.pattern.samples(),
        source: header.source.clone(),
        camera: header.camera.clone(),
        view,
        space: header.space,
        warnings,
        pixel: match entry.pixel {
            Some(pixel) => pixel,
            None => telling_pixel(trace)?,
        },
        statistics: statistics_within(trace, store.study().memory << 20, |_, _| ())?,
        shadow,
    };
    put_sealed(&store.scene_file(index), &facts)?;
    Ok(facts)
}

/// Fragments in a pixel that are enough to see how a design works and few enough to read.
const TELLING: f64 = 6.0;

/// The pixel that tells most, the one nearest the frame's centre where several do: with
/// [`TELLING`] fragments, all of which cover all samples. A fragment more or less counts as
/// much as one that covers next to nothing.
fn telling_pixel(trace: &Trace) -> Result<[u16; 2]> {
    let header = trace.header();
    let grid = TileGrid::new(header.width, header.height);
    let all = f64::from(header.pattern.samples());
    // Fragments, and how much of the pixel they leave uncovered.
    let mut pixels: TileMap<Box<[(f64, f64); TILE_PIXELS]>> = TileMap::new(grid);
    for batch in trace.batches() {
        for f in batch?.iter() {
            let tile = pixels
                .get_or_insert_with(grid.tile(f.x, f.y), || Box::new([(0.0, 0.0); TILE_PIXELS]));
            let (fragments, uncovered) = &mut tile[TileGrid::within(f.x, f.y)];
            *fragments += 1.0;
            *uncovered += 1.0 - f64::from(f.coverage.count()) / all;
        }
    }
    let centre = [header.width / 2, header.height / 2];
    let mut best = (f64::INFINITY, u64::MAX, centre);
    for (tile, pixels) in pixels.touched() {
        for (within, (fragments, uncovered)) in pixels.iter().enumerate() {
            if *fragments == 0.0 {
                continue;
            }
            let (x, y) = grid.pixel(*tile, within);
            let square = |a: u32, b: u32| u64::from(a.abs_diff(b)).pow(2);
            let distance = square(x, centre[0]) + square(y, centre[1]);
            let lack = (fragments - TELLING).abs() + uncovered;
            if (lack, distance, [x, y]) < best {
                best = (lack, distance, [x, y]);
            }
        }
    }
    Ok(best.2.map(|c| c as u16))
}
