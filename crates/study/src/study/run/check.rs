//! What can be found out about a study before its first run, and before its folder is made.

use std::path::Path;

use crate::study::engine::EngineName;
use crate::study::file::{SceneEntry, Study};
use crate::study::run::store::{record_path, trace_path};
use crate::study::run::tasks::{Job, Shard, Task, tasks};
use screendoor_scene::scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::Trace;

/// Finds out what would keep the runs of a part from being done that are not in `folder` yet:
/// scenes that are not there or have no such name or parameters, textures and traces that
/// cannot be read, traces that do not serve the sample counts, and engines that this machine
/// has not. Nothing is written.
///
/// # Errors
/// The first that is found, with the scene or the engine that it is of.
pub fn check(
    study: &Study,
    folder: &Path,
    base: &Path,
    shard: Shard,
    adapter: Option<&str>,
) -> Result<()> {
    let all = tasks(study);
    let pending: Vec<&Job> = shard
        .share(&all)
        .iter()
        .filter_map(|task| match task {
            Task::Run(job) => Some(job),
            Task::Publication(_) => None,
        })
        .filter(|job| !record_path(folder, &job.id).exists())
        .collect();
    if pending.is_empty() {
        return Ok(());
    }
    for (index, entry) in study.scenes.iter().enumerate() {
        let samples: Vec<u32> =
            pending.iter().filter(|job| job.scene == index).map(|job| job.samples).collect();
        if !samples.is_empty() {
            check_scene(entry, folder, base, &samples).map_err(|e| of(e, "scene", &entry.name))?;
        }
    }
    for engine in &study.engines {
        let adapter = adapter.filter(|_| *engine == EngineName::Gpu);
        engine.open(adapter).map_err(|e| of(e, "engine", engine.name()))?;
    }
    Ok(())
}

/// The error with what of the study it is of.
fn of(error: Error, kind: &str, name: &str) -> Error {
    let config = error.is_config();
    let text = error.to_string();
    let (what, hint) = text.rsplit_once("; ").unwrap_or((&text, "correct it in the study file"));
    let place = format!("{kind} '{name}'");
    match config {
        true => Error::config(format_args!("{place}: {what}"), hint),
        false => Error::invalid(place, what, hint),
    }
}

fn check_scene(entry: &SceneEntry, folder: &Path, base: &Path, samples: &[u32]) -> Result<()> {
    if let Some(trace) = &entry.trace {
        let trace = Trace::open(base.join(trace))?;
        let header = trace.header();
        samples.iter().try_for_each(|count| header.pattern.prefix(*count).map(|_| ()))?;
        return match entry.pixel {
            Some([x, y]) if u32::from(x) >= header.width || u32::from(y) >= header.height => {
                let (w, h) = (header.width, header.height);
                let what = format_args!("pixel {x}, {y} lies outside the trace's {w} x {h}");
                Err(Error::config(what, "name one within"))
            }
            _ => Ok(()),
        };
    }
    // What has been drawn is not drawn again.
    if trace_path(folder, &entry.name).exists() {
        return Ok(());
    }
    let source = entry.source.as_deref().unwrap_or("");
    scene::check(&scene::seen_from(source, base))?;
    if let Some(texture) = &entry.texture {
        let path = base.join(texture);
        let bytes = std::fs::read(&path).map_err(|e| Error::io("read", &path, e))?;
        if image::guess_format(&bytes).is_err() {
            let what = "it is no picture that can be read";
            return Err(Error::invalid(path.display(), what, "give a PNG or JPEG"));
        }
    }
    Ok(())
}
