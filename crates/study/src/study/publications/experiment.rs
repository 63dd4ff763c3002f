//! The publications' experiments that are designs on scenes: embedded study files, measured
//! like any study in a folder each, so that what was interrupted goes on.

use std::path::Path;

use serde::Serialize;

use crate::study::file::{SceneEntry, Study};
use crate::study::record::Record;
use crate::study::results::{Machine, Results};
use crate::study::run::{Runner, Shard, Store};
use screendoor_scene::capture::PatternKind;
use screendoor_scene::scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::Statistics;

/// Where experiments are measured.
#[derive(Clone, Copy)]
pub struct Lab<'a> {
    /// What is measured is kept in folders of this one, a study a folder. The folder is named
    /// by what its runs depend on, so that other seeds or frames are measured anew.
    pub folder: &'a Path,
    /// The folder of the models, where one is given.
    pub models: Option<&'a Path>,
    /// Is told what runs, how many steps are done, and of how many.
    pub watch: &'a (dyn Fn(&str, u64, u64) + Sync),
}

/// The embedded study files, each with its scenes.
pub(in crate::study) mod studies {
    macro_rules! study {
        ($study:literal, $scenes:literal) => {
            concat!(
                include_str!(concat!("studies/", $study, ".toml")),
                include_str!(concat!("studies/scenes-", $scenes, ".toml")),
            )
        };
        // On every scene that there is.
        ($study:literal) => {
            concat!(
                include_str!(concat!("studies/", $study, ".toml")),
                include_str!("studies/scenes-models.toml"),
                include_str!("studies/scenes-built-in.toml"),
            )
        };
    }

    pub(crate) const BEYOND: &str = study!("beyond");
    pub(crate) const COMPARISON: &str = study!("comparison");
    pub(crate) const SLAB: &str = study!("slab");
    pub(crate) const SLAB_RIVALS: &str = study!("slab-rivals");
    pub(crate) const DIAL: &str = study!("dial");
    pub(crate) const VARIANTS: &str = study!("variants");
    pub(crate) const MASKS: &str = study!("masks");
    pub(crate) const ROUNDS: &str = study!("rounds");
    pub(crate) const TABLE_1: &str = study!("table-1", "table-1");
    pub(crate) const VIEWS: &str = study!("views");
    pub(crate) const EXPECTATIONS: &str = study!("expectations");
    pub(crate) const EXPECTATIONS_CLOSELY: &str = study!("expectations-closely");
    pub(crate) const FIGURE_8: &str = study!("figure-8", "figure-8");
    pub(crate) const SPLATS: &str = study!("splats", "splats");
    pub(crate) const PROGRAMS: &str = study!("programs", "programs");
}

/// Reads an embedded study.
///
/// # Errors
/// None: the files are tested.
pub(in crate::study) fn parse(text: &str) -> Result<Study> {
    Study::parse(text, "an embedded study")
}

/// How an experiment's scenes are captured and how many seeds are replayed.
#[derive(Clone, Copy, Debug)]
pub(in crate::study) struct Frames {
    /// The square frame's side in pixels.
    pub side: u32,
    /// Samples per pixel that are recorded.
    pub captured: u32,
    /// Where they lie.
    pub pattern: PatternKind,
    /// Seeds of each run.
    pub seeds: u32,
}

impl Frames {
    /// Frames whose samples lie where an antialiased picture has them.
    pub(crate) fn new(side: u32, captured: u32, seeds: u32) -> Self {
        Frames { side, captured, pattern: PatternKind::Auto, seeds }
    }

    /// The same with all samples at the pixel's centre: without antialiasing.
    pub(crate) fn centred(self) -> Self {
        Frames { pattern: PatternKind::Centre, ..self }
    }
}

impl Study {
    /// The study with other frames and seeds.
    pub(in crate::study) fn in_frames(mut self, frames: Frames) -> Self {
        let Frames { side, captured, pattern, seeds } = frames;
        self.seeds = seeds;
        for scene in &mut self.scenes {
            scene.size = Some([side, side]);
            scene.captured_samples = captured;
            scene.pattern = pattern;
        }
        if pattern == PatternKind::Centre {
            self.name.push_str("-centred");
        }
        self
    }

    /// The study on some of its scenes.
    pub(in crate::study) fn only(mut self, wanted: impl Fn(&SceneEntry) -> bool) -> Self {
        self.scenes.retain(wanted);
        self
    }
}

impl SceneEntry {
    /// What is drawn, or the trace of what was.
    pub(in crate::study) fn drawn(&self) -> &str {
        self.source.as_deref().or(self.trace.as_deref()).unwrap_or("")
    }

    /// Whether it needs no file.
    pub(in crate::study) fn is_built_in(&self) -> bool {
        scene::path_of(self.drawn()).is_none()
    }

    /// What results call it: a built-in scene by its source, which no model has.
    pub(in crate::study) fn title(&self) -> String {
        if self.is_built_in() { self.drawn().to_string() } else { self.name.replace('-', " ") }
    }
}

