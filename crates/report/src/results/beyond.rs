//! The results' part on this project's own designs, over many seeds.

use crate::document::{Section, Text};
use crate::results::expectations::on_scenes;
use crate::results::ratios::OnScenes;
use screendoor_study::metrics::Estimate;
use screendoor_study::study::analysis::{ROUNDING, RunName, ratio, ratio_on};
use screendoor_study::study::publications::beyond::Beyond;
use screendoor_study::study::record::Record;
use screendoor_study::study::results::Results;

/// The samples at which means and costs are shown.
const SHOWN: u32 = 8;

/// The part's only section.
pub(super) fn section(b: &Beyond) -> Section {
    let mut section = Section::new("Beyond LK: `residual` and `merging`");
    let study = &b.results.study;
    section.paragraph(format!(
        "No publication's: what [`residual`](RESIDUAL.md) and [`merging`](MERGING.md) gain over `{}`, on \
         every scene, {} × {} pixels, {} seeds. Errors are over the covered pixels, against the exact \
         picture of the same samples. Shares of all scenes are geometric means; an RMSE below {:.2}, \
         which no 8-bit picture shows, counts as that in any share.",
        study.baseline, b.side, b.side, study.seeds, ROUNDING
    ));
    for missing in &b.missing {
        section.paragraph(format!("`{missing}` was not given and is left out."));
    }
    section.parts.extend(study.samples.iter().map(|n| ratios(&b.results, *n)));
    section.parts.extend([means(&b.results), costs(&b.results)]);
    section
}

/// The designs that are told of in short.
const IN_SHORT: [&str; 3] = ["residual", "residual:per=sample", "merging:layers=5"];

/// What they gain, in a sentence.
pub(super) fn in_short(b: &Beyond) -> Vec<Text> {
    let (results, samples) = (&b.results, SHOWN);
    let to = RunName { series: &results.study.baseline, samples };
    let known = results.study.designs.iter().filter(|series| IN_SHORT.contains(&series.as_str()));
    let gains = known.map(|series| {
        let run = RunName { series, samples };
        let each = scenes(results)
            .filter_map(|scene| ratio_on(results, scene, run, to).map(|e| (scene.to_string(), e)));
        let mean = ratio(results, run, to).map_or("—".to_string(), |e| share(e.value));
        let bytes = results.records.iter().find(|r| r.series == *series && r.samples == samples);
        let bytes = bytes
            .and_then(Record::state_bytes)
            .map_or(String::new(), |b| format!("{b:.0} bytes, "));
        format!("`{series}` ({bytes}one pass) {mean}, {}", OnScenes(each.collect()).range())
    });
    let found = Found::of(&results.records);
    let text = format!(
        "**Beyond LK** ({} scenes, {} × {} pixels, {} seeds): RMSE at {samples} samples as a share of \
         `{}`'s, geometric mean and range: {}. Mean errors of what is declared unbiased are within what \
         chance allows {}.",
        results.study.scenes.len(),
        b.side,
        b.side,
        results.study.seeds,
        to.series,
        gains.collect::<Vec<_>>().join("; "),
        found.scenes
    );
    vec![text.into()]
}

/// Names of the study's scenes.
pub(super) fn scenes(results: &Results) -> impl Iterator<Item = &str> {
    results.study.scenes.iter().map(|scene| scene.name.as_str())
}

/// Every design's error as a share of the baseline's at the same count.
pub(super) fn ratios(results: &Results, samples: u32) -> Section {
    let study = &results.study;
    let noun = if samples == 1 { "sample" } else { "samples" };
    let mut part =
        Section::new(format!("RMSE as a share of `{}`'s, {samples} {noun}", study.baseline));
    let to = RunName { series: &study.baseline, samples };
    let own = |scene| results.record(scene, to.series, samples).map(|r| two(r.covered.rmse.value));
    let first = ["`".to_string() + to.series + "`, RMSE", String::new()];
    let first = first.into_iter().chain(scenes(results).map(|s| own(s).unwrap_or_default()));
    let rest = study.designs.iter().filter(|series| **series != to.series).map(|series| {
        let run = RunName { series, samples };
        let cell = |e: Option<Estimate>| e.map_or("—".to_string(), |e| share(e.value));
        let all = cell(ratio(results, run, to).ok());
        let each = scenes(results).map(|scene| cell(ratio_on(results, scene, run, to)));
        [format!("`{series}`"), all].into_iter().chain(each).collect::<Vec<_>>()
    });
    let rows = std::iter::once(first.collect::<Vec<_>>()).chain(rest);
    part.table(["design", "all"].into_iter().chain(scenes(results)), rows);
    part
}

/// A share in as many digits as say something.
pub(super) fn share(value: f64) -> String {
    match value {
        0.0 => "0".to_string(),
        v if v < 0.1 => format!("{v:.4}"),
        v => format!("{v:.3}"),
    }
}

