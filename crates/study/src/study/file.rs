//! The study file: what to measure, as TOML.

mod check;
mod scene;
mod shadow;
mod text;
mod traces;

use std::path::Path;

use serde::{Deserialize, Serialize};

pub use scene::SceneEntry;
pub use shadow::{Several, ShadowEntry};

use crate::study::engine::EngineName;
use crate::study::file::text::{explained, read_text};
use screendoor_designs::{Configured, configure};
use screendoor_scene::capture::{Faces, Order, PatternKind};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Options;

screendoor_trace::options! {
    /// A metric beyond the errors, which are always taken.
    pub enum Metric {
        Flip = "flip": "FLIP of the pictures on a display of standard range",
        FlipHdr = "flip-hdr": "FLIP over all exposures in which something shows",
        Spectrum = "spectrum": "the error's radially averaged power spectrum",
        Filtered = "filtered": "RMSE after a Gaussian of 1 and of 2 pixels",
        Blocks = "blocks": "RMSE over the frame after averaging over blocks of 4 by 4 pixels",
    }
}

screendoor_trace::options! {
    /// Publications whose figures are measured again.
    pub enum Publication {
        LaineKarras = "lk": "Laine and Karras: table 1, figures 1, 3, 5, 6",
        Methods = "methods": "Enderton's examples, Wyman's probabilities, hashes, LK figure 8",
        Slab = "slab": "Wyman's claim: SLAB with 8 layers against 32 samples",
        Comparison = "comparison": "all designs at equal state, and Wyman's claim",
        Beyond = "beyond": "no publication's: residual and merging beside LK, error and bias over many seeds",
        Splats = "splats": "no publication's: samplers and layers on files of Gaussian splats",
        Programs = "programs": "no publication's: fragments that four programs drew, under each design",
        Shadows = "shadows": "Enderton's shadow maps: figures 3 and 5, and visibility by every design that tells it",
        ScreenDoor = "screen-door": "Object-space screen-door transparency: opacity by angle, distance and size",
        Costs = "costs": "costs as Enderton and Wyman print them: multiples of blending, depth peeling, views",
        Stability = "stability": "no publication's: hard cases with known truth, and correlations",
    }
}

impl Publication {
    /// Whether another one measures all of this one's figures too.
    pub(crate) fn is_part_of(self, other: Publication) -> bool {
        self == Publication::Slab && other == Publication::Comparison
    }
}

/// A study: every design at every sample count on every scene.
///
/// Read from TOML; unknown keys are errors. Written beside the results with every default
/// filled in.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// What it is called.
    pub name: String,
    /// What it is for, in a sentence or two.
    #[serde(default)]
    pub description: String,
    /// Designs as `NAME` or `NAME:parameter=value,…`; `{n}` stands for the sample count
    /// and `{2n}` for twice of it.
    pub designs: Vec<String>,
    /// Samples per pixel: of 1, 2, 4, 8, 16, 32 and 64.
    pub samples: Vec<u32>,
    /// How many seeds, for designs that have any. More make intervals narrower.
    #[serde(default = "defaults::seeds")]
    pub seeds: u32,
    /// The first of them.
    #[serde(default)]
    pub first_seed: u32,
    /// Engines: the first draws what errors are taken of, all are timed.
    #[serde(default = "defaults::engines")]
    pub engines: Vec<EngineName>,
    /// Timed replays with each engine, at least; those of the seeds count for the first. 0 times
    /// nothing.
    #[serde(default = "defaults::timing")]
    pub timing: u32,
    /// Metrics beyond the errors.
    #[serde(default = "defaults::metrics")]
    pub metrics: Vec<Metric>,
    /// Filters of the finished pictures, each of which is tried on every picture:
    /// `NAME[:parameter=value,…]`.
    #[serde(default)]
    pub filters: Vec<String>,
    /// The design that others are held against; the first of `designs` where not given.
    #[serde(default)]
    pub baseline: String,
    /// Publications whose figures are measured again, with built-in scenes.
    #[serde(default)]
    pub publications: Vec<Publication>,
    /// Samples per pixel of the pictures that are kept for the report's viewer; none for
    /// an empty list, and the one of `samples` that is nearest to 8 where not given.
    #[serde(default)]
    pub pictures: Vec<u32>,
    /// MiB that a design may take whose state grows with the fragments.
    #[serde(default = "defaults::memory")]
    pub memory: u64,
    /// The scenes.
    #[serde(rename = "scene")]
    pub scenes: Vec<SceneEntry>,
}

/// A design's name at a sample count.
fn at(series: &str, samples: u32) -> String {
    series.replace("{n}", &samples.to_string()).replace("{2n}", &(2 * samples).to_string())
}

