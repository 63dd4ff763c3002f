//! A study's folder: what has been measured, file by file, each whole or not there.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::study::file::{Publication, Study};
use crate::study::record::Record;
use crate::study::results::{Machine, Missing, Results, SceneFacts};
use crate::study::run::folder::{self, STUDY};
use crate::study::run::json::{damaged, put_json, read_json, read_sealed};
use crate::study::run::tasks::{Job, jobs};
use screendoor_trace::error::{Error, Result};
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

const MACHINES: &str = "machine.json";

/// A run's record in a study's folder.
pub(super) fn record_path(folder: &Path, id: &str) -> PathBuf {
    folder.join("runs").join(format!("{id}.json"))
}

/// The trace of a scene that was drawn for a study's folder.
pub(super) fn trace_path(folder: &Path, scene: &str) -> PathBuf {
    folder.join("traces").join(format!("{scene}.arrow"))
}

impl Store {
    /// Begins the folder of `study`, or goes on with it. One that was begun for another study
    /// of which nothing has been measured is taken over.
    ///
    /// # Errors
    /// [`Error::Config`] where the folder is another study's or something else's, or
    /// another program writes there; [`Error::Io`] where it cannot be written.
    pub fn begin(folder: &Path, study: &Study) -> Result<Self> {
        let lock = folder::begin(folder, study)?;
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

    /// Takes a scene's facts and its trace, which it shares, from another study that has the same
    /// scene, where they are there and not here.
    pub(in crate::study) fn borrow_scene(
        &self,
        scene: usize,
        from: &Store,
        other: usize,
    ) -> io::Result<()> {
        let trace = self.folder.join(self.trace_name(scene));
        let facts = self.scene_file(scene);
        if trace.exists() || facts.exists() {
            return Ok(());
        }
        std::fs::hard_link(from.folder.join(from.trace_name(other)), trace)?;
        std::fs::hard_link(from.scene_file(other), facts)
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
        put_json(path, value)
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
