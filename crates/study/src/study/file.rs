//! The study file: what to measure, as TOML.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::study::engine::EngineName;
use screendoor_designs::{Configured, configure};
use screendoor_scene::capture::{
    CameraChoice, CameraOptions, CaptureOptions, Chosen, Faces, Order, PatternKind, SplatRules,
    pattern,
};
use screendoor_scene::scene::{self, Axes, LoadOptions, Scene};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Options;
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{MAX_SIDE, SamplePattern};

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
    /// Timed replays with each engine, after one that is not timed; 0 times nothing.
    #[serde(default = "defaults::timing")]
    pub timing: u32,
    /// Metrics beyond the errors.
    #[serde(default = "defaults::metrics")]
    pub metrics: Vec<Metric>,
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

/// A scene of a study: drawn for it, or a trace that is there already.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneEntry {
    /// A short name; the files' too.
    pub name: String,
    /// What is drawn: `builtin:NAME[:parameter=value,…]`, or a file, seen from the study
    /// file's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// In its place, a trace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trace: Option<String>,
    /// Frame width and height in pixels; where not given, 512 each, or those of the camera in a
    /// file of cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// Opacity in place of the materials' own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f32>,
    /// A PNG or JPEG for surfaces that have no texture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texture: Option<String>,
    /// Makes every surface white.
    #[serde(default)]
    pub white: bool,
    /// The order in which triangles are drawn.
    #[serde(default = "defaults::order")]
    pub order: Order,
    /// Which shuffle a random order takes.
    #[serde(default)]
    pub order_seed: u32,
    /// Which sides of surfaces are drawn.
    #[serde(default = "defaults::faces")]
    pub faces: Faces,
    /// Where the samples lie.
    #[serde(default = "defaults::pattern")]
    pub pattern: PatternKind,
    /// Samples per pixel that are recorded; the study's counts are its first ones.
    #[serde(default = "defaults::captured")]
    pub captured_samples: u32,
    /// Camera: degrees to the right of the scene's front, degrees above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<[f64; 2]>,
    /// Camera: distance in radii of the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<f64>,
    /// Camera: vertical field of view in degrees; 0 for parallel lines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fov: Option<f64>,
    /// In place of all three, one of the scene's own cameras (glTF) by its name or its number
    /// from 0; or a `.json` file of cameras, seen from the study file's folder: the first of them,
    /// or `camera_name`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Which of them, by its picture's name or its number from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_name: Option<String>,
    /// How Gaussian splats are drawn: `NAME[:parameter=value,…]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splat_rules: Option<String>,
    /// Which way is up in a file that does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<Axes>,
    /// How wide lines of OBJ and glTF files are drawn, in the scene's units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_width: Option<f64>,
    /// What colours stand for, and so in what designs blend them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub space: Option<Space>,
    /// Linear colour behind the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<[f32; 3]>,
    /// The pixel that the report's inspector opens at; one with a handful of fragments
    /// where not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel: Option<[u16; 2]>,
}

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
        study.check().map_err(|e| Error::config(format_args!("{place}: {e}"), "correct it"))?;
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
        Study::parse(include_str!("default.toml"), "the default study")
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
        let spec =
            series.replace("{n}", &samples.to_string()).replace("{2n}", &(2 * samples).to_string());
        configure(&spec, &[])
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

    fn check(&self) -> Result<()> {
        let lists = [
            ("designs", self.designs.len()),
            ("samples", self.samples.len()),
            ("scene", self.scenes.len()),
            ("engines", self.engines.len()),
        ];
        if let Some((name, _)) = lists.iter().find(|(_, len)| *len == 0) {
            return Err(Error::config(format_args!("'{name}' is empty"), "name at least one"));
        }
        unique("design", &self.designs)?;
        unique("sample count", &self.samples)?;
        unique("scene", &self.scenes.iter().map(|s| &s.name).collect::<Vec<_>>())?;
        self.one_case()?;
        unique("engine", &self.engines.iter().map(|e| e.name()).collect::<Vec<_>>())?;
        if !(1..=100_000).contains(&self.seeds) {
            return Err(out_of_range("seeds", self.seeds, "1 to 100000"));
        }
        if self.timing > 10_000 {
            return Err(out_of_range("timing", self.timing, "0 to 10000"));
        }
        if !(1..=1 << 20).contains(&self.memory) {
            return Err(out_of_range("memory", self.memory, "1 to 1048576 MiB"));
        }
        if self.first_seed.checked_add(self.seeds).is_none() {
            let hint = "seeds end at 4294967295";
            return Err(out_of_range("first_seed", self.first_seed, hint));
        }
        for count in self.samples.iter().chain(&self.pictures) {
            if !SamplePattern::is_count(*count) {
                return Err(out_of_range("samples", count, "1, 2, 4, 8, 16, 32 or 64"));
            }
        }
        if let Some(count) = self.pictures.iter().find(|c| !self.samples.contains(c)) {
            let what = format_args!("pictures are kept of {count} samples, which are not measured");
            return Err(Error::config(what, "add the count to 'samples', or change 'pictures'"));
        }
        if !self.designs.contains(&self.baseline) {
            let designs = self.designs.iter().map(String::as_str);
            return Err(Error::unknown("design as a baseline:", &self.baseline, designs));
        }
        for series in &self.designs {
            self.samples.iter().try_for_each(|s| self.design(series, *s).map(|_| ()))?;
        }
        self.scenes.iter().try_for_each(|scene| scene.check(&self.samples))
    }
}

