//! Error against cost.

use maud::{Markup, html};

use crate::chart::{Axis, Curve, Kind, Mark, Names, Plot};
use crate::html::parts::{Content, figure, nothing, tabs};
use crate::html::words::{counted, estimated, figures, listed};
use screendoor_study::study::analysis::{Cost, Point, Points, baseline, points};
use screendoor_trace::param::Options;

/// The chart over all scenes, with a panel for each cost.
pub(super) fn central(content: &Content<'_>) -> Markup {
    let on = baseline(&content.results.study);
    let panels: Vec<(String, Markup)> = Cost::ALL
        .iter()
        .zip(Cost::CHOICES)
        .map(|(cost, choice)| (choice.help.to_string(), panel(content, *cost)))
        .collect();
    html! {
        div class="central" {
            fieldset class="filters" {
                legend { "Show only designs that are" }
                label { input type="checkbox" data-filter="unbiased"; " unbiased" }
                label { input type="checkbox" data-filter="same-expectation"; " of the same mean in any order" }
                label { input type="checkbox" data-filter="same-picture"; " of the same picture in any order" }
                label { input type="checkbox" data-filter="one-pass"; " done in one pass" }
            }
            (figure("central", &html! { (tabs("Cost", &panels)) (content.legend(|_| true)) }, &html! {
                "Error over all scenes: the geometric mean of each scene's RMSE over covered pixels as a \
                 share of that of " code { (on.series) } " at " (on.samples) " samples. Bars are 95 % \
                 intervals, of both sides of the share; lines join the sample counts of a design. The \
                 step line is the Pareto front: nothing shown has less of one and no more of the other. \
                 Each picture is held against the exact one of the same samples. A filter counts what a \
                 design promises and keeps on all scenes: what it promises where depths differ it does not \
                 keep where fragments share them. The same mean over seeds in any order of fragments does \
                 not say that the noise about it is the same."
            }, &html! { (content.study_command()) (content.replay_one()) }))
        }
    }
}

/// The chart of one cost over all scenes, and who is not on it.
fn panel(content: &Content<'_>, cost: Cost) -> Markup {
    let all = points(content.results, None, cost);
    let y = Axis { title: "error relative to the baseline".into(), kind: Kind::Log };
    let plot = Plot {
        title: format!("Error over all scenes against {}", axis(cost)),
        size: [720.0, 470.0],
        names: Names::At(content.count),
        line: Some(1.0),
        ..plot(content, &all, cost, y)
    };
    let shown: Option<Markup> = plot.draw();
    html! {
        p class="meaning" { (capital(cost.meaning())) "." }
        @match shown {
            Some(svg) => (svg),
            None => (nothing("No design has both this cost and an error on all scenes.")),
        }
        (absent(&all))
    }
}

/// A cost with its unit.
fn axis(cost: Cost) -> String {
    format!("{}, {}", Cost::CHOICES[cost as usize].help, cost.unit())
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |c| c.to_uppercase().chain(letters).collect())
}

fn plot(content: &Content<'_>, all: &Points<'_>, cost: Cost, y: Axis) -> Plot {
    let x =
        Axis { title: axis(cost), kind: if cost == Cost::State { Kind::Log2 } else { Kind::Log } };
    let curves = content
        .designs()
        .iter()
        .filter_map(|series| {
            let own: Vec<&Point<'_>> =
                all.known.iter().filter(|p| p.run.series == series).collect();
            let first = own.first()?;
            // A filter must not let through a design that needs more passes at more samples.
            let passes = own.iter().map(|p| p.passes).max().unwrap_or(0);
            Some(Curve {
                series: series.clone(),
                style: content.styles.of(series),
                facts: Some((first.kept, passes)),
                marks: own.iter().map(|p| mark(p, cost)).collect(),
            })
        })
        .collect();
    let title = String::new();
    Plot { title, x, y, size: [360.0, 290.0], curves, front: true, names: Names::None, line: None }
}

fn mark(p: &Point<'_>, cost: Cost) -> Mark {
    let unit = if p.id.is_some() { " of 255 RMSE" } else { " times the baseline's error" };
    let spread = if p.cost.low == p.cost.high {
        String::new()
    } else {
        format!(" ({} to {})", figures(p.cost.low), figures(p.cost.high))
    };
    let says = format!(
        "{} at {}\n{}{unit}\n{}{spread} {}{}",
        p.run.series,
        counted(p.run.samples as usize, "sample"),
        estimated(p.error),
        figures(p.cost.median),
        cost.unit(),
        if p.front { "\non the Pareto front" } else { "" }
    );
    Mark {
        id: p.id.map(str::to_string),
        samples: Some(p.run.samples),
        cost: p.cost,
        error: p.error,
        says,
        front: p.front,
        marked: true,
    }
}

/// A design and the sample counts at which it lacks.
type Counts<'a> = (&'a str, Vec<String>);

/// Who is not on a chart, reason by reason.
fn absent(all: &Points<'_>) -> Markup {
    let mut reasons: Vec<(&str, Vec<Counts<'_>>)> = Vec::new();
    for (run, why) in &all.absent {
        let reason = match reasons.iter().position(|(w, _)| w == why) {
            Some(place) => place,
            None => {
                reasons.push((why, Vec::new()));
                reasons.len() - 1
            }
        };
        let list = &mut reasons[reason].1;
        match list.iter_mut().find(|(series, _)| *series == run.series) {
            Some((_, counts)) => counts.push(run.samples.to_string()),
            None => list.push((run.series, vec![run.samples.to_string()])),
        }
    }
    html! {
        @if !reasons.is_empty() {
            p class="absent" {
                b { "Not shown. " }
                @for (why, list) in &reasons {
                    span class="reason" { (capital(why)) ": " }
                    @for (i, (series, counts)) in list.iter().enumerate() {
                        @if i > 0 { ", " }
                        code { (series) } " at " (listed(counts))
                    }
                    ". "
                }
            }
        }
    }
}

/// The same for each scene.
pub(super) fn per_scene(content: &Content<'_>) -> Markup {
    let panels: Vec<(String, Markup)> = Cost::ALL
        .iter()
        .zip(Cost::CHOICES)
        .map(|(cost, choice)| (choice.help.to_string(), multiples(content, *cost)))
        .collect();
    figure(
        "central-scenes",
        &html! { (tabs("Cost", &panels)) (content.legend(|_| true)) },
        &html! {
            "RMSE over covered pixels in 8-bit units " (content.results.values()) ", with 95 % intervals over seeds."
        },
        &html! { (content.study_command()) (content.replay_one()) },
    )
}

fn multiples(content: &Content<'_>, cost: Cost) -> Markup {
    html! {
        div class="multiples" {
            @for scene in content.scenes() {
                div class="small-chart" {
                    h4 { (scene) }
                    @let all = points(content.results, Some(scene), cost);
                    @let y = Axis { title: "RMSE, 8-bit units".into(), kind: Kind::Log };
                    @let plot = Plot {
                        title: format!("RMSE on {scene} against {}", axis(cost)),
                        ..plot(content, &all, cost, y)
                    };
                    @match plot.draw() {
                        Some(svg) => (svg),
                        None => (nothing("No design has both this cost and an error here.")),
                    }
                    (absent(&all))
                }
            }
        }
    }
}
