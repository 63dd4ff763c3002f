//! The page is looked at through a browser; here every number in its charts is held to the
//! records, to the last bit.

use std::collections::{BTreeMap, BTreeSet};

use super::*;
use screendoor_study::study::analysis::made_up::plausible;
use screendoor_study::study::analysis::{Cost, RunName, reference_count, relative};
use screendoor_study::study::record::Record;
use screendoor_study::study::results::Results;
use screendoor_trace::param::Options;
use screendoor_trace::picture::Space;

fn extras() -> Extras {
    Extras { when: Some("2026-01-02".into()), ..Extras::default() }
}

/// Writes pages to the folder that `SCREENDOOR_PAGES` names, to be looked at.
#[test]
#[ignore = "writes pages for people to look at"]
fn pages_to_look_at() {
    let folder = std::path::PathBuf::from(std::env::var("SCREENDOOR_PAGES").unwrap());
    let mut bare = plausible(2, 3, &[4, 8]);
    bare.records.iter_mut().for_each(without_extras);
    let cases: [(&str, Results); 4] = [
        ("large", plausible(9, 25, &[2, 4, 8, 16, 32])),
        ("small", plausible(1, 2, &[8])),
        ("middle", plausible(3, 18, &[4, 8, 16])),
        ("bare", bare),
    ];
    for (name, results) in cases {
        std::fs::write(folder.join(format!("{name}.html")), page(&results, &extras())).unwrap();
    }
}

/// A record as of a study with one seed, no metrics and no timing.
fn without_extras(r: &mut Record) {
    (r.flip, r.flip_hdr, r.spectrum) = (None, None, None);
    r.filtered.clear();
    r.speed.clear();
    r.seeds = 1;
    (r.covered.variance, r.covered.bias_squared, r.covered.temporal) = (None, None, None);
}

/// An element's attributes.
type Attributes<'a> = BTreeMap<&'a str, &'a str>;

/// The attributes of all elements of `html`, in order, with the element's name as `""`.
fn elements(html: &str) -> Vec<Attributes<'_>> {
    let mut list = Vec::new();
    for tag in html.split('<').skip(1).filter(|t| t.starts_with(|c: char| c.is_ascii_lowercase())) {
        // maud escapes what could end a tag within an attribute.
        let tag = tag.split_once('>').map_or(tag, |(tag, _)| tag);
        let (name, mut rest) = tag.split_once(' ').unwrap_or((tag, ""));
        let mut attributes = Attributes::from([("", name)]);
        while let Some((key, after)) = rest.split_once("=\"") {
            let Some((value, after)) = after.split_once('"') else { break };
            attributes.insert(key.trim(), value);
            rest = after;
        }
        list.push(attributes);
    }
    list
}

fn number(point: &Attributes<'_>, key: &str) -> Result<f64, String> {
    let text = point.get(key).ok_or(format!("no {key} in {point:?}"))?;
    text.parse().map_err(|_| format!("{text} is no number"))
}

fn same(what: &str, shown: f64, is: f64) -> Result<(), String> {
    if shown.to_bits() == is.to_bits() {
        Ok(())
    } else {
        Err(format!("{what}: the page has {shown}, the results {is}"))
    }
}

/// What a row of a chart says of a record.
fn measured(r: &Record, measure: &str) -> Option<f64> {
    let per_second = |engine: &str| Some(r.fragments as f64 / r.speed.get(engine)?.seconds?.median);
    let square = r.covered.rmse.value * r.covered.rmse.value;
    match measure {
        "flip" => Some(r.flip?.mean.value),
        "flip-hdr" => Some(r.flip_hdr?.mean.value),
        "filtered-0" => Some(r.filtered.first()?.rmse.value),
        "filtered-1" => Some(r.filtered.get(1)?.rmse.value),
        "filtered-2" => Some(r.filtered.get(2)?.rmse.value),
        "variance" => Some(r.covered.variance.unwrap_or(0.0)),
        "bias" => Some(r.covered.bias_squared.map_or(square, |b| b.value)),
        "fragments-per-second-fast" => per_second("fast"),
        "fragments-per-second-gpu" => per_second("gpu"),
        _ => None,
    }
}

/// Holds the numbers of all charts of a page to the results: each is there, and each that
/// belongs there is. Gives how many were held.
fn check(html: &str, results: &Results) -> Result<usize, String> {
    let record = |id: &str| {
        results.records.iter().find(|r| r.id == id).ok_or(format!("no record is called {id}"))
    };
    let mut held = 0;
    let mut seen: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let (mut chart, mut series) = (String::new(), "");
    for e in elements(html) {
        let class = e.get("class").copied().unwrap_or("");
        if e[""] == "svg" && class.starts_with("plot") {
            chart = e.get("aria-label").copied().unwrap_or("").to_string();
        } else if class.starts_with("curve") {
            series = e.get("data-series").copied().unwrap_or("");
        }
        if let Some(measure) = e.get("data-measure") {
            let r = record(e.get("data-id").copied().unwrap_or(""))?;
            let is = measured(r, measure).ok_or(format!("{}: no {measure}", r.id))?;
            same(&r.id, number(&e, "data-value")?, is)?;
            seen.entry(measure.to_string()).or_default().insert(r.id.clone());
            held += 1;
        } else if e.contains_key("data-error") {
            held += 1;
            point(&e, &chart, series, results)?;
            let run = match e.get("data-id") {
                Some(id) => id.to_string(),
                None => format!("{series} {}", e.get("data-samples").copied().unwrap_or("")),
            };
            seen.entry(chart.clone()).or_default().insert(run);
        }
    }
    complete(&seen, results)?;
    Ok(held)
}

