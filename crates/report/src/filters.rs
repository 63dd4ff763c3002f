//! What filters of finished pictures leave of their errors.

use crate::document::{Section, Text, code};
use crate::html::words::{counted, figures, fixed};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::record::{PostFiltered, Record};
use screendoor_study::study::results::Results;

/// What is said before the figures.
pub(crate) const INTRODUCTION: &str = "Every finished picture was filtered as well, and held against the exact picture that was not. A \
     filter trades noise for blur: what it does to the exact picture itself is its blur, an error that no \
     number of samples takes away.";

/// An error below this, in 8-bit units, is hardly one: ratios to it say nothing.
const LEAST: f64 = 0.05;

/// The columns of [`rows`].
pub(crate) const HEADER: [&str; 10] = [
    "design",
    "filter",
    "RMSE without",
    "with",
    "ratio",
    "ratio, interior",
    "ratio, edges",
    "FLIP without",
    "with",
    "blur",
];

/// The section of documents; `None` where no filter was tried.
pub(crate) fn section(results: &Results) -> Option<Section> {
    if results.study.filters.is_empty() {
        return None;
    }
    let mut section = Section::new("Filters");
    section.paragraph(INTRODUCTION);
    for scene in &results.study.scenes {
        for samples in &results.study.samples {
            let rows = rows(results, &scene.name, *samples);
            if !rows.is_empty() {
                let title = format!("{}, {}", scene.name, counted(*samples as usize, "sample"));
                let mut part = Section::new(Text::plain(title));
                part.table(HEADER.map(Text::plain), rows);
                section.parts.push(part);
            }
        }
    }
    Some(section)
}

/// Every design with every filter on a scene.
pub(crate) fn rows(results: &Results, scene: &str, samples: u32) -> Vec<[Text; 10]> {
    let designs = results.study.designs.iter();
    let records = designs.filter_map(|series| results.record(scene, series, samples));
    records.flat_map(|record| record.post.iter().map(|post| row(record, post))).collect()
}

fn row(record: &Record, post: &PostFiltered) -> [Text; 10] {
    let ratio = |after: Estimate, before: Estimate| match before.value >= LEAST {
        true => Text::plain(fixed(after.value / before.value, 3)),
        false => "—".into(),
    };
    let flip =
        |flip: Option<Estimate>| flip.map_or("—".into(), |e| Text::plain(fixed(e.value, 4)));
    [
        code(&record.series).into(),
        code(&post.filter).into(),
        figures(record.covered.rmse.value).into(),
        figures(post.covered.value).into(),
        ratio(post.covered, record.covered.rmse),
        ratio(post.interior, record.interior.rmse),
        ratio(post.edges, record.edges.rmse),
        flip(record.flip.map(|flip| flip.mean)),
        flip(post.flip),
        figures(post.blur).into(),
    ]
}
