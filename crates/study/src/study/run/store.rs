//! A study's folder: what has been measured, file by file, each whole or not there.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::study::file::{Publication, Study};
use crate::study::record::{Record, check_version};
use crate::study::results::{Machine, Missing, Results, SceneFacts};
use crate::study::run::tasks::{Job, jobs};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::output::{OutputFile, is_partial};
use screendoor_trace::param::Options;
use screendoor_trace::trace::Trace;

/// The folder of a study.
///
/// `study.toml` says what is measured here; a run's result is one file, written when
/// all else of the run is there. So the folder is whole at every moment.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    study: Study,
    jobs: Vec<Job>,
    /// Held while this program writes here; the system lets go of it when the program ends.
    _lock: Option<File>,
}

/// The folders in a study's folder.
const FOLDERS: [&str; 6] = ["scenes", "traces", "runs", "pictures", "explain", "verification"];
const STUDY: &str = "study.toml";
const MACHINES: &str = "machine.json";
const LOCK: &str = ".lock";

/// A run's record in a study's folder.
pub(super) fn record_path(folder: &Path, id: &str) -> PathBuf {
    folder.join("runs").join(format!("{id}.json"))
}

/// The trace of a scene that was drawn for a study's folder.
pub(super) fn trace_path(folder: &Path, scene: &str) -> PathBuf {
    folder.join("traces").join(format!("{scene}.arrow"))
}

fn another(folder: &Path) -> Error {
    Error::config(
        format_args!("{} holds another study, of which runs are measured", folder.display()),
        "name another folder; a changed study is another one",
    )
}

/// Whether anything has been measured in a study's folder: a run, or a publication.
fn holds_results(folder: &Path) -> bool {
    ["runs", "verification"].iter().any(|name| {
        let entries = fs::read_dir(folder.join(name)).into_iter().flatten().flatten();
        entries.into_iter().any(|e| e.path().extension().is_some_and(|ending| ending == "json"))
    })
}

/// Removes from a study's folder what belongs to a study of which nothing was measured: scenes
/// that were drawn, and why runs failed.
fn clear(folder: &Path) {
    let own = [("scenes", "json"), ("traces", "arrow"), ("runs", "failed"), ("explain", "json")];
    for (name, ending) in own.into_iter().chain([("pictures", "exr")]) {
        for entry in fs::read_dir(folder.join(name)).into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|found| found == ending) {
                // What stays is refused where it is of another scene.
                let _ = fs::remove_file(entry.path());
            }
        }
    }
    let _ = fs::remove_file(folder.join(STUDY));
}

impl Store {
    /// Begins the folder of `study`, or goes on with it. One that was begun for another study
    /// of which nothing has been measured is taken over.
    ///
    /// # Errors
    /// [`Error::Config`] where the folder is another study's or something else's, or
    /// another program writes there; [`Error::Io`] where it cannot be written.
    pub fn begin(folder: &Path, study: &Study) -> Result<Self> {
        let create =
            |path: &Path| fs::create_dir_all(path).map_err(|e| Error::io("create", path, e));
        let path = folder.join(STUDY);
        look(folder, study)?;
        create(folder)?;
        let lock = lock(folder)?;
        // Who had the lock before may have begun a study or measured something.
        if look(folder, study)? == Found::Idle {
            clear(folder);
        }
        remove_partial(folder);
        for name in FOLDERS {
            create(&folder.join(name))?;
            remove_partial(&folder.join(name));
        }
        if !path.exists() {
            OutputFile::put(&path, study_text(study).as_bytes())?;
        }
        Ok(Store::at(folder, study.clone(), Some(lock)))
    }