impl Study {
    /// Refuses scenes whose names differ in the case of their letters alone: on some systems
    /// their files would be the same.
    fn one_case(&self) -> Result<()> {
        let mut seen: BTreeMap<String, &str> = BTreeMap::new();
        for SceneEntry { name, .. } in &self.scenes {
            if let Some(other) = seen.insert(name.to_ascii_lowercase(), name) {
                return Err(Error::config(
                    format_args!("the scenes '{other}' and '{name}' differ in case alone"),
                    "rename one: their files would be one file where names have no case",
                ));
            }
        }
        Ok(())
    }
}

impl SceneEntry {
    /// Loads the scene; paths are seen from the folder `base`.
    ///
    /// # Errors
    /// As [`scene::load_with`].
    pub fn load(&self, base: &Path) -> Result<Scene> {
        let source = self.source.as_deref().unwrap_or("");
        let options =
            LoadOptions { axes: self.axes, line_width: self.line_width, ..LoadOptions::default() };
        scene::load_with(&scene::seen_from(source, base), &options)
    }

    /// Which camera it asks for; its file is seen from the folder `base`.
    pub fn camera_choice(&self, base: &Path) -> CameraChoice<'_> {
        let seen =
            |path: &String| if self.has_camera_file() { base.join(path) } else { path.into() };
        CameraChoice {
            camera: self.camera.as_ref().map(seen),
            name: self.camera_name.as_deref(),
            size: self.size,
            default_size: defaults::SIZE,
        }
    }

    fn has_camera_file(&self) -> bool {
        self.camera.as_ref().is_some_and(|path| CameraChoice::is_file(Path::new(path)))
    }

    /// Its frame where no camera has one of its own.
    pub(crate) fn frame(&self) -> [u32; 2] {
        self.size.unwrap_or(defaults::SIZE)
    }

    /// How it is captured, seen by the camera that was chosen for it.
    ///
    /// # Errors
    /// As [`SplatRules::parse`].
    pub fn options(&self, chosen: Chosen) -> Result<CaptureOptions> {
        let splats = self.splat_rules.as_deref().map(SplatRules::parse);
        let [width, height] = chosen.size;
        Ok(CaptureOptions {
            width,
            height,
            samples: self.captured_samples,
            pattern: self.pattern,
            alpha: self.alpha,
            order: self.order,
            order_seed: self.order_seed,
            faces: self.faces,
            background: self.background,
            camera: CameraOptions {
                angle: self.angle,
                distance: self.distance,
                field_of_view: self.fov,
                pose: chosen.pose,
            },
            splats: splats.transpose()?.unwrap_or_default(),
            space: self.space,
            ..CaptureOptions::default()
        })
    }

    /// Refuses a pixel outside of a frame of that size.
    pub(in crate::study) fn check_pixel(&self, [width, height]: [u32; 2]) -> Result<()> {
        match self.pixel {
            Some([x, y]) if u32::from(x) >= width || u32::from(y) >= height => {
                let range = format_args!("0 to {} and 0 to {}", width - 1, height - 1);
                Err(out_of_range("pixel", format_args!("{x}, {y}"), range))
            }
            _ => Ok(()),
        }
    }

    fn check(&self, samples: &[u32]) -> Result<()> {
        let name = &self.name;
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if name.is_empty() || name.len() > 64 || name.starts_with('.') || !name.chars().all(plain) {
            return Err(Error::config(
                format_args!("'{name}' is no name for a scene, since files are called so"),
                "take up to 64 letters, digits, '-', '_' and '.'",
            ));
        }
        if self.source.is_some() == self.trace.is_some() {
            return Err(Error::config(
                format_args!("scene '{name}' needs either a source or a trace"),
                "give one of the two",
            ));
        }
        let cannot = |size: &[u32; 2]| size.iter().any(|side| !(1..=MAX_SIDE).contains(side));
        if let Some([w, h]) = self.size.filter(cannot) {
            return Err(out_of_range("size", format_args!("{w}, {h}"), "1 to 65536 pixels a side"));
        }
        if !SamplePattern::is_count(self.captured_samples) {
            let count = self.captured_samples;
            return Err(out_of_range("captured_samples", count, "1, 2, 4, 8, 16, 32 or 64"));
        }
        if let Some(rules) = &self.splat_rules {
            SplatRules::parse(rules)?;
        }
        if self.camera.is_some()
            && (self.angle.is_some() || self.distance.is_some() || self.fov.is_some())
        {
            return Err(Error::config(
                format_args!("scene '{name}' has a camera, and angle, distance or fov beside it"),
                "give one of the two",
            ));
        }
        if self.camera_name.is_some() && !self.has_camera_file() {
            return Err(Error::config(
                format_args!("scene '{name}' has a camera_name and no file of cameras"),
                "give the file of cameras as 'camera'",
            ));
        }
        if let Some(size) = self.size.filter(|_| self.trace.is_none()) {
            self.check_pixel(size)?;
        }
        if self.trace.is_none() {
            let recorded = pattern(self.pattern, self.captured_samples)?;
            let lacks = |count: &&u32| recorded.prefix(**count).is_err();
            if let Some(count) = samples.iter().find(lacks) {
                return Err(Error::config(
                    format_args!(
                        "scene '{name}' is captured with {} samples, which do not serve {count}",
                        self.captured_samples
                    ),
                    "leave captured_samples out: 64 serve all counts",
                ));
            }
        }
        Ok(())
    }
}