/// One point between two axes.
fn point(e: &Attributes<'_>, chart: &str, series: &str, results: &Results) -> Result<(), String> {
    let cost = Cost::ALL
        .iter()
        .zip(Cost::CHOICES)
        .find(|(_, c)| chart.contains(&format!("against {},", c.help)));
    let cost = cost.map(|(cost, _)| *cost);
    let (shown, low, high) =
        (number(e, "data-error")?, number(e, "data-low")?, number(e, "data-high")?);
    let Some(id) = e.get("data-id") else {
        let samples = number(e, "data-samples")? as u32;
        let run = RunName { series, samples };
        let share = relative(results, run).map_err(|lacks| format!("{run:?} lacks {lacks:?}"))?;
        same(series, shown, share.value)?;
        same(series, low, share.low)?;
        same(series, high, share.high)?;
        let cost = cost.ok_or(format!("'{chart}' has no cost"))?;
        return same(series, number(e, "data-cost")?, cost.over_scenes(results, run)?.median);
    };
    let r = results.records.iter().find(|r| r.id == *id).ok_or(format!("no record {id}"))?;
    let along = number(e, "data-cost")?;
    if chart.starts_with("Spectrum") {
        let s = r.spectrum.as_ref().ok_or(format!("{id} has no spectrum"))?;
        let bin = s.frequency.iter().position(|f| f.to_bits() == along.to_bits());
        return same(id, shown, s.power[bin.ok_or(format!("{id}: no bin at {along}"))?]);
    }
    same(id, shown, r.covered.rmse.value)?;
    same(id, low, r.covered.rmse.low)?;
    same(id, high, r.covered.rmse.high)?;
    match cost {
        Some(cost) => same(id, along, cost.of(r)?.median),
        None => same(id, along, f64::from(r.samples)),
    }
}

/// Every record is in every chart that it belongs to.
fn complete(seen: &BTreeMap<String, BTreeSet<String>>, results: &Results) -> Result<(), String> {
    let has = |chart: &str, id: &str| match seen.get(chart).is_some_and(|s| s.contains(id)) {
        true => Ok(()),
        false => Err(format!("{id} is not in '{chart}'")),
    };
    let study = &results.study;
    for r in &results.records {
        if study.samples.len() > 1 {
            has(&format!("RMSE on {} against samples per pixel", r.scene), &r.id)?;
        }
        for (cost, choice) in Cost::ALL.iter().zip(Cost::CHOICES) {
            let axis = format!("{}, {}", choice.help, cost.unit());
            if cost.of(r).is_ok() {
                has(&format!("RMSE on {} against {axis}", r.scene), &r.id)?;
            }
            let run = RunName { series: &r.series, samples: r.samples };
            if cost.over_scenes(results, run).is_ok() && relative(results, run).is_ok() {
                let id = format!("{} {}", r.series, r.samples);
                has(&format!("Error over all scenes against {axis}"), &id)?;
            }
        }
        if r.samples == reference_count(study) {
            for measure in ["flip", "flip-hdr", "filtered-0", "filtered-1", "filtered-2"] {
                if measured(r, measure).is_some() {
                    has(measure, &r.id)?;
                }
            }
            for engine in ["fast", "gpu"] {
                let measure = format!("fragments-per-second-{engine}");
                if measured(r, &measure).is_some() {
                    has(&measure, &r.id)?;
                }
            }
        }
    }
    Ok(())
}

#[test]
fn every_number_in_the_charts_is_the_records() {
    for results in [plausible(1, 2, &[8]), plausible(2, 25, &[4, 8]), plausible(4, 16, &[2, 8, 16])]
    {
        let held = check(&page(&results, &extras()), &results).unwrap();
        assert!(held >= results.records.len() * 7, "{held}");
    }
}

#[test]
fn a_planted_defect_is_found() {
    let results = plausible(2, 4, &[4, 8]);
    let html = page(&results, &extras());
    let value = results.records[3].covered.rmse.value;
    let text = format!("data-error=\"{value}\"");
    assert!(html.contains(&text), "{text}");
    let next = f64::from_bits(value.to_bits() + 1);
    let wrong = check(&html.replacen(&text, &format!("data-error=\"{next}\""), 1), &results);
    assert!(wrong.unwrap_err().contains("the page has"));
    // A point that is left out.
    let id = format!("data-id=\"{}\"", results.records[5].id);
    let without = html.replace(&id, &format!("data-id=\"{}\"", results.records[4].id));
    assert!(check(&without, &results).is_err());
    // A record that the page does not know.
    let mut more = results.clone();
    more.records[0].id.push_str("-other");
    assert!(check(&html, &more).is_err());
}