/// What an experiment gave.
#[derive(Debug)]
pub(in crate::study) struct Found {
    /// The records and the scenes' facts.
    pub results: Results,
    /// Sources of scenes that were not given.
    pub missing: Vec<String>,
}

/// One scene of an experiment with all that was measured on it.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredScene {
    /// What results call it.
    pub name: String,
    /// The trace in numbers.
    pub statistics: Statistics,
    /// Sample count after sample count, designs in the study's order.
    pub records: Vec<Record>,
}

impl MeasuredScene {
    /// The record of a design, as the study has it, at a sample count.
    pub fn record(&self, series: &str, samples: u32) -> Option<&Record> {
        self.records.iter().find(|r| r.series == series && r.samples == samples)
    }

    /// The same where there is one sample count.
    pub fn variant(&self, series: &str) -> Option<&Record> {
        self.records.iter().find(|r| r.series == series)
    }
}

impl Found {
    /// The scenes that are there, called by `title`.
    pub(crate) fn scenes(&self, title: impl Fn(&SceneEntry) -> String) -> Vec<MeasuredScene> {
        let Results { study, scenes, records, .. } = &self.results;
        let both = study.scenes.iter().zip(scenes);
        both.map(|(entry, facts)| MeasuredScene {
            name: title(entry),
            statistics: facts.statistics.clone(),
            records: records.iter().filter(|r| r.scene == entry.name).cloned().collect(),
        })
        .collect()
    }
}

impl Lab<'_> {
    /// Measures what is missing of a study on those of its scenes that are there.
    ///
    /// # Errors
    /// As [`Store::begin`] and [`Runner::run`]; the first run's that could not be done.
    pub(in crate::study) fn measure(&self, mut study: Study) -> Result<Found> {
        let base = self.models.unwrap_or(Path::new(""));
        let given = |file: &str| self.models.is_some() && base.join(file).is_file();
        let is_there = |entry: &SceneEntry| entry.is_built_in() || given(entry.drawn());
        let lacking = study.scenes.iter().filter(|s| !is_there(s));
        let missing: Vec<String> = lacking.map(|s| s.drawn().to_string()).collect();
        study.scenes.retain(is_there);
        for scene in &mut study.scenes {
            scene.texture = scene.texture.take().filter(|file| given(file));
        }
        if study.scenes.is_empty() {
            let (machine, nothing) = (Machine::default(), Vec::new());
            let (scenes, records) = (Vec::new(), Vec::new());
            let results = Results { study, machine, scenes, records, missing: nothing };
            return Ok(Found { results, missing });
        }
        let store = Store::begin(&self.place(&study), &study)?;
        self.lend(&store);
        let watch = |what: &str, done, total| {
            (self.watch)(&format!("{}: {what}", study.name), done, total);
        };
        Runner { store: &store, base, shard: Shard::WHOLE, adapter: None, watch: &watch }.run()?;
        let results = store.results()?;
        match results.missing.first() {
            Some(run) => Err(Error::config(
                format_args!("{} of '{}' could not be done: {}", run.id, study.name, run.reason()),
                "correct that and call it again: the other runs are kept",
            )),
            None => Ok(Found { results, missing }),
        }
    }

    /// Gives a study the built-in scenes that another one in this folder has drawn alike, so that
    /// none is drawn twice. What cannot be lent is drawn.
    fn lend(&self, to: &Store) {
        for folder in std::fs::read_dir(self.folder).into_iter().flatten().flatten() {
            let folder = folder.path();
            let Ok(from) = Store::open(&folder) else { continue };
            // Of this program's version, and not the same folder.
            if folder == to.folder() || self.place(from.study()) != folder {
                continue;
            }
            for (scene, entry) in to.study().scenes.iter().enumerate() {
                let same = from.study().scenes.iter().position(|other| other == entry);
                let same = same.filter(|_| from.study().memory == to.study().memory);
                if let Some(same) = same.filter(|_| entry.is_built_in()) {
                    let _ = to.borrow_scene(scene, &from, same);
                }
            }
        }
    }

    /// Removes the traces of what was measured, which are large and can be drawn again.
    pub fn forget_traces(&self) {
        for study in std::fs::read_dir(self.folder).into_iter().flatten().flatten() {
            // What stays is in nobody's way.
            let _ = std::fs::remove_dir_all(study.path().join("traces"));
        }
    }

    /// The folder of a study: by what its runs depend on.
    pub(in crate::study) fn place(&self, study: &Study) -> std::path::PathBuf {
        let mut hasher = blake3::Hasher::new();
        let models = self.models.map(|m| m.display().to_string()).unwrap_or_default();
        for part in [env!("CARGO_PKG_VERSION"), &models, &study.to_toml()] {
            hasher.update(blake3::hash(part.as_bytes()).as_bytes());
        }
        self.folder.join(format!("{}-{}", study.name, &hasher.finalize().to_hex()[..8]))
    }
}

/// A lab for tests, in a folder that goes away.
#[cfg(any(test, feature = "made-up"))]
pub struct Quiet(tempfile::TempDir);