    /// Opens a folder to read it.
    ///
    /// # Errors
    /// [`Error::Io`] where there is no study; as [`Study::read`].
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(STUDY);
        if !path.exists() {
            let why = "no study has been measured there";
            return Err(Error::io("read", folder, io::Error::new(io::ErrorKind::NotFound, why)));
        }
        Ok(Store::at(folder, Study::read(&path)?, None))
    }

    fn at(folder: &Path, study: Study, lock: Option<File>) -> Self {
        let jobs = jobs(&study);
        Store { folder: folder.to_path_buf(), study, jobs, _lock: lock }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The study.
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// The study's runs.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs
    }

    /// A scene's facts.
    pub(crate) fn scene_file(&self, scene: usize) -> PathBuf {
        self.folder.join("scenes").join(format!("{}.json", self.study.scenes[scene].name))
    }

    /// A drawn scene's trace, as seen from the folder.
    pub(crate) fn trace_name(&self, scene: usize) -> String {
        format!("traces/{}.arrow", self.study.scenes[scene].name)
    }

    /// A run's record.
    pub fn record_file(&self, id: &str) -> PathBuf {
        record_path(&self.folder, id)
    }

    /// Why a run has no record.
    pub(crate) fn failure_file(&self, id: &str) -> PathBuf {
        self.folder.join("runs").join(format!("{id}.failed"))
    }

    /// A run's picture of the first seed, as seen from the folder.
    pub fn picture_name(id: &str) -> String {
        format!("pictures/{id}.exr")
    }

    /// What a run does at the scene's pixel.
    pub fn explanation_file(&self, id: &str) -> PathBuf {
        self.folder.join("explain").join(format!("{id}.json"))
    }

    /// A file of what publications print beside what is measured.
    pub fn verification_file(&self, name: &str) -> PathBuf {
        self.folder.join("verification").join(name)
    }

    /// Where a publication's own studies are measured.
    pub fn publication_folder(&self, publication: Publication) -> PathBuf {
        self.verification_file(publication.name())
    }

    /// A publication's document as sections, written last of what belongs to it.
    pub fn document_file(&self, publication: Publication) -> PathBuf {
        self.verification_file(&format!("{}.sections.json", publication.name()))
    }

    /// The same for people.
    pub fn markdown_file(&self, publication: Publication) -> PathBuf {
        self.verification_file(&format!("{}.md", publication.name()))
    }

    /// A scene's facts, where its trace has been there.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a damaged file; [`Error::Io`] where it cannot be read.
    pub fn facts(&self, scene: usize) -> Result<Option<SceneFacts>> {
        read_sealed(&self.scene_file(scene))
    }

    /// A run's record, where it is finished.
    ///
    /// # Errors
    /// As [`Store::facts`].
    pub fn record(&self, job: &Job) -> Result<Option<Record>> {
        let path = self.record_file(&job.id);
        let record: Option<Record> = read_sealed(&path)?;
        let own = |r: &Record| {
            (r.series.as_str(), r.samples) == (job.series.as_str(), job.samples)
                && r.scene == self.study.scenes[job.scene].name
        };
        match record {
            Some(record) if !own(&record) => Err(damaged(&path, "it is of another run")),
            record => Ok(record),
        }
    }

    /// Writes a value as JSON.
    ///
    /// # Errors
    /// [`Error::Io`] where it cannot be written.
    pub fn put<T: Serialize>(path: &Path, value: &T) -> Result<()> {
        let mut bytes = serde_json::to_vec_pretty(value)
            .map_err(|e| Error::io("write", path, io::Error::other(e)))?;
        bytes.push(b'\n');
        OutputFile::put(path, &bytes)
    }

    /// Writes a value as JSON that bears a checksum of its own.
    ///
    /// # Errors
    /// As [`Store::put`].
    pub(crate) fn put_sealed<T: Serialize>(path: &Path, value: &T) -> Result<()> {
        let fail = |e| Error::io("write", path, io::Error::other(e));
        // What is read again is what is hashed.
        let text = serde_json::to_string(value).map_err(fail)?;
        let sealed = Sealed { value, checksum: checksum(&text).map_err(fail)? };
        Store::put(path, &sealed)
    }

    /// Puts down that a run could not be done.
    ///
    /// # Errors
    /// As [`Store::put`].
    pub(crate) fn put_failure(&self, job: &Job, why: &str) -> Result<()> {
        Store::put(&self.failure_file(&job.id), &self.missing(job, Some(why.to_string())))
    }

    /// Puts down on which machine something was measured here.
    ///
    /// # Errors
    /// As [`Store::facts`] and [`Store::put`].
    pub(crate) fn add_machine(&self, machine: &Machine) -> Result<()> {
        let mut machines = self.machines()?;
        if machines.contains(machine) {
            return Ok(());
        }
        machines.push(machine.clone());
        Store::put(&self.folder.join(MACHINES), &machines)
    }

    /// The machines that have measured here.
    ///
    /// # Errors
    /// As [`Store::facts`].
    pub fn machines(&self) -> Result<Vec<Machine>> {
        Ok(read_json(&self.folder.join(MACHINES))?.unwrap_or_default())
    }

    /// Everything that is there.
    ///
    /// # Errors
    /// As [`Store::facts`].
    pub fn results(&self) -> Result<Results> {
        let mut results = Results {
            study: self.study.clone(),
            machine: Machine::together(&self.machines()?),
            scenes: Vec::new(),
            records: Vec::new(),
            missing: Vec::new(),
        };
        let mut contents = Vec::with_capacity(self.study.scenes.len());
        for scene in 0..self.study.scenes.len() {
            let facts = self.facts(scene)?;
            if let Some(facts) = &facts {
                self.same_trace(scene, facts)?;
            }
            contents.push(facts.as_ref().map(|facts| facts.content.clone()));
            results.scenes.extend(facts);
        }
        for job in &self.jobs {
            match self.record(job)? {
                Some(record)
                    if contents[job.scene].as_ref().is_some_and(|c| *c != record.trace) =>
                {
                    let what = "it was measured on another trace than its scene's file says";
                    return Err(damaged(&self.record_file(&job.id), what));
                }
                Some(record) => results.records.push(record),
                None => {
                    let failure: Option<Missing> = read_json(&self.failure_file(&job.id))?;
                    results.missing.push(self.missing(job, failure.and_then(|f| f.why)));
                }
            }
        }
        Ok(results)
    }

    /// Refuses a trace in the folder that is not the one that was measured. Where it is not
    /// there any more, nothing speaks against the results.
    fn same_trace(&self, scene: usize, facts: &SceneFacts) -> Result<()> {
        let path = self.folder.join(self.trace_name(scene));
        if self.study.scenes[scene].trace.is_some() || !path.exists() {
            return Ok(());
        }
        let trace = Trace::open(&path)?;
        match trace.content() {
            Some(content) if facts.are_of(content, trace.header().view.as_ref()) => Ok(()),
            _ => Err(Error::invalid(
                path.display(),
                format_args!("it is not the trace that scene '{}' was measured on", facts.name),
                "bring the old one back, or measure the study in another folder",
            )),
        }
    }

    fn missing(&self, job: &Job, why: Option<String>) -> Missing {
        Missing {
            id: job.id.clone(),
            scene: self.study.scenes[job.scene].name.clone(),
            series: job.series.clone(),
            samples: job.samples,
            why,
        }
    }
}

