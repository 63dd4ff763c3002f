//! All that a study has measured, as reports take it.

use serde::{Deserialize, Serialize};

use crate::study::file::Study;
use crate::study::record::Record;
use crate::study::shadows::{ShadowCost, VisibilityError};
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{Statistics, View};

/// A study with what has been measured of it.
#[derive(Clone, PartialEq, Debug)]
pub struct Results {
    /// What was to be measured, every default filled in.
    pub study: Study,
    /// On what machine.
    pub machine: Machine,
    /// The scenes whose traces are known, in the study's order.
    pub scenes: Vec<SceneFacts>,
    /// What has been measured: scene after scene, sample count after sample count, designs
    /// in the study's order.
    pub records: Vec<Record>,
    /// What has not, in the same order.
    pub missing: Vec<Missing>,
}

/// A scene's trace.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFacts {
    /// The scene's name in the study.
    pub name: String,
    /// The trace's file, seen from the results' folder where it lies in there.
    pub trace: String,
    /// BLAKE3 of its content.
    pub content: String,
    /// Frame width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel that it has.
    pub samples: u32,
    /// Where it comes from.
    pub source: String,
    /// The camera.
    pub camera: String,
    /// The same in numbers, where the trace has them. They are no part of the content.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<View>,
    /// What the trace's colours stand for, and so in what values errors are.
    #[serde(default, skip_serializing_if = "Space::is_linear")]
    pub space: Space,
    /// What its file holds and is not drawn, a line for each kind.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// The pixel that the report's inspector opens at.
    pub pixel: [u16; 2],
    /// It in numbers.
    pub statistics: Statistics,
    /// What a design found of the shadows in it, where it has some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shadow: Option<ShadowFacts>,
}

/// What a design that drew a light's view found of the light that reaches a camera's fragments.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShadowFacts {
    /// What the camera sees.
    pub source: String,
    /// BLAKE3 of the camera's trace before it was shaded.
    pub camera: String,
    /// BLAKE3 of the light's trace.
    pub light: String,
    /// Width and height of the light's map in pixels.
    pub size: [u32; 2],
    /// What drew it, as the study has it at all sample counts: `merging:layers={n}`.
    pub series: String,
    /// The same at this one.
    pub design: String,
    /// Its family.
    pub family: String,
    /// At how many samples a pixel.
    pub samples: u32,
    /// How many times, with a seed each.
    pub rounds: u32,
    /// With how many places a fragment was compared.
    pub pcf: u32,
    /// What the map costs.
    pub cost: ShadowCost,
    /// How far the visibilities are from the exact ones over the same places.
    pub error: VisibilityError,
}

impl SceneFacts {
    /// Whether a trace with this content and view is the one that was measured. What was
    /// measured before traces had views had none that it could depend on.
    pub(crate) fn are_of(&self, content: &str, view: Option<&View>) -> bool {
        let views = self.view.as_ref().zip(view);
        self.content == content && views.is_none_or(|(measured, found)| measured == found)
    }
}

/// Where and with what a study was run.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// This program's version.
    pub screendoor: String,
    /// The processor's name.
    pub processor: String,
    /// Threads that replay.
    pub threads: usize,
    /// Bytes of memory, where the system tells.
    pub memory: Option<u64>,
    /// The operating system and the processor's kind.
    pub system: String,
    /// The instruction set of the fast engines.
    pub vectors: String,
    /// The GPU and its driver, where one was used.
    pub gpu: Option<String>,
}

/// A run without a result.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Missing {
    /// The run.
    pub id: String,
    /// Its scene.
    pub scene: String,
    /// Its design, as the study has it.
    pub series: String,
    /// Its samples per pixel.
    pub samples: u32,
    /// Why; `None` where it has not been run yet.
    pub why: Option<String>,
}

impl Machine {
    /// What is known of it, for people: what it is, and how much or which.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let gib = |bytes: u64| format!("{:.0} GiB", bytes as f64 / (1_u64 << 30) as f64);
        let facts = [
            ("screendoor", self.screendoor.clone()),
            ("Processor", self.processor.clone()),
            ("Threads", self.threads.to_string()),
            ("Memory", self.memory.map(gib).unwrap_or_default()),
            ("System", self.system.clone()),
            ("Vector instructions", self.vectors.clone()),
            ("GPU", self.gpu.clone().unwrap_or_default()),
        ];
        facts.into_iter().filter(|(_, value)| !value.is_empty()).collect()
    }
}

impl Missing {
    /// Why there is no result, in words.
    pub fn reason(&self) -> &str {
        self.why.as_deref().unwrap_or("not run yet")
    }
}

impl Results {
    /// The names of the engines of the study and of its records, those of the study first.
    pub fn engines(&self) -> Vec<String> {
        let of_study = self.study.engines.iter().map(|e| e.name().to_string());
        let of_records = self.records.iter().flat_map(|r| r.speed.keys().cloned());
        let mut list: Vec<String> = Vec::new();
        for engine in of_study.chain(of_records) {
            if !list.contains(&engine) {
                list.push(engine);
            }
        }
        list
    }

    /// In what values errors are: those of the scenes' traces.
    pub fn values(&self) -> String {
        let encoded: Vec<&str> =
            self.scenes.iter().filter(|s| !s.space.is_linear()).map(|s| &*s.name).collect();
        match encoded.len() {
            0 => "on linear values".to_string(),
            n if n == self.scenes.len() => "on encoded values".to_string(),
            _ => format!("on linear values (encoded ones of {})", encoded.join(", ")),
        }
    }

    /// The record of a design at a sample count on a scene.
    pub fn record(&self, scene: &str, series: &str, samples: u32) -> Option<&Record> {
        let wanted = |r: &&Record| r.scene == scene && r.series == series && r.samples == samples;
        self.records.iter().find(wanted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Estimate;
    use crate::study::analysis::made_up::planted;

    #[test]
    fn what_errors_are_of_follows_the_traces() {
        let mut results = planted(&["a", "b"], &[8], &[("lk", &[Estimate::exactly(1.0); 2])]);
        assert_eq!(results.values(), "on linear values");
        results.scenes[1].space = Space::Encoded;
        assert_eq!(results.values(), "on linear values (encoded ones of b)");
        results.scenes[0].space = Space::Encoded;
        assert_eq!(results.values(), "on encoded values");
    }

    #[test]
    fn facts_of_older_folders_are_of_linear_colours() {
        let results = planted(&["a"], &[8], &[("lk", &[Estimate::exactly(1.0)])]);
        let mut facts = serde_json::to_value(&results.scenes[0]).unwrap();
        assert!(facts.get("space").is_none());
        let read: SceneFacts = serde_json::from_value(facts.clone()).unwrap();
        assert_eq!(read.space, Space::Linear);
        facts["space"] = "encoded".into();
        let read: SceneFacts = serde_json::from_value(facts).unwrap();
        assert_eq!(read.space, Space::Encoded);
    }
}
