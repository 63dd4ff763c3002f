//! Measures a study, run by run. Each run's result is a file; what is there is not
//! measured again.

mod apart;
mod check;
mod folder;
mod json;
mod measure;
mod merge;
mod scene;
mod shadow;
mod store;
mod tasks;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

pub use check::check;
pub use json::read_json;
pub use merge::{Agreed, agree};
pub use store::Store;
pub use tasks::{Job, Shard, Task, jobs, tasks};

use crate::study::engine::EngineName;
use crate::study::explained::Explained;
use crate::study::file::Publication;
use crate::study::measure::Reference;
use crate::study::record::Record;
use crate::study::results::Machine;
use crate::study::run::json::put_sealed;
use crate::study::run::measure::{Engines, measure_job};
use crate::study::run::scene::{OpenScene, Watch};
use screendoor_rop::{ExplainLimits, Site};
use screendoor_trace::error::{Error, Result, panic_text};
use screendoor_trace::picture::{Layer, Picture, write_exr};

/// Where a study is measured and what is told of it.
pub struct Runner<'a> {
    /// Its folder.
    pub store: &'a Store,
    /// The folder that the study's paths are seen from.
    pub base: &'a Path,
    /// Which part of it.
    pub shard: Shard,
    /// The GPU, by a part of its name, where one is used.
    pub adapter: Option<&'a str>,
    /// Is told what runs, how many tasks are done, and of how many.
    pub watch: &'a (dyn Fn(&str, u64, u64) + Sync),
}

/// What came of a study's runs.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Outcome {
    /// Runs that were measured.
    pub measured: usize,
    /// Runs that had been measured before.
    pub there: usize,
    /// Runs that could not be done: which, and why.
    pub failed: Vec<(String, String)>,
}

impl Runner<'_> {
    /// The tasks of the part.
    pub fn tasks(&self) -> Vec<Task> {
        self.shard.share(&tasks(self.store.study())).to_vec()
    }

    /// The part's publications that have not been measured.
    pub fn publications(&self) -> Vec<Publication> {
        let publication = |task: Task| match task {
            Task::Publication(p) => Some(p),
            Task::Run(_) => None,
        };
        let missing = |p: &Publication| !self.store.document_file(*p).exists();
        self.tasks().into_iter().filter_map(publication).filter(missing).collect()
    }

    /// Does the part's runs that are not done yet. A run that cannot be done is put down
    /// as such and the others go on.
    ///
    /// # Errors
    /// [`Error::Io`] where results cannot be written, [`Error::Invalid`] where one that is
    /// there is damaged.
    pub fn run(&self) -> Result<Outcome> {
        let tasks = self.tasks();
        let mut outcome = Outcome::default();
        let mut pending = Vec::new();
        for task in &tasks {
            match task {
                Task::Run(job) if self.store.record(job)?.is_some() => outcome.there += 1,
                Task::Run(job) => pending.push(job),
                Task::Publication(_) => {}
            }
        }
        if pending.is_empty() {
            return Ok(outcome);
        }
        let engines = self.engines();
        let gpu = engines.iter().find_map(|(_, e)| e.as_ref().ok()?.adapter());
        self.store.add_machine(&Machine::here(gpu.map(ToString::to_string)))?;
        let mut open = Open::default();
        let outcome = Mutex::new(outcome);
        let told = || outcome.lock().unwrap_or_else(PoisonError::into_inner);
        let watch = |what: &str| {
            let Outcome { measured, there, failed } = &*told();
            (self.watch)(what, (measured + there + failed.len()) as u64, tasks.len() as u64);
        };
        let put = |job: &Job, done: std::result::Result<(), Failure>| -> Result<()> {
            match done {
                Ok(()) => told().measured += 1,
                Err(Failure::Fatal(error)) => return Err(error),
                Err(Failure::Run(why)) => {
                    self.store.put_failure(job, &why)?;
                    told().failed.push((job.id.clone(), why));
                }
            }
            Ok(())
        };
        for jobs in pending.chunk_by(|a, b| (a.scene, a.samples) == (b.scene, b.samples)) {
            let mut shared = None;
            let opened = guarded(|| {
                shared = Some(open.at(self, jobs[0], &watch)?);
                Ok(())
            });
            match (opened, shared) {
                (Ok(()), Some((scene, reference))) => {
                    let cores = apart::cores(&scene.subject, &engines);
                    apart::each(jobs, cores, |job| {
                        put(job, guarded(|| self.one(job, &engines, scene, reference, &watch)))
                    })?;
                }
                (Err(Failure::Fatal(error)), _) => return Err(error),
                (Err(Failure::Run(why)), _) => {
                    jobs.iter().try_for_each(|job| put(job, Err(Failure::Run(why.clone()))))?;
                }
                (Ok(()), None) => unreachable!("what was opened is there"),
            }
        }
        Ok(outcome.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    fn engines(&self) -> Engines {
        let open = |name: &EngineName| {
            let adapter = self.adapter.filter(|_| *name == EngineName::Gpu);
            (*name, name.open(adapter).map_err(|e| e.to_string()))
        };
        self.store.study().engines.iter().map(open).collect()
    }

    fn one(
        &self,
        job: &Job,
        engines: &Engines,
        scene: &OpenScene,
        reference: &Reference,
        watch: Watch<'_>,
    ) -> std::result::Result<(), Failure> {
        let study = self.store.study();
        let (record, picture) = measure_job(study, engines, &scene.subject, reference, job, watch)
            .map_err(Failure::Run)?;
        if study.pictures.contains(&job.samples) {
            self.keep(job, scene, &picture, &reference.picture)?;
        }
        self.finish(job, &record)
    }

    /// Keeps what the report's viewer shows of a run: its picture in the layers that
    /// `screendoor replay --exact` writes, and the scene's pixel.
    fn keep(
        &self,
        job: &Job,
        scene: &OpenScene,
        picture: &Picture,
        reference: &Picture,
    ) -> std::result::Result<(), Failure> {
        let path = self.store.folder().join(Store::picture_name(&job.id));
        let error = picture.minus(reference);
        let layers = [("colour", picture), ("reference", reference), ("error", &error)];
        write_exr(path, &layers.map(|(name, picture)| Layer { name, picture }))?;
        let study = self.store.study();
        let design = study.design(&job.series, job.samples)?;
        let [x, y] = scene.facts.pixel;
        let trace = (&scene.subject.trace, scene.facts.trace.as_str());
        let site = Site { x, y };
        let limits = ExplainLimits { memory: study.memory << 20, ..ExplainLimits::default() };
        let seed = study.first_seed;
        let explained = Explained::of(&design, trace, job.samples, seed, site, limits, &|_, _| ())?;
        Ok(Store::put(&self.store.explanation_file(&job.id), &explained)?)
    }

    /// The record is written last: a run is there with all that belongs to it, or not.
    fn finish(&self, job: &Job, record: &Record) -> std::result::Result<(), Failure> {
        put_sealed(&self.store.record_file(&job.id), record)?;
        // Of a try before this one.
        let _ = fs::remove_file(self.store.failure_file(&job.id));
        Ok(())
    }
}

/// A panic within a run is a fault of that run: the others go on.
fn guarded(
    run: impl FnOnce() -> std::result::Result<(), Failure>,
) -> std::result::Result<(), Failure> {
    // What a run changes outside of itself are files, which appear whole or not at all, and
    // the open scene, which is replaced as a whole.
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        Err(Failure::Run(format!(
            "a thread panicked: {}; this is a fault of screendoor: report it",
            panic_text(&*panic)
        )))
    })
}

