//! A study's folder as a report: the exports and the page.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use rayon::prelude::*;
use serde_json::Value;

use crate::document::{self, Against};
use crate::export;
use crate::html::viewer::{self, ViewedPicture, ViewedScene};
use crate::html::{DesignText, Extras, Place, Section, page, replay_command, verification};
use screendoor_study::metrics::{Estimate, Flip, FlipMap};
use screendoor_study::study::record::Record;
use screendoor_study::study::results::{Results, SceneFacts};
use screendoor_study::study::run::{Store, read_json};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::output::OutputFile;
use screendoor_trace::param::Options;
use screendoor_trace::picture::{Picture, read};

/// The page's file in the folder.
pub const PAGE: &str = "report.html";

/// What the folder does not hold.
#[derive(Clone, Debug)]
pub struct About {
    /// What is said of the designs.
    pub designs: Vec<DesignText>,
    /// The command that measures the study.
    pub command: String,
}

/// Writes the exports and the page from what the folder holds. Returns that.
///
/// # Errors
/// As [`Store::results`]; [`Error::Io`] where a file cannot be written.
pub fn write_report(store: &Store, about: About) -> Result<Results> {
    let results = store.results()?;
    let put = |name: &str, bytes: &[u8]| OutputFile::put(store.folder().join(name), bytes);
    put("results.jsonl", &export::json_lines(&results.records))?;
    put("results.csv", &export::csv(&results.records))?;
    put("results.arrow", &export::arrow(&results.records))?;
    put("results.md", export::markdown(&results).as_bytes())?;
    let pictures = Pictures::of(store, &results)?;
    let mut extras = Extras {
        designs: about.designs,
        command: about.command,
        when: when(store, &results),
        ..Extras::default()
    };
    extras.sections.push(pictures.section(&results));
    extras.sections.extend(publications(store)?);
    extras.css.push(viewer::STYLE.to_string());
    put(PAGE, page(&results, &extras).as_bytes())?;
    Ok(results)
}

/// What publications print beside what was measured, and which were not measured.
fn publications(store: &Store) -> Result<Vec<Section>> {
    let mut against: Vec<Against> = Vec::new();
    let mut sections = Vec::new();
    let mut missing = Vec::new();
    for publication in store.study().publications_to_measure() {
        let Some(document) =
            read_json::<Vec<document::Section>>(&store.document_file(publication))?
        else {
            missing.push(publication.name());
            continue;
        };
        let figure = |name: &str| std::fs::read(store.verification_file(name)).ok();
        sections.extend(verification::sections(&document, &figure));
        against.extend(document.iter().flat_map(document::Section::against).cloned());
    }
    if against.is_empty() && missing.is_empty() {
        return Ok(sections);
    }
    let mut summary = verification::summary(&against);
    if !missing.is_empty() {
        let rest = summary.body;
        summary.body = maud::html! {
            (rest)
            p class="nothing" { "Not measured yet: " (missing.join(", ")) "." }
        };
    }
    sections.insert(0, summary);
    Ok(sections)
}

/// When the last run was finished, as the file system has it.
fn when(store: &Store, results: &Results) -> Option<String> {
    let times = results.records.iter().filter_map(|r| {
        std::fs::metadata(store.record_file(&r.id)).and_then(|m| m.modified()).ok()
    });
    let last: SystemTime = times.max()?;
    let text = humantime::format_rfc3339_seconds(last).to_string();
    Some(format!("{} UTC", text.trim_end_matches('Z').replace('T', " ")))
}

/// Pixels of all pictures that a page holds at most: some 2 bytes each.
const MOST_PIXELS: u64 = 16 << 20;

/// The pictures of a page.
struct Pictures {
    scenes: Vec<Shown>,
    /// Runs whose pictures are not shown, for the page's size.
    left_out: usize,
}

/// A scene at a sample count.
struct Shown {
    facts: SceneFacts,
    samples: u32,
    reference: Picture,
    pictures: Vec<Kept>,
}

/// A run's picture.
struct Kept {
    record: Record,
    picture: Picture,
    flip: FlipMap,
    explain: Option<Value>,
}

