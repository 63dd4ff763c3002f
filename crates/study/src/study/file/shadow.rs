//! The shadows of a scene of a study: the designs that draw its light's view, and how that is
//! looked up.

use serde::{Deserialize, Serialize};

use crate::study::file::{SceneEntry, at, design_at};
use crate::study::shadows::ShadowOptions;
use screendoor_rop::ReplayOptions;
use screendoor_rop::visibility::{Filter, Taps};
use screendoor_scene::capture::{PatternKind, pattern};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{Header, MAX_SIDE, Trace, TraceWriter, WriteOptions};

/// One value, or all those that a study tries.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(untagged, expecting = "neither a value of this key nor a list of some")]
pub enum Several<T> {
    /// One.
    One(T),
    /// A scene for each.
    Many(Vec<T>),
}

impl<T> Several<T> {
    /// All of them.
    pub fn all(&self) -> &[T] {
        match self {
            Several::One(one) => std::slice::from_ref(one),
            Several::Many(list) => list,
        }
    }
}

/// How a scene's light is drawn and looked up. Of keys with several values each combination is a
/// scene of its own.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShadowEntry {
    /// What draws the light's view; `{n}` stands for its samples, `{2n}` for twice of them.
    pub design: Several<String>,
    /// Samples of a pixel of the light's map.
    #[serde(default = "defaults::samples")]
    pub samples: Several<u32>,
    /// Places of the map with which a fragment is compared.
    #[serde(default = "defaults::pcf")]
    pub pcf: Several<u32>,
    /// Half the width of the region in which they lie, in pixels of the map.
    #[serde(default = "defaults::radius")]
    pub radius: f64,
    /// Where in it they lie.
    #[serde(default = "defaults::taps")]
    pub taps: Taps,
    /// How far a fragment is drawn towards the light, as a share of the depth range.
    #[serde(default = "defaults::bias")]
    pub bias: f64,
    /// The same, in pixels of the map for which the surface's slope is followed.
    #[serde(default = "defaults::slope_bias")]
    pub slope_bias: f64,
    /// How often the light's view is drawn, each time with another seed.
    #[serde(default = "defaults::rounds")]
    pub rounds: u32,
    /// The first seed.
    #[serde(default)]
    pub seed: u32,
    /// Width and height of the map in pixels.
    #[serde(default = "defaults::size")]
    pub size: [u32; 2],
}

mod defaults {
    use super::{Filter, Several, Taps};

    pub(super) fn samples() -> Several<u32> {
        Several::One(8)
    }
    pub(super) fn pcf() -> Several<u32> {
        Several::One(Filter::default().taps)
    }
    pub(super) fn radius() -> f64 {
        1.5
    }
    pub(super) fn taps() -> Taps {
        Taps::Regular
    }
    pub(super) fn bias() -> f64 {
        Filter::default().bias
    }
    pub(super) fn slope_bias() -> f64 {
        Filter::default().slope_bias
    }
    pub(super) fn rounds() -> u32 {
        1
    }
    pub(super) fn size() -> [u32; 2] {
        [512, 512]
    }
}

impl SceneEntry {
    /// The scene, or where its shadows have keys of several values one for each combination,
    /// called `NAME-DESIGN-SAMPLES-PCF`.
    ///
    /// # Errors
    /// [`Error::Config`] for an empty list.
    pub(super) fn swept(self) -> Result<Vec<SceneEntry>> {
        let Some(shadow) = &self.shadow else { return Ok(vec![self]) };
        let ShadowEntry { design, samples, pcf, .. } = shadow;
        let counts = [
            ("design", design.all().len()),
            ("samples", samples.all().len()),
            ("pcf", pcf.all().len()),
        ];
        if let Some((key, _)) = counts.iter().find(|(_, count)| *count == 0) {
            return Err(Error::config(
                format_args!("'{key}' of scene '{}' is empty", self.name),
                "name at least one",
            ));
        }
        if counts.iter().all(|(_, count)| *count == 1) {
            return Ok(vec![self.with(&design.all()[0], samples.all()[0], pcf.all()[0])]);
        }
        let mut scenes = Vec::new();
        for design in design.all() {
            for samples in samples.all() {
                for pcf in pcf.all() {
                    let mut scene = self.with(design, *samples, *pcf);
                    let fits = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
                    let series = at(design, *samples);
                    let word: String =
                        series.chars().map(|c| if fits(c) { c } else { '-' }).collect();
                    scene.name = format!("{}-{word}-{samples}-{pcf}", self.name);
                    scenes.push(scene);
                }
            }
        }
        Ok(scenes)
    }

    /// The scene with one value of each of the keys that may have several.
    fn with(&self, design: &str, samples: u32, pcf: u32) -> SceneEntry {
        let shadow = self.shadow.clone().map(|shadow| ShadowEntry {
            design: Several::One(design.to_string()),
            samples: Several::One(samples),
            pcf: Several::One(pcf),
            ..shadow
        });
        SceneEntry { shadow, ..self.clone() }
    }
}

impl ShadowEntry {
    /// Samples of a pixel of the light's map; the first where several are still to be tried.
    pub fn samples(&self) -> u32 {
        self.samples.all()[0]
    }

    /// How the light's view is drawn and looked up; errors are taken.
    ///
    /// # Errors
    /// As [`screendoor_designs::configure`].
    pub fn options(&self) -> Result<ShadowOptions> {
        let filter = Filter {
            taps: self.pcf.all()[0],
            radius: self.radius,
            kind: self.taps,
            bias: self.bias,
            slope_bias: self.slope_bias,
            seed: self.seed,
        };
        Ok(ShadowOptions {
            design: design_at(&self.design.all()[0], self.samples())?,
            samples: self.samples(),
            seed: self.seed,
            rounds: self.rounds,
            filter,
            measure: true,
        })
    }

    pub(super) fn check(&self) -> Result<()> {
        let nothing = nothing(self.samples())?;
        if let Some(side) = self.size.iter().find(|side| !(1..=MAX_SIDE).contains(*side)) {
            return Err(Error::config(
                format_args!("a light's map cannot be {side} pixels wide or high"),
                format_args!("each side is 1 to {MAX_SIDE} pixels"),
            ));
        }
        let options = self.options()?;
        options.check()?;
        // Refused here as it would be by a trace with something in it.
        options.design.visibility_map(&nothing, self.samples(), 0, &ReplayOptions::default())?;
        Ok(())
    }
}

/// A trace of one pixel without fragments.
fn nothing(samples: u32) -> Result<Trace> {
    let pattern = pattern(PatternKind::Auto, samples)?;
    let header = Header { width: 1, height: 1, pattern, ..Header::default() };
    let writer = TraceWriter::new(Vec::new(), "nothing", header, WriteOptions::default())?;
    Trace::from_bytes(writer.finish()?.0, "nothing")
}