/// Why a run has no result.
enum Failure {
    /// Nor would the others: the disk is full, say.
    Fatal(Error),
    /// This run cannot be done.
    Run(String),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match &error {
            Error::Io { action: "write" | "create", .. } => Failure::Fatal(error),
            _ => Failure::Run(error.to_string()),
        }
    }
}

/// The scene and the reference of the run before, which the next one shares as a rule.
#[derive(Default)]
struct Open {
    scene: Option<(usize, std::result::Result<OpenScene, String>)>,
    reference: Option<Reference>,
}

impl Open {
    fn at(
        &mut self,
        runner: &Runner<'_>,
        job: &Job,
        watch: Watch<'_>,
    ) -> std::result::Result<(&OpenScene, &Reference), Failure> {
        let store = runner.store;
        if self.scene.as_ref().is_none_or(|(index, _)| *index != job.scene) {
            // The one before goes first: two may not fit into memory.
            (self.scene, self.reference) = (None, None);
            let scene = match OpenScene::open(store, job.scene, runner.base, watch) {
                Ok(scene) => Ok(scene),
                Err(error) => match Failure::from(error) {
                    Failure::Run(why) => Err(why),
                    fatal => return Err(fatal),
                },
            };
            self.scene = Some((job.scene, scene));
        }
        let scene = match &self.scene {
            Some((_, Ok(scene))) => scene,
            Some((_, Err(why))) => return Err(Failure::Run(why.clone())),
            None => return Err(Failure::Run("its scene is not open".to_string())),
        };
        let reference = match self.reference.take().filter(|r| r.samples == job.samples) {
            Some(reference) => reference,
            None => {
                watch(&format!("exact at {} on {}", job.samples, scene.facts.name));
                Reference::of(&scene.subject, job.samples, &store.study().metrics)?
                    .filtered_by(&scene.subject, &store.study().filters)?
            }
        };
        Ok((scene, self.reference.insert(reference)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_panics_is_a_run_that_failed() {
        // In a thread of the pool, as replays do.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let found = guarded(|| pool.install(|| panic!("index {} is\nout of bounds", 7)));
        let Err(Failure::Run(why)) = found else { panic!("the panic is lost") };
        assert!(why.starts_with("a thread panicked: index 7 is out of bounds; this is"), "{why}");
        assert!(guarded(|| Ok(())).is_ok());
    }
}