/// The design of that name.
fn design_at(series: &str, samples: u32) -> Result<Configured> {
    configure(&at(series, samples), &[])
}

/// The default study.
const PRESET: &str = include_str!("default.toml");

/// What a study file need not say.
mod defaults {
    use super::{EngineName, Faces, Metric, Order, PatternKind};
    use screendoor_rop::Implementation;

    /// Samples per pixel of the pictures that are kept, where there are so many.
    pub(super) const PICTURES: u32 = 8;
    /// The frame of what has no camera with one of its own.
    pub(super) const SIZE: [u32; 2] = [512, 512];

    pub(super) fn seeds() -> u32 {
        8
    }
    pub(super) fn engines() -> Vec<EngineName> {
        vec![EngineName::Cpu(Implementation::Fast)]
    }
    pub(super) fn timing() -> u32 {
        3
    }
    pub(super) fn metrics() -> Vec<Metric> {
        vec![Metric::Flip, Metric::FlipHdr, Metric::Spectrum, Metric::Filtered]
    }
    pub(super) fn memory() -> u64 {
        512
    }
    pub(super) fn order() -> Order {
        Order::Api
    }
    pub(super) fn faces() -> Faces {
        Faces::Material
    }
    pub(super) fn pattern() -> PatternKind {
        PatternKind::Auto
    }
    pub(super) fn captured() -> u32 {
        64
    }
}

impl Study {
    /// Reads the study in `text`; `place` names it in errors.
    ///
    /// # Errors
    /// [`Error::Config`] where it is no study: where, what, and what would be right; for
    /// an unknown key or name the nearest one.
    pub fn parse(text: &str, place: &str) -> Result<Self> {
        let mut study: Study = toml::from_str(text).map_err(|e| explained(&e, text, place))?;
        let given: toml::Table = toml::from_str(text).map_err(|e| explained(&e, text, place))?;
        study.adapt_defaults(&given);
        let wrong = |e: Error| Error::config(format_args!("{place}: {e}"), "correct it");
        let scenes = std::mem::take(&mut study.scenes).into_iter().map(SceneEntry::swept);
        study.scenes = scenes.collect::<Result<Vec<_>>>().map_err(wrong)?.concat();
        study.check().map_err(wrong)?;
        Ok(study)
    }

    /// Reads the study at `path`.
    ///
    /// # Errors
    /// [`Error::Io`] where it cannot be read or has more than 1 MiB, and as [`Study::parse`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = read_text(path)?;
        Study::parse(&text, &path.display().to_string())
    }

    /// The study that the built-in scenes are measured with where none is named.
    ///
    /// # Errors
    /// None: the file is tested.
    pub fn preset() -> Result<Self> {
        Study::parse(PRESET, "the default study")
    }

    /// The study as TOML, every default filled in.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a study's fields are values that TOML has")
    }

    /// The design of a series at a sample count.
    ///
    /// # Errors
    /// As [`configure`].
    pub fn design(&self, series: &str, samples: u32) -> Result<Configured> {
        design_at(series, samples)
    }

    /// The publications to measure: each once, and none that is part of another.
    pub fn publications_to_measure(&self) -> Vec<Publication> {
        let asked = |p: &Publication| self.publications.contains(p);
        let covered = |p: Publication| self.publications.iter().any(|o| p.is_part_of(*o));
        Publication::ALL.iter().copied().filter(|p| asked(p) && !covered(*p)).collect()
    }

    /// What is left out and whose usual value would contradict what is given has another.
    fn adapt_defaults(&mut self, given: &toml::Table) {
        if self.baseline.is_empty() {
            self.baseline = self.designs.first().cloned().unwrap_or_default();
        }
        if !given.contains_key("pictures") {
            // Of two that are as near, the larger.
            let distance = |n: &u32| (n.abs_diff(defaults::PICTURES), u32::MAX - n);
            self.pictures = self.samples.iter().copied().min_by_key(distance).into_iter().collect();
        }
        let scenes = given.get("scene").and_then(toml::Value::as_array);
        let most = self.samples.iter().copied().max().unwrap_or_default();
        for (scene, given) in self.scenes.iter_mut().zip(scenes.into_iter().flatten()) {
            let standard = scene.pattern == PatternKind::Standard;
            if standard && given.get("captured_samples").is_none() {
                // There is no standard pattern of 64.
                scene.captured_samples = most;
            }
        }
        // A camera of a file has its own.
        for scene in self.scenes.iter_mut().filter(|scene| !scene.has_camera_file()) {
            scene.size = scene.size.or(Some(defaults::SIZE));
        }
    }
}

#[cfg(test)]
mod tests;
