//! How errors fall as samples increase.

use maud::{Markup, html};

use crate::chart::{Axis, Curve, Kind, Mark, Names, Plot};
use crate::html::parts::{Cell, Content, figure, nothing, table};
use crate::html::words::{counted, estimated};
use screendoor_study::study::analysis::convergence;
use screendoor_study::study::throughput::Spread;

pub(super) fn section(content: &Content<'_>) -> Markup {
    let again = || html! { (content.study_command()) (content.replay_one()) };
    if content.results.study.samples.len() < 2 {
        return nothing("The study has one sample count: nothing can be said of convergence.");
    }
    html! {
        (figure("rmse-by-samples", &html! {
            (content.by_scene(|scene| chart(content, scene)))
            (content.legend(|_| true))
        }, &html! {
            "RMSE over covered pixels against samples per pixel, both logarithmic: a power law is a \
             straight line. Independent samples fall as N" sup { "−0.5" } "."
        }, &again()))
        h3 { "Exponents" }
        (figure("exponents", &exponents(content), &html! {
            "p of RMSE ∝ N" sup { "−p" } ", fitted to all of the study's sample counts, with the 95 % \
             interval. — where fewer than three counts have an error."
        }, &content.study_command()))
    }
}

fn chart(content: &Content<'_>, scene: &str) -> Markup {
    let study = &content.results.study;
    let mut lacks = Vec::new();
    let mut curves = Vec::new();
    for series in content.designs() {
        let mut marks = Vec::new();
        for samples in &study.samples {
            let Some(record) = content.results.record(scene, series, *samples) else {
                lacks.push(format!("{series} at {samples}"));
                continue;
            };
            let n = f64::from(*samples);
            marks.push(Mark {
                id: Some(record.id.clone()),
                samples: Some(*samples),
                cost: Spread::exactly(n),
                error: record.covered.rmse,
                says: format!(
                    "{series} at {}\n{} of 255 RMSE",
                    counted(*samples as usize, "sample"),
                    estimated(record.covered.rmse)
                ),
                front: false,
                marked: true,
            });
        }
        let style = content.styles.of(series);
        curves.push(Curve { series: series.clone(), style, facts: None, marks });
    }
    let plot = Plot {
        title: format!("RMSE on {scene} against samples per pixel"),
        x: Axis { title: "samples per pixel".into(), kind: Kind::Log2 },
        y: Axis { title: "RMSE, 8-bit units".into(), kind: Kind::Log },
        size: [860.0, 440.0],
        curves,
        front: false,
        names: Names::Beside,
        line: None,
    };
    html! {
        @match plot.draw() {
            Some(svg) => (svg),
            None => (nothing("No design has a result here.")),
        }
        @if !lacks.is_empty() { p class="absent" { b { "Missing: " } (lacks.join(", ")) "." } }
    }
}

fn exponents(content: &Content<'_>) -> Markup {
    let scenes: Vec<&str> = content.scenes().collect();
    let mut header = vec!["design"];
    header.extend(&scenes);
    let row = |series: &String| {
        let cells = scenes.iter().map(|scene| {
            let fitted = convergence(content.results, scene, series);
            Cell::estimate(fitted.map(|f| f.exponent), 2, "fewer than three counts with an error")
        });
        std::iter::once(Cell::Text(content.named(series))).chain(cells).collect()
    };
    table(&header, &content.designs().iter().map(row).collect::<Vec<_>>())
}
