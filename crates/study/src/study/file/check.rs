//! What a study file may say.

use std::collections::{BTreeMap, BTreeSet};

use crate::post::PostFilter;
use crate::study::file::{SceneEntry, ShadowEntry, Study};
use screendoor_scene::capture::{Light, Opacity, ScreenDoor, SplatRules, pattern};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{MAX_SIDE, SamplePattern};

impl Study {
    pub(super) fn check(&self) -> Result<()> {
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
        unique("filter", &self.filters)?;
        self.filters.iter().try_for_each(|filter| PostFilter::parse(filter).map(|_| ()))?;
        if !self.designs.contains(&self.baseline) {
            let designs = self.designs.iter().map(String::as_str);
            return Err(Error::unknown("design as a baseline:", &self.baseline, designs));
        }
        for series in &self.designs {
            self.samples.iter().try_for_each(|s| self.design(series, *s).map(|_| ()))?;
        }
        self.scenes.iter().try_for_each(|scene| scene.check(&self.samples))
    }

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

    pub(super) fn check(&self, samples: &[u32]) -> Result<()> {
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
        if let Some(opacity) = &self.opacity {
            Opacity::parse(opacity)?;
        }
        if let Some(door) = &self.screen_door {
            ScreenDoor::parse(door)?;
        }
        self.check_light()?;
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
            let lacks = |count: &u32| recorded.prefix(*count).is_err();
            let of_light = self.shadow.iter().map(ShadowEntry::samples);
            if let Some(count) = samples.iter().copied().chain(of_light).find(lacks) {
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

    fn check_light(&self) -> Result<()> {
        let name = &self.name;
        let refused = |what: &str, hint: &str| {
            Err(Error::config(format_args!("scene '{name}' has {what}"), hint))
        };
        if let Some(light) = &self.light {
            Light::parse(light)?;
            if self.trace.is_some() {
                return refused("a trace, and a light beside it", "'screendoor shade' it before");
            }
        }
        let Some(shadow) = &self.shadow else { return Ok(()) };
        if self.light.is_none() {
            return refused("a shadow and no light", "add light = 'key', say");
        }
        shadow.check().map_err(|e| {
            let text = e.to_string();
            let (what, hint) = text.rsplit_once("; ").unwrap_or((&text, "correct it"));
            Error::config(format_args!("the shadow of scene '{name}': {what}"), hint)
        })
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
