//! Filters of finished pictures.

use maud::{Markup, html};

use crate::chart::{Bar, Kind, Row, Rows, swatch};
use crate::filters::{self, HEADER, INTRODUCTION};
use crate::html::document;
use crate::html::parts::{Content, figure, nothing, tabs};
use crate::html::words::estimated;
use screendoor_study::metrics::Estimate;

/// The section; `None` where no filter was tried.
pub(super) fn section(content: &Content<'_>) -> Option<Markup> {
    let study = &content.results.study;
    if study.filters.is_empty() {
        return None;
    }
    let panels: Vec<(String, Markup)> = content
        .scenes()
        .flat_map(|scene| study.filters.iter().map(move |filter| (scene, filter)))
        .map(|(scene, filter)| (format!("{scene}, {filter}"), chart(content, scene, filter)))
        .collect();
    let table = |scene: &str| {
        let rows = filters::rows(content.results, scene, content.count);
        match rows.is_empty() {
            true => nothing("Nothing was filtered here."),
            false => document::rows(&HEADER.map(Into::into), &rows),
        }
    };
    Some(html! {
        p { (INTRODUCTION) }
        h3 { "What filters leave at " (content.count) " samples" }
        (figure("filters", &tabs("Scene and filter", &panels), &html! {
            "RMSE over covered pixels, in 8-bit units: " (swatch("a")) " of the pictures, " (swatch("b"))
            " of the filtered ones, " (swatch("c")) " of the exact picture after the filter, its blur."
        }, &content.study_command()))
        h3 { "By region, and as a viewer sees it" }
        (figure("filters-table", &content.by_scene(table), &html! {
            "Ratios are errors with the filter over those without: over all covered pixels, those that no \
             primitive's edge crosses, and the others; — where there was less than 0.05 of 255 before."
        }, &content.study_command()))
    })
}

fn chart(content: &Content<'_>, scene: &str, filter: &str) -> Markup {
    let row = |series: &String| {
        let record = content.at_count(scene, series);
        let found = record.and_then(|r| Some((r, r.post.iter().find(|p| p.filter == filter)?)));
        let bars = found.map(|(r, post)| {
            let blur = Estimate::exactly(post.blur);
            [("without", r.covered.rmse, "a"), ("with", post.covered, "b"), ("blur", blur, "c")]
                .map(|(what, e, class)| Bar::Dot {
                    value: [e.value, e.low, e.high],
                    measure: format!("filter-{what}"),
                    class,
                    says: format!("{}\n{what}: {}", r.design, estimated(e)),
                })
        });
        Row {
            id: record.map_or(String::new(), |r| r.id.clone()),
            series: series.clone(),
            style: content.styles.of(series),
            note: if bars.is_none() { "no result".into() } else { String::new() },
            bars: bars.map_or(Vec::new(), Vec::from),
        }
    };
    let chart = Rows {
        title: format!("Error with and without {filter} on {scene}"),
        axis: "RMSE, 8-bit units".into(),
        kind: Kind::Linear,
        together: true,
        rows: content.designs().iter().map(row).collect(),
    };
    chart.draw().unwrap_or_else(|| nothing("Nothing was filtered here."))
}