fn out_of_range(key: &str, value: impl std::fmt::Display, range: impl std::fmt::Display) -> Error {
    Error::config(format_args!("'{key}' cannot be {value}"), format_args!("it is {range}"))
}

fn unique<T: Ord + std::fmt::Display>(kind: &str, list: &[T]) -> Result<()> {
    let mut seen = BTreeSet::new();
    match list.iter().find(|v| !seen.insert(*v)) {
        None => Ok(()),
        Some(twice) => {
            Err(Error::config(format_args!("{kind} '{twice}' is named twice"), "name it once"))
        }
    }
}

/// Texts longer than this are no study files.
const MOST_BYTES: u64 = 1 << 20;

pub(super) fn read_text(path: &Path) -> Result<String> {
    use std::io::Read;
    let file = std::fs::File::open(path).map_err(|e| Error::io("read", path, e))?;
    let mut text = String::new();
    let read = file.take(MOST_BYTES + 1).read_to_string(&mut text);
    read.map_err(|e| Error::io("read", path, e))?;
    if text.len() as u64 > MOST_BYTES {
        let what = "it is longer than 1 MiB";
        return Err(Error::invalid(path.display(), what, "give a study file"));
    }
    Ok(text)
}

/// What is wrong with a study file, and where; of an unknown name, which is the nearest.
fn explained(error: &toml::de::Error, text: &str, place: &str) -> Error {
    let place = match error.span() {
        Some(span) => {
            let before = text.get(..span.start).unwrap_or("");
            format!("{place}, line {}", before.matches('\n').count() + 1)
        }
        None => place.to_string(),
    };
    // serde: unknown field `a`, expected one of `b`, `c`.
    let message = error.message().replace('\n', " ");
    let mut names = message.split('`').skip(1).step_by(2);
    let kind = [("unknown field", "key"), ("unknown variant", "name")]
        .into_iter()
        .find_map(|(start, kind)| message.starts_with(start).then_some(kind));
    if let (Some(kind), Some(name)) = (kind, names.next()) {
        return Error::unknown(&format!("{kind} in {place}:"), name, names);
    }
    Error::config(format_args!("{place}: {message}"), "correct it")
}

#[cfg(test)]
mod tests;
