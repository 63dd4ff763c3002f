//! Errors: relative to the baseline, scene by scene, bias against variance.

use maud::{Markup, html};

use crate::chart::{Bar, Kind, Row, Rows, Segment, swatch};
use crate::html::choice::share_cell;
use crate::html::parts::{Cell, Content, figure, nothing, table};
use crate::html::words::{counted, estimated, figures, fixed};
use screendoor_study::study::analysis::baseline;
use screendoor_study::study::record::Record;

pub(super) fn section(content: &Content<'_>) -> Markup {
    let on = baseline(&content.results.study);
    let again = || html! { (content.study_command()) (content.replay_one()) };
    let seeds = counted(content.results.study.seeds as usize, "seed");
    html! {
        h3 { "Relative to the baseline, all scenes" }
        (figure("relative", &relative(content), &html! {
            "RMSE over covered pixels as a share of that of " code { (on.series) } " at " (on.samples)
            " samples: geometric mean over the scenes with 95 % intervals. Less is better; — where a \
             scene's result is missing, and pointing at it says which."
        }, &again()))
        h3 { "Scene by scene" }
        (figure("rmse", &content.by_scene(|scene| rmse(content, scene)), &html! {
            "RMSE over covered pixels against the exact picture of the same samples, in 8-bit units "
            (content.results.values()) ", with 95 % intervals over seeds."
        }, &again()))
        h3 { "Bias and variance at " (content.count) " samples" }
        (figure("bias", &content.by_scene(|scene| bias(content, scene)), &html! {
            "Mean square error over covered pixels, split. " (swatch("variance"))
            " Variance is noise, which more seeds or frames average away; " (swatch("bias"))
            " squared bias is not. The bias is estimated without bias of its own, so it scatters \
             around 0, and what falls below is drawn as nothing: pointing at it gives the estimate with \
             its sign and its 95 % interval, over " (seeds) ". A design that no seed changes has its whole error as bias."
        }, &again()))
        details {
            summary { "All errors at " (content.count) " samples" }
            (figure("errors", &content.by_scene(|scene| all_errors(content, scene)), &html! {
                "8-bit units. Covered: pixels with at least one fragment; interior: those that no \
                 primitive's edge crosses; edges: the others. Mean error: picture minus exact picture, \
                 with its sign and, where seeds change the picture, its 95 % interval over " (seeds) ": \
                 to tell a bias that lies within takes more seeds. Fine: against the exact picture of all \
                 the trace's samples, so that missing antialiasing counts."
            }, &again()))
        }
    }
}

fn relative(content: &Content<'_>) -> Markup {
    let study = &content.results.study;
    let counts: Vec<String> = study.samples.iter().map(u32::to_string).collect();
    let mut header = vec!["design"];
    header.extend(counts.iter().map(String::as_str));
    let row = |series: &String| {
        let shares = study.samples.iter().map(|n| share_cell(content, series, *n));
        std::iter::once(Cell::Text(content.named(series))).chain(shares).collect()
    };
    table(&header, &content.designs().iter().map(row).collect::<Vec<_>>())
}

fn rmse(content: &Content<'_>, scene: &str) -> Markup {
    let study = &content.results.study;
    let counts: Vec<String> = study.samples.iter().map(u32::to_string).collect();
    let mut header = vec!["design"];
    header.extend(counts.iter().map(String::as_str));
    let row = |series: &String| {
        let errors = study.samples.iter().map(|n| {
            let record = content.results.record(scene, series, *n);
            Cell::estimate(record.map(|r| r.covered.rmse), 2, "no result")
        });
        std::iter::once(Cell::Text(content.named(series))).chain(errors).collect()
    };
    table(&header, &content.designs().iter().map(row).collect::<Vec<_>>())
}

fn bias(content: &Content<'_>, scene: &str) -> Markup {
    let rows = content
        .designs()
        .iter()
        .map(|series| {
            let record = content.at_count(scene, series);
            let split = record.and_then(Record::parts);
            let segment = |value: f64, measure: &'static str, says: String| Segment {
                value,
                measure: measure.to_string(),
                class: measure,
                says: format!("{series}\n{says}"),
            };
            let bars = split.map(|(variance, bias)| {
                Bar::Stack(vec![
                    segment(variance, "variance", format!("variance {}", figures(variance))),
                    segment(bias.value, "bias", format!("squared bias {}", estimated(bias))),
                ])
            });
            Row {
                id: record.map_or(String::new(), |r| r.id.clone()),
                series: series.clone(),
                style: content.styles.of(series),
                note: match (record, &bars) {
                    (None, _) => "no result".into(),
                    (_, None) => "one seed cannot split it".into(),
                    _ => String::new(),
                },
                bars: bars.into_iter().collect(),
            }
        })
        .collect();
    let title = format!("Bias and variance on {scene}");
    let axis = "mean square error, squared 8-bit units".to_string();
    let rows = Rows { title, axis, kind: Kind::Linear, together: true, rows };
    rows.draw().unwrap_or_else(|| nothing("No design's error could be split here."))
}

/// The signed mean error over the covered pixels: with its interval over seeds, or without
/// where no seed changes it. One draw of many tells nothing of the mean.
fn mean_error(r: &Record) -> Cell {
    let known = (!r.is_one_draw()).then_some(r.covered.mean);
    Cell::estimate(known, 3, "one seed")
}

fn all_errors(content: &Content<'_>, scene: &str) -> Markup {
    let header = [
        "design",
        "RMSE",
        "mean error",
        "sRGB",
        "interior",
        "edges",
        "frame",
        "fine",
        "max",
        "variance",
        "squared bias",
        "seeds",
    ];
    let optional = |v: Option<f64>| v.map_or(Cell::Missing("one seed".into()), Cell::number);
    let row = |series: &String| -> Vec<Cell> {
        let mut cells = vec![Cell::Text(content.named(series))];
        let Some(r) = content.at_count(scene, series) else {
            cells.extend((1..header.len()).map(|_| Cell::Missing("no result".into())));
            return cells;
        };
        let known = |e| Cell::Estimate(e, 2);
        cells.extend([
            known(r.covered.rmse),
            mean_error(r),
            known(r.covered.rmse_srgb),
            known(r.interior.rmse),
            known(r.edges.rmse),
            known(r.frame.rmse),
            known(r.fine),
            Cell::Number(r.covered.max, fixed(r.covered.max, 1)),
            optional(r.covered.variance),
            Cell::estimate(r.parts().map(|(_, bias)| bias), 3, "one seed"),
            Cell::Number(f64::from(r.seeds), r.seeds.to_string()),
        ]);
        cells
    };
    table(&header, &content.designs().iter().map(row).collect::<Vec<_>>())
}
