//! Everything that is needed to measure it again, and what has not been measured.

use maud::{Markup, html};

use crate::html::parts::{Cell, Content, figure, nothing, table};
use crate::html::words::{counted, grouped};
use screendoor_study::study::record::Record;

pub(super) fn section(content: &Content<'_>) -> Markup {
    html! {
        dl class="plain" {
            @for (name, value) in content.results.machine.facts() { dt { (name) } dd { (value) } }
        }
        p class="prose" {
            "Everything but times is a pure function of the study: measured again, on whatever machine, it \
             is the same to the last bit. Commands that name a trace run in the folder of the results."
        }
        h3 { "Traces" }
        (figure("traces", &traces(content), &html! { "BLAKE3 of each trace's content." }, &html! {}))
        h3 { "The study" }
        pre class="file" tabindex="0" { code { (content.results.study.to_toml()) } }
        (content.study_command())
        details class="records" {
            summary { "All " (counted(content.results.records.len(), "result")) ", each with its command" }
            (records(content))
        }
    }
}

fn traces(content: &Content<'_>) -> Markup {
    let row = |s: &screendoor_study::study::results::SceneFacts| {
        vec![
            Cell::text(&s.name),
            Cell::Text(html! { code { (s.trace) } }),
            Cell::Text(html! { code class="hash" { (s.content) } }),
        ]
    };
    table(
        &["scene", "file", "content"],
        &content.results.scenes.iter().map(row).collect::<Vec<_>>(),
    )
}

fn records(content: &Content<'_>) -> Markup {
    let row = |r: &Record| {
        vec![
            Cell::text(&r.scene),
            Cell::Text(content.named(&r.series)),
            Cell::Number(f64::from(r.samples), r.samples.to_string()),
            Cell::Number(r.fragments as f64, grouped(r.fragments)),
            Cell::Estimate(r.covered.rmse, 3),
            Cell::Text(
                html! { button type="button" class="copy" data-copy=(content.replay(r)) { "copy" } },
            ),
        ]
    };
    let header = ["scene", "design", "samples", "fragments", "RMSE", "command"];
    table(&header, &content.results.records.iter().map(row).collect::<Vec<_>>())
}

pub(super) fn missing(content: &Content<'_>) -> Markup {
    let list = &content.results.missing;
    if list.is_empty() {
        return nothing("None: every run of the study has a result.");
    }
    let row = |m: &screendoor_study::study::results::Missing| {
        vec![
            Cell::text(&m.scene),
            Cell::Text(content.named(&m.series)),
            Cell::Number(f64::from(m.samples), m.samples.to_string()),
            Cell::text(m.reason()),
        ]
    };
    let rows: Vec<_> = list.iter().map(row).collect();
    html! {
        p { (counted(list.len(), "run")) " of the study without a result. No figure over scenes includes its design at its sample count." }
        (table(&["scene", "design", "samples", "why"], &rows))
        (content.study_command())
    }
}