#[test]
fn words_on_errors_follow_the_traces_colours() {
    let mut results = plausible(2, 3, &[4, 8]);
    assert!(page(&results, &extras()).contains("on linear values"));
    results.scenes.iter_mut().for_each(|s| s.space = Space::Encoded);
    let html = page(&results, &extras());
    assert!(html.contains("on encoded values") && !html.contains("on linear values"));
    let text = crate::export::markdown(&results);
    assert!(text.contains("on encoded values") && !text.contains("linear values"));
}

#[test]
fn a_removed_record_is_missing_and_nowhere_a_zero() {
    let mut results = plausible(3, 8, &[4, 8]);
    let place = results.records.iter().position(|r| r.series == "systematic" && r.samples == 8);
    let gone = results.records.remove(place.unwrap());
    let html = page(&results, &extras());
    check(&html, &results).unwrap();
    assert!(!html.contains(&format!("\"{}\"", gone.id)));
    for zero in ["data-error=\"0\"", "data-error=\"NaN\"", "data-v=\"NaN\"", ">NaN"] {
        assert!(!html.contains(zero), "{zero}");
    }
    // The chart over all scenes names the scene, and the table's cell says so, too.
    assert!(html.contains(&format!("No result on {}", gone.scene)));
    assert!(html.contains(&format!("title=\"no result on {}\"", gone.scene)));
}

#[test]
fn a_page_without_metrics_or_timing_says_so() {
    let mut results = plausible(2, 3, &[4, 8]);
    results.records.iter_mut().for_each(without_extras);
    let html = page(&results, &extras());
    check(&html, &results).unwrap();
    for says in [
        "FLIP was not measured.",
        "Nothing was timed.",
        "The spectrum was not measured.",
        "one seed cannot",
        "Not timed with the engine fast",
        "None: every run of the study has a result.",
    ] {
        assert!(html.contains(says), "{says}");
    }
    // No record at all.
    results.records.clear();
    assert!(page(&results, &extras()).contains("none with results on all scenes meets this"));
}

#[test]
fn the_lead_follows_the_numbers() {
    let mut results = plausible(1, 2, &[8]);
    let lead = |results: &Results| {
        let extras = extras();
        let content = parts::Content::new(results, &extras);
        choice::lead(&content, &screendoor_study::study::analysis::answers(results)).join(" ")
    };
    assert!(lead(&results).contains("`lk` at 8 samples has the least error"), "{}", lead(&results));
    assert!(lead(&results).contains("the intervals separate the two"));
    // The same error: no difference.
    let error = results.records[1].covered.clone();
    results.records[0].covered = error;
    assert!(lead(&results).contains("no difference that these seeds show"), "{}", lead(&results));
    results.records[0].covered.rmse = results.records[0].covered.rmse.scaled(0.5);
    assert!(lead(&results).contains("`enderton` at 8 samples has the least error"));
}

#[test]
fn a_page_needs_nothing_else_and_escapes_what_it_is_given() {
    let mut results = plausible(2, 3, &[4, 8]);
    results.study.name = "<script>alert(1)</script>".into();
    results.machine.processor = "\"><img src=x>".into();
    let text = DesignText {
        series: "lk".into(),
        summary: "a < b".into(),
        citation: "Laine & Karras".into(),
        promises: vec!["unbiased".into()],
    };
    let section = Section {
        title: "Pictures".into(),
        anchor: "pictures".into(),
        place: Place::Pictures,
        body: maud::html! { p { "from elsewhere" } },
    };
    let extras = Extras { designs: vec![text], sections: vec![section], ..extras() };
    let html = page(&results, &extras);
    assert!(!html.contains("<script>alert") && !html.contains("<img src"));
    assert!(html.contains("Laine &amp; Karras") && html.contains("from elsewhere"));
    assert!(html.contains("href=\"#pictures\""));
    for e in elements(&html) {
        let outside = e.get("href").is_some_and(|to| !to.starts_with('#'));
        assert!(!outside && !e.contains_key("src"), "{e:?}");
    }
    for word in ["@import", "url(", "fetch(", "innerHTML"] {
        assert!(!html.contains(word), "{word}");
    }
    let ids: Vec<String> =
        elements(&html).iter().filter_map(|e| e.get("id").map(|id| id.to_string())).collect();
    let once: BTreeSet<&String> = ids.iter().collect();
    assert_eq!(once.len(), ids.len(), "an id is there twice: {ids:?}");
}

#[test]
fn commands_name_what_was_run() {
    let mut results = plausible(1, 4, &[8]);
    results.study.first_seed = 3;
    let html = page(&results, &extras());
    let replay = "screendoor replay traces/cycloidal.arrow --design lk --samples 8 --seeds 8 \
                  --seed 3 --exact";
    assert!(html.contains(replay));
    assert!(html.contains("screendoor study study.toml"));
}
