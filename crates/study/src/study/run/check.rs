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
/// scenes that are not there or have no such name or parameters, textures, files of cameras and
/// traces that cannot be read, cameras that are not there, traces that do not serve the sample counts or have no view where a design
/// asks for it, and engines that this machine has not. Nothing is written.
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
        let jobs: Vec<&Job> = pending.iter().copied().filter(|job| job.scene == index).collect();
        if !jobs.is_empty() {
            check_scene(entry, folder, base, &jobs)
                .and_then(|()| check_view(study, entry, folder, base, &jobs))
                .map_err(|e| of(e, "scene", &entry.name))?;
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

/// Refuses designs that take view depths from a trace's view where there is a trace already
/// and it has none; what has not been captured yet will have one.
fn check_view(
    study: &Study,
    entry: &SceneEntry,
    folder: &Path,
    base: &Path,
    jobs: &[&Job],
) -> Result<()> {
    let path = match &entry.trace {
        Some(trace) => base.join(trace),
        None => trace_path(folder, &entry.name),
    };
    let asks = |job: &&&Job| {
        let design = study.design(&job.series, job.samples);
        design.is_ok_and(|design| design.asks_for_view())
    };
    match jobs.iter().find(asks) {
        Some(job) if path.exists() && Trace::open(&path)?.header().view.is_none() => {
            Err(Error::config(
                format_args!("{} does not say its view, for '{}'", path.display(), job.series),
                "capture it again, let its writer state the view (docs/TRACE_FORMAT.md), or \
                 leave the design out",
            ))
        }
        _ => Ok(()),
    }
}

fn check_scene(entry: &SceneEntry, folder: &Path, base: &Path, jobs: &[&Job]) -> Result<()> {
    if let Some(trace) = &entry.trace {
        let trace = Trace::open(base.join(trace))?;
        let header = trace.header();
        jobs.iter().try_for_each(|job| header.pattern.prefix(job.samples).map(|_| ()))?;
        return entry.check_pixel([header.width, header.height]);
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
    let choice = entry.camera_choice(base);
    let own = match (&choice.camera, choice.file()) {
        (None, _) => return Ok(()),
        (Some(_), Some(_)) => Vec::new(),
        // Known when the scene is loaded, which is done once more to draw it.
        (Some(_), None) => entry.load(base)?.cameras,
    };
    entry.check_pixel(choice.choose(&own)?.size)
}
