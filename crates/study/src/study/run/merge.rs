//! Parts of a study put together.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::study::record::Record;
use crate::study::run::store::Store;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::output::{OutputFile, is_partial};

/// Puts the parts in `parts` together in the folder of `into`. What is there already stays;
/// done again it changes nothing.
///
/// # Errors
/// As [`agree`]; [`Error::Io`].
pub fn merge(into: &Store, parts: &[Store]) -> Result<()> {
    let all: Vec<&Store> = std::iter::once(into).chain(parts).collect();
    agree(&all)?;
    parts.iter().try_for_each(|part| bring(into, part))
}

/// Finds out whether parts can be put together. Nothing is written.
///
/// # Errors
/// [`Error::Config`] where they are of different studies; [`Error::Invalid`] where two of them
/// had different traces for a scene, or differ in what is no measured time, and where a
/// record is damaged.
pub fn agree(parts: &[&Store]) -> Result<()> {
    let Some((first, others)) = parts.split_first() else { return Ok(()) };
    for part in others {
        if part.study() != first.study() {
            let (a, b) = (part.folder().display(), first.folder().display());
            return Err(Error::config(
                format_args!("{a} and {b} are parts of different studies"),
                "put parts of one study together",
            ));
        }
    }
    for scene in 0..first.study().scenes.len() {
        same_scene(parts, scene)?;
    }
    // What each part holds must agree in itself, too.
    parts.iter().try_for_each(|part| part.results().map(|_| ()))?;
    for job in first.jobs() {
        let mut known: Option<(Record, &Store)> = None;
        for store in parts {
            let Some(mut record) = store.record(job)? else { continue };
            record.speed.clear();
            match &known {
                Some((other, place)) if *other != record => {
                    let (a, b) = (place.folder().display(), store.folder().display());
                    return Err(Error::invalid(
                        store.record_file(&job.id).display(),
                        format_args!("{a} and {b} have measured different errors for one run"),
                        "were they measured by different versions? remove one of the two",
                    ));
                }
                Some(_) => {}
                None => known = Some((record, store)),
            }
        }
    }
    Ok(())
}

fn same_scene(parts: &[&Store], scene: usize) -> Result<()> {
    let mut known: Option<(String, &Store)> = None;
    for store in parts {
        let Some(facts) = store.facts(scene)? else { continue };
        match &known {
            Some((content, other)) if *content != facts.content => {
                let (a, b) = (other.folder().display(), store.folder().display());
                return Err(Error::invalid(
                    store.scene_file(scene).display(),
                    format_args!("{a} and {b} have different traces of scene '{}'", facts.name),
                    "measure the parts from the same scene files, with one version",
                ));
            }
            Some(_) => {}
            None => known = Some((facts.content, store)),
        }
    }
    Ok(())
}

/// Copies what a part has and the whole has not; records last.
fn bring(into: &Store, part: &Store) -> Result<()> {
    let study = part.study();
    let copy = |path: &Path| copy(part, into, path);
    for machine in part.machines()? {
        into.add_machine(&machine)?;
    }
    for (scene, _) in study.scenes.iter().enumerate() {
        copy(&part.scene_file(scene))?;
        copy(&part.folder().join(part.trace_name(scene)))?;
    }
    let verification = part.folder().join("verification");
    let entries = fs::read_dir(&verification).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|e| e.path()).filter(|p| !is_partial(p)).collect();
    // Documents last: where they are, all that belongs to them is.
    files.sort_by_key(|p| p.extension().is_some_and(|e| e == "md"));
    files.iter().try_for_each(|path| copy(path))?;
    for job in part.jobs() {
        if part.record(job)?.is_some() {
            copy(&part.folder().join(Store::picture_name(&job.id)))?;
            copy(&part.explanation_file(&job.id))?;
            copy(&part.record_file(&job.id))?;
            let _ = fs::remove_file(into.failure_file(&job.id));
        } else if into.record(job)?.is_none() {
            copy(&part.failure_file(&job.id))?;
        }
    }
    Ok(())
}

/// Copies a file of one folder to its place in another, unless it is there or there is none.
fn copy(from: &Store, to: &Store, path: &Path) -> Result<()> {
    let Ok(place) = path.strip_prefix(from.folder()) else { return Ok(()) };
    let target = to.folder().join(place);
    if target.exists() {
        return Ok(());
    }
    let mut source = match File::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(Error::io("read", path, e)),
    };
    let mut file = OutputFile::create(&target)?;
    io::copy(&mut source, &mut file).map_err(|e| Error::io("write", &target, e))?;
    file.commit()?;
    // A record's time is when it was measured. Where it cannot be kept nothing else is lost.
    let time = source.metadata().and_then(|m| m.modified());
    let _ = time.and_then(|t| File::options().append(true).open(&target)?.set_modified(t));
    Ok(())
}