pub(super) fn two(value: f64) -> String {
    format!("{value:.2}")
}

/// Every mean error of the designs with its interval, and who is within what chance allows.
pub(super) fn means(results: &Results) -> Section {
    let mut part = Section::new(format!("Mean error, {SHOWN} samples"));
    let found = Found::of(&results.records);
    part.paragraph(format!(
        "Picture minus exact picture, mean over the covered pixels and the seeds, in 8-bit units, ± half \
         of its 95 % interval. Of the {} mean errors of designs declared unbiased, at all sample counts, \
         {} lie within their intervals, where 95 % are expected; looked at together (Bonferroni, 1 in \
         100) they are within what chance allows {}, and the largest lies {:.1} standard errors from 0.",
        found.unbiased, found.inside, found.scenes, found.most
    ));
    let row = |series: &String| {
        let records: Vec<Option<&Record>> =
            scenes(results).map(|scene| results.record(scene, series, SHOWN)).collect();
        let declared = match records.iter().flatten().all(|r| r.kept().unbiased) {
            true => "unbiased",
            false => "biased",
        };
        let cells = records.iter().map(|r| r.map_or("—".to_string(), |r| mean(r.covered.mean)));
        [format!("`{series}`"), declared.to_string()].into_iter().chain(cells).collect::<Vec<_>>()
    };
    let header = ["design", "declared"].into_iter().chain(scenes(results));
    part.table(header, results.study.designs.iter().map(row));
    part
}

fn mean(e: Estimate) -> String {
    format!("{:+.3} ± {:.3}", e.value, e.half_width())
}

/// Where mean errors of what is declared unbiased lie.
struct Found {
    unbiased: usize,
    inside: usize,
    scenes: String,
    most: f64,
}

impl Found {
    fn of(records: &[Record]) -> Self {
        let unbiased: Vec<&Record> = records.iter().filter(|r| r.kept().unbiased).collect();
        let inside =
            unbiased.iter().filter(|r| r.covered.mean.low <= 0.0 && r.covered.mean.high >= 0.0);
        let named = unbiased.iter().map(|r| (r.scene.as_str(), *r)).collect();
        let (holding, most) = on_scenes(named, unbiased.len());
        Found { unbiased: unbiased.len(), inside: inside.count(), scenes: holding.words(), most }
    }
}

/// State and events of every design.
fn costs(results: &Results) -> Section {
    let mut part = Section::new(format!("State and events, {SHOWN} samples"));
    part.paragraph(
        "State per pixel as hardware holds it, and by layout in bits; per fragment, the mean over the \
         scenes: hashes, comparators (depth tests, sorting networks, layers compared), \
         multiplications (of colours, opacities and errors while fragments are drawn; none of a design \
         for which that would be no honest count) and bytes of state read and written. How fast the \
         designs are replayed is in [PERFORMANCE.md](PERFORMANCE.md).",
    );
    let row = |series: &String| {
        let records: Vec<&Record> =
            scenes(results).filter_map(|scene| results.record(scene, series, SHOWN)).collect();
        let mean = |of: &dyn Fn(&Record) -> Option<f64>| {
            let all: Option<Vec<f64>> = records.iter().map(|r| of(r)).collect();
            let all = all.filter(|all| !all.is_empty());
            all.map_or("—".to_string(), |all| two(all.iter().sum::<f64>() / all.len() as f64))
        };
        let bytes = records.first().and_then(|r| r.state_bytes());
        vec![
            format!("`{series}`"),
            bytes.map_or("grows".to_string(), |bytes| format!("{bytes:.0}")),
            records.first().map_or(String::new(), |r| r.layout.clone()),
            mean(&Record::hashes_per_fragment),
            mean(&Record::comparators_per_fragment),
            mean(&Record::multiplications_per_fragment),
            mean(&Record::bytes_moved_per_fragment),
        ]
    };
    let header = ["design", "bytes", "layout", "hashes", "comparators", "products", "bytes moved"];
    part.table(header, results.study.designs.iter().map(row));
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::study::analysis::made_up;
    use screendoor_study::study::record::Promise;

    fn record(scene: &str, mean: f64) -> Record {
        let mut record = made_up::record(scene, "residual", 8, Estimate::exactly(1.0));
        record.covered.mean = Estimate::around(mean, 0.1);
        record.seeds = 64;
        record.promises.unbiased = Promise::Always;
        record
    }

    #[test]
    fn a_bias_of_what_is_declared_unbiased_is_told() {
        let found = Found::of(&[record("a", 0.05), record("b", -0.02)]);
        assert_eq!((found.unbiased, found.inside), (2, 2));
        assert_eq!(found.scenes, "on all 2 scenes");
        let planted = Found::of(&[record("a", 0.05), record("b", 0.4)]);
        assert_eq!((planted.inside, planted.scenes.as_str()), (1, "on 1 of 2 scenes (not on `b`)"));
    }
}