#[cfg(any(test, feature = "made-up"))]
impl Quiet {
    /// In a new folder.
    #[expect(clippy::new_without_default, reason = "it makes a folder")]
    pub fn new() -> Self {
        Quiet(tempfile::tempdir().unwrap())
    }

    /// The lab.
    pub fn lab(&self) -> Lab<'_> {
        Lab { folder: self.0.path(), models: None, watch: &|_, _, _| () }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// Two designs on one small scene.
    fn small() -> Study {
        let mut study = parse(studies::ROUNDS).unwrap().only(|s| s.drawn() == "builtin:cloth");
        study.designs = ["enderton", "kbuffer:layers=2"].map(String::from).to_vec();
        study.baseline = "enderton".to_string();
        study.in_frames(Frames::new(24, 32, 2))
    }

    #[test]
    fn an_experiment_that_was_interrupted_goes_on_and_another_one_is_measured_anew() {
        let quiet = Quiet::new();
        let lab = quiet.lab();
        let first = lab.measure(small()).unwrap().results.records;
        assert_eq!(first.len(), 2);
        let store = Store::open(&lab.place(&small())).unwrap();
        let kept = store.record_file(&store.jobs()[0].id);
        let lost = store.record_file(&store.jobs()[1].id);
        let time = |path: &Path| std::fs::metadata(path).unwrap().modified().unwrap();
        let before = time(&kept);
        std::fs::remove_file(&lost).unwrap();
        let again = lab.measure(small()).unwrap().results.records;
        assert_eq!(again, first);
        assert!(lost.exists() && time(&kept) == before);
        // More seeds are another study, in a folder of its own.
        let other = small().in_frames(Frames::new(24, 32, 3));
        assert_ne!(lab.place(&other), lab.place(&small()));
        assert_eq!(lab.measure(other).unwrap().results.records[0].seeds, 3);
        // Without its traces it is still the same.
        lab.forget_traces();
        assert!(!lab.place(&small()).join("traces").exists());
        assert_eq!(lab.measure(small()).unwrap().results.records, first);
    }

    #[test]
    fn a_scene_that_another_study_has_drawn_is_not_drawn_again() {
        let quiet = Quiet::new();
        let said = Mutex::new(Vec::new());
        let watch = |what: &str, _, _| said.lock().unwrap().push(what.to_string());
        let lab = Lab { watch: &watch, ..quiet.lab() };
        let mut other = small();
        other.name.push_str("-other");
        other.designs.truncate(1);
        let larger = other.clone().in_frames(Frames::new(32, 32, 2));
        let mut traces = Vec::new();
        for (study, is_drawn) in [(small(), true), (other, false), (larger, true)] {
            traces.push(lab.measure(study).unwrap().results.scenes[0].content.clone());
            let said = std::mem::take(&mut *said.lock().unwrap());
            assert_eq!(said.iter().any(|s| s.contains("capturing")), is_drawn, "{said:?}");
        }
        assert!(traces[0] == traces[1] && traces[1] != traces[2]);
    }

    #[test]
    fn models_that_are_not_there_are_named_and_the_other_scenes_measured() {
        let quiet = Quiet::new();
        let models = tempfile::tempdir().unwrap();
        let lab = Lab { models: Some(models.path()), ..quiet.lab() };
        let mut study = parse(studies::ROUNDS).unwrap();
        study.designs.truncate(1);
        let wanted = ["oak_large_leaves.obj", "builtin:hair"];
        let study = study.only(|s| wanted.contains(&s.drawn())).in_frames(Frames::new(16, 4, 1));
        let found = lab.measure(study.clone()).unwrap();
        assert_eq!(found.missing, ["oak_large_leaves.obj"]);
        assert_eq!(found.results.study.scenes[0].title(), "builtin:hair");
        let none = lab.measure(study.only(|s| !s.is_built_in())).unwrap();
        assert!(none.results.records.is_empty() && none.missing.len() == 1);
        // One that cannot be read is an error that says which.
        std::fs::write(models.path().join("oak_large_leaves.obj"), "f 1 2 3\n").unwrap();
        let mut study = parse(studies::ROUNDS).unwrap().only(|s| s.name == "oak");
        study.designs.truncate(1);
        let said = lab.measure(study.in_frames(Frames::new(16, 4, 1))).unwrap_err().to_string();
        assert!(said.contains("oak") && said.contains("oak_large_leaves.obj"), "{said}");
    }

    #[test]
    fn every_study_file_is_a_study() {
        use studies::*;
        let all = [
            BEYOND,
            COMPARISON,
            SLAB,
            SLAB_RIVALS,
            DIAL,
            VARIANTS,
            MASKS,
            ROUNDS,
            TABLE_1,
            VIEWS,
            EXPECTATIONS,
            EXPECTATIONS_CLOSELY,
            FIGURE_8,
            SPLATS,
            PROGRAMS,
        ];
        let mut names: Vec<String> = all.map(|text| parse(text).unwrap().name).to_vec();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), all.len());
    }
}