/// The study as its folder has it.
fn study_text(study: &Study) -> String {
    format!(
        "# The study whose results lie here, every default filled in; paths are seen from the\n\
         # folder of the file that it was read from. Written by screendoor {}.\n\n{}",
        env!("CARGO_PKG_VERSION"),
        study.to_toml()
    )
}

/// Removes what a program that was killed outright had begun to write.
fn remove_partial(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_partial(&entry.path()) {
            // What cannot be removed is in nobody's way.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// What stands in a folder that a study is to be measured in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Found {
    Nothing,
    /// The same study.
    Same,
    /// Another study of which nothing is measured.
    Idle,
}

/// Looks into the folder.
///
/// # Errors
/// [`Error::Config`] where it is another study's or something else's, or another program is
/// just beginning one there; [`Error::Io`].
fn look(folder: &Path, study: &Study) -> Result<Found> {
    let path = folder.join(STUDY);
    let is_there = || path.try_exists().map_err(|e| Error::io("read", &path, e));
    if !is_there()? {
        let mut entries = fs::read_dir(folder).into_iter().flatten().flatten();
        if entries.all(|entry| is_begun(&entry)) {
            return Ok(Found::Nothing);
        }
        // A program that begins a study makes its folders first, under the lock.
        let held = File::options().write(true).open(folder.join(LOCK));
        if held.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock))) {
            return Err(at_work(folder));
        }
        if !is_there()? {
            return Err(Error::config(
                format_args!("{} is not empty and holds no study", folder.display()),
                "name a new folder",
            ));
        }
    }
    match Study::read(&path)? == *study {
        true => Ok(Found::Same),
        false if holds_results(folder) => Err(another(folder)),
        false => Ok(Found::Idle),
    }
}

/// Whether an entry of a folder is what a program that was ended while it began a study may
/// have left there: its lock, files under construction, which begin with a dot as well, and
/// folders in which nothing is yet.
fn is_begun(entry: &fs::DirEntry) -> bool {
    let name = entry.file_name();
    let is_empty = || fs::read_dir(entry.path()).is_ok_and(|mut list| list.next().is_none());
    name.as_encoded_bytes().starts_with(b".")
        || FOLDERS.iter().any(|own| name == **own) && is_empty()
}

