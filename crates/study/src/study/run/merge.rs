//! Parts of a study put together.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::study::file::Study;
use crate::study::record::Record;
use crate::study::results::SceneFacts;
use crate::study::run::store::Store;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::output::{OutputFile, is_partial};

/// Parts of a study that can be put together: each was read once.
#[derive(Debug)]
pub struct Agreed<'a> {
    first: &'a Store,
    parts: &'a [Store],
    /// What is known of each scene's trace and the runs' records without times, with the
    /// folder of the part that they are of.
    scenes: BTreeMap<usize, (SceneFacts, PathBuf)>,
    records: BTreeMap<String, (Record, PathBuf)>,
}

/// Finds out whether parts can be put together. Nothing is written.
///
/// # Errors
/// [`Error::Config`] where they are of different studies; [`Error::Invalid`] where two of them
/// had different traces for a scene, or differ in what is no measured time, and where a
/// record is damaged.
pub fn agree(parts: &[Store]) -> Result<Agreed<'_>> {
    let Some(first) = parts.first() else {
        return Err(Error::config("there are no parts to put together", "name their folders"));
    };
    let (scenes, records) = Default::default();
    let mut agreed = Agreed { first, parts, scenes, records };
    parts.iter().try_for_each(|part| agreed.is_of_study(part))?;
    parts.iter().try_for_each(|part| agreed.add_scenes(part))?;
    parts.iter().try_for_each(|part| agreed.add_records(part))?;
    Ok(agreed)
}

impl Agreed<'_> {
    /// The study that they are of.
    pub fn study(&self) -> &Study {
        self.first.study()
    }

    /// Puts them together in the folder of `into`. What is there already stays; done again it
    /// changes nothing.
    ///
    /// # Errors
    /// As [`agree`], of what is there already; [`Error::Io`].
    pub fn merge(mut self, into: &Store) -> Result<()> {
        self.is_of_study(into)?;
        self.add_scenes(into)?;
        self.add_records(into)?;
        self.parts.iter().try_for_each(|part| bring(into, part))
    }

    fn is_of_study(&self, part: &Store) -> Result<()> {
        if part.study() == self.study() {
            return Ok(());
        }
        let (a, b) = (part.folder().display(), self.first.folder().display());
        Err(Error::config(
            format_args!("{a} and {b} are parts of different studies"),
            "put parts of one study together",
        ))
    }

    fn add_scenes(&mut self, part: &Store) -> Result<()> {
        for scene in 0..self.study().scenes.len() {
            let Some(facts) = part.facts(scene)? else { continue };
            match self.scenes.get(&scene) {
                Some((known, other)) if !known.are_of(&facts.content, facts.view.as_ref()) => {
                    let (a, b) = (other.display(), part.folder().display());
                    return Err(Error::invalid(
                        part.scene_file(scene).display(),
                        format_args!("{a} and {b} have different traces of scene '{}'", facts.name),
                        "measure the parts from the same scene files, with one version",
                    ));
                }
                Some(_) => {}
                None => {
                    self.scenes.insert(scene, (facts, part.folder().to_path_buf()));
                }
            }
        }
        Ok(())
    }

    fn add_records(&mut self, part: &Store) -> Result<()> {
        // What a part holds must agree in itself, too.
        for mut record in part.results()?.records {
            record.speed.clear();
            match self.records.get(&record.id) {
                Some((other, place)) if *other != record => {
                    let (a, b) = (place.display(), part.folder().display());
                    return Err(Error::invalid(
                        part.record_file(&record.id).display(),
                        format_args!("{a} and {b} have measured different errors for one run"),
                        "were they measured by different versions? remove one of the two",
                    ));
                }
                Some(_) => {}
                None => {
                    let place = part.folder().to_path_buf();
                    self.records.insert(record.id.clone(), (record, place));
                }
            }
        }
        Ok(())
    }
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
    let mut files: Vec<PathBuf> =
        entries.map(|e| e.path()).filter(|p| p.is_file() && !is_partial(p)).collect();
    // Documents last: where they are, all that belongs to them is.
    files.sort_by_key(|p| p.extension().is_some_and(|e| e == "json"));
    files.iter().try_for_each(|path| copy(path))?;
    for job in part.jobs() {
        if part.record_file(&job.id).exists() {
            copy(&part.folder().join(Store::picture_name(&job.id)))?;
            copy(&part.explanation_file(&job.id))?;
            copy(&part.record_file(&job.id))?;
            let _ = fs::remove_file(into.failure_file(&job.id));
        } else if !into.record_file(&job.id).exists() {
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