impl Pictures {
    /// Reads those that the folder holds, as many as a page can bear: of every scene the
    /// same designs, the baseline and then those with the least error first.
    fn of(store: &Store, results: &Results) -> Result<Self> {
        let study = store.study();
        let mut designs: Vec<&str> = study.designs.iter().map(String::as_str).collect();
        designs.sort_by_cached_key(|d| {
            let bits = (error_of(results, d) * 1e6) as u64;
            (*d != study.baseline, bits)
        });
        let pixels: u64 = results
            .scenes
            .iter()
            .map(|s| s.size.iter().map(|v| u64::from(*v)).product::<u64>())
            .sum();
        // The reference takes part.
        let each = pixels * study.pictures.len() as u64;
        let most = (MOST_PIXELS / each.max(1)).saturating_sub(1).max(2) as usize;
        let left_out = designs.len().saturating_sub(most);
        designs.truncate(most);
        let mut scenes = Vec::new();
        let mut counts = study.pictures.clone();
        counts.sort_unstable();
        for facts in &results.scenes {
            for samples in &counts {
                let of_scene = |r: &&Record| {
                    r.scene == facts.name
                        && r.samples == *samples
                        && designs.contains(&r.series.as_str())
                };
                let records: Vec<&Record> = results.records.iter().filter(of_scene).collect();
                scenes.extend(Shown::read(store, facts, *samples, &records)?);
            }
        }
        Ok(Pictures { scenes, left_out })
    }

    fn section(&self, results: &Results) -> Section {
        let viewed: Vec<ViewedScene<'_>> = self.scenes.iter().map(|s| s.viewed(results)).collect();
        let body = maud::html! {
            @if viewed.is_empty() {
                p class="nothing" { "No pictures were kept: " code { "pictures" } " of the study names no sample count." }
            } @else {
                p { "The first seed's pictures beside the exact ones of the same samples." }
                @if self.left_out > 0 {
                    p { "For the page's size " (self.left_out) " designs are left out here, those with the largest \
                         errors; their pictures are in the folder " code { "pictures" } "." }
                }
                (viewer::element(&viewed))
            }
        };
        Section {
            title: "Pictures".into(),
            anchor: "pictures".into(),
            place: Place::Pictures,
            body,
        }
    }
}

/// A design's error over all scenes and sample counts: what orders pictures.
fn error_of(results: &Results, series: &str) -> f64 {
    let own = results.records.iter().filter(|r| r.series == series);
    let logs: Vec<f64> = own.map(|r| r.covered.rmse.value.max(1e-3).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp()
}

impl Shown {
    /// `None` where no picture is there.
    fn read(
        store: &Store,
        facts: &SceneFacts,
        samples: u32,
        records: &[&Record],
    ) -> Result<Option<Self>> {
        let path = |record: &Record| store.folder().join(Store::picture_name(&record.id));
        let there: Vec<&Record> = records.iter().copied().filter(|r| path(r).exists()).collect();
        let Some(first) = there.first() else { return Ok(None) };
        let reference = read(path(first), Some("reference"))?;
        let flip = Flip::new(&reference);
        let kept = |record: &&Record| -> Result<Kept> {
            let place = path(record);
            let picture = read(&place, Some("colour"))?;
            if picture.grid() != reference.grid() {
                return Err(Error::invalid(
                    place.display(),
                    "its size is not that of the scene's other pictures",
                    "remove the run's record to have it measured again",
                ));
            }
            Ok(Kept {
                record: (*record).clone(),
                flip: flip.ldr(&picture),
                picture,
                explain: explanation(&store.explanation_file(&record.id)),
            })
        };
        let pictures = there.par_iter().map(kept).collect::<Result<Vec<_>>>()?;
        Ok(Some(Shown { facts: facts.clone(), samples, reference, pictures }))
    }

    fn viewed(&self, results: &Results) -> ViewedScene<'_> {
        ViewedScene {
            name: self.facts.name.clone(),
            samples: self.samples,
            reference: &self.reference,
            pictures: self.pictures.iter().map(|kept| kept.viewed(results)).collect(),
            pixel: self.facts.pixel,
            trace: self.facts.trace.clone(),
            seed: results.study.first_seed,
        }
    }
}

fn explanation(path: &Path) -> Option<Value> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

impl Kept {
    fn viewed(&self, results: &Results) -> ViewedPicture<'_> {
        let record = &self.record;
        let shown = |e: Estimate, digits: usize| {
            if e.low == e.high {
                format!("{:.digits$}", e.value)
            } else {
                format!("{:.digits$} ± {:.digits$}", e.value, e.half_width())
            }
        };
        let mut figures = vec![("RMSE".to_string(), shown(record.covered.rmse, 2))];
        if let Some(flip) = &record.flip {
            figures.push(("FLIP".to_string(), shown(flip.mean, 4)));
        }
        let file = PathBuf::from(Store::picture_name(&record.id));
        let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        ViewedPicture {
            name: record.design.clone(),
            picture: &self.picture,
            flip: Some(self.flip.values()),
            figures,
            command: format!("{} -o {name}", replay_command(results, record, 1)),
            exr: name,
            explain: self.explain.clone(),
        }
    }
}