fn at_work(folder: &Path) -> Error {
    Error::config(
        format_args!("another screendoor is at work in {}", folder.display()),
        "wait for it to end, or name another folder",
    )
}

fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let file = File::options().create(true).truncate(false).write(true).open(&path);
    let file = file.map_err(|e| Error::io("create", &path, e))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(at_work(folder)),
        // Some file systems have no locks: files are whole there too.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}

/// The value in a file of JSON; `None` where there is no file.
///
/// # Errors
/// [`Error::Invalid`] for a damaged file; [`Error::Io`] where it cannot be read.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Error::io("read", path, e)),
    };
    serde_json::from_slice(&bytes).map(Some).map_err(|e| damaged(path, &e.to_string()))
}

/// A value with the checksum of its text.
#[derive(Serialize)]
struct Sealed<'a, T> {
    #[serde(flatten)]
    value: &'a T,
    checksum: String,
}

const CHECKSUM: &str = "checksum";
const VERSION: &str = "version";

/// The BLAKE3 of a JSON object's text, whatever its spaces.
fn checksum(text: &str) -> serde_json::Result<String> {
    let value: serde_json::Value = serde_json::from_str(text)?;
    Ok(blake3::hash(&serde_json::to_vec(&value)?).to_hex().to_string())
}

/// As [`read_json`], for a value that [`Store::put_sealed`] wrote.
///
/// # Errors
/// As [`read_json`]; [`Error::Invalid`] where it bears no checksum or another one than its
/// text has, and where a later version wrote it.
fn read_sealed<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    use serde_json::{Map, Value};
    let Some(mut fields) = read_json::<Map<String, Value>>(path)? else { return Ok(None) };
    let bad = |e: serde_json::Error| damaged(path, &e.to_string());
    let Some(Value::String(written)) = fields.remove(CHECKSUM) else {
        return Err(damaged(path, "it bears no checksum"));
    };
    let text = serde_json::to_string(&fields).map_err(bad)?;
    if checksum(&text).map_err(bad)? != written {
        return Err(damaged(path, "it was changed after it was written: its checksum differs"));
    }
    // Before its fields, of which a later version may have others.
    if let Some(Err(what)) = fields.get(VERSION).and_then(Value::as_u64).map(check_version) {
        let hint = "read it with that screendoor, or measure into another folder";
        return Err(Error::invalid(path.display(), what, hint));
    }
    serde_json::from_str(&text).map(Some).map_err(bad)
}

fn damaged(path: &Path, what: &str) -> Error {
    Error::invalid(
        path.display(),
        what,
        "remove it to have it measured again, or begin in another folder where another version \
         of this program wrote this one",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Estimate;
    use crate::study::analysis::made_up;
    use serde_json::{Map, Value};

    /// A record's fields in a file of a folder, read again.
    fn reread(change: impl FnOnce(&mut Map<String, Value>)) -> Result<Option<Record>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        let record = made_up::record("a", "lk", 8, Estimate::exactly(1.5));
        let Value::Object(mut fields) = serde_json::to_value(&record).unwrap() else { panic!() };
        change(&mut fields);
        Store::put_sealed(&path, &fields).unwrap();
        read_sealed(&path)
    }

    #[test]
    fn records_of_older_folders_are_read_and_those_of_later_versions_refused_as_such() {
        let today = reread(|fields| assert!(!fields.contains_key(VERSION))).unwrap().unwrap();
        assert_eq!(today, made_up::record("a", "lk", 8, Estimate::exactly(1.5)));
        // What was not measured then is not there.
        let older = reread(|fields| {
            for metric in ["filtered", "flip", "flip_hdr", "spectrum"] {
                assert!(fields.remove(metric).is_some(), "{metric}");
            }
        });
        let older = older.unwrap().unwrap();
        assert_eq!((older.filtered.len(), older.flip, older.spectrum), (0, None, None));
        assert_eq!(older.covered, today.covered);
        let later = reread(|fields| {
            fields.insert(VERSION.into(), 7.into());
            fields.insert("of_tomorrow".into(), 1.into());
        });
        let said = later.unwrap_err().to_string();
        assert!(said.contains("record of version 7") && said.contains("up to version 1"), "{said}");
        // What makes a run what it is has no default.
        assert!(reread(|fields| drop(fields.remove("covered"))).is_err());
        assert!(reread(|fields| drop(fields.insert("of_tomorrow".into(), 1.into()))).is_err());
    }
}
