//! A study of traces that are named without a file.

use std::path::PathBuf;

use toml::{Table, Value};

use super::text::explained;
use super::{PRESET, Study};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::Trace;

/// Sample counts of the default study.
const COUNTS: [u32; 3] = [4, 8, 16];
/// That of the pictures it keeps, where there are so many.
const PICTURES: u32 = 8;

impl Study {
    /// The default study's designs on traces, each a scene by its file's name. Publications are left
    /// out, and sample counts that one of the traces has not.
    ///
    /// # Errors
    /// As [`Trace::open`]; [`Error::Config`] where a path is no UTF-8, or two files have one name.
    pub fn of_traces(paths: &[PathBuf]) -> Result<Self> {
        let mut scenes: Vec<Value> = Vec::new();
        let mut most = u32::MAX;
        for path in paths {
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            let Some((place, stem)) = path.to_str().zip(stem) else {
                let what = format_args!("the name of {} is no UTF-8", path.display());
                return Err(Error::config(what, "give the trace another name"));
            };
            let fits = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
            let name: String = stem.chars().map(|c| if fits(c) { c } else { '-' }).collect();
            if scenes.iter().any(|scene| scene["name"].as_str() == Some(&name)) {
                let what = format_args!("two of the traces are called {name}");
                return Err(Error::config(what, "give one of them another name"));
            }
            most = most.min(Trace::open(path)?.header().pattern.samples());
            let keys = [("name", Value::from(name)), ("trace", Value::from(place))];
            scenes.push(
                keys.map(|(key, value)| (key.to_string(), value))
                    .into_iter()
                    .collect::<Table>()
                    .into(),
            );
        }
        let counts: Vec<u32> = COUNTS.into_iter().filter(|n| *n <= most).collect();
        let counts = if counts.is_empty() { vec![most] } else { counts };
        let picture = counts.iter().copied().filter(|n| *n <= PICTURES).max().unwrap_or(counts[0]);
        let place = "the default study";
        let mut study: Table = toml::from_str(PRESET).map_err(|e| explained(&e, PRESET, place))?;
        let numbers =
            |all: &[u32]| Value::from(all.iter().map(|n| i64::from(*n)).collect::<Vec<_>>());
        let given = [
            ("name", Value::from("The default study's designs on traces")),
            (
                "description",
                Value::from(
                    "The designs of each family. Layered designs have as many layers as samples. \
                     Answers hold for these traces.",
                ),
            ),
            ("samples", numbers(&counts)),
            ("pictures", numbers(&[picture])),
            ("publications", Value::Array(Vec::new())),
            ("scene", Value::Array(scenes)),
        ];
        study.extend(given.map(|(key, value)| (key.to_string(), value)));
        Study::parse(&study.to_string(), "the study of these traces")
    }
}
