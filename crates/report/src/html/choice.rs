//! The summary: which design to build.

use maud::{Markup, html};

use crate::html::against;
use crate::html::page::Extras;
use crate::html::parts::{Cell, Content, figure, name};
use crate::html::words::{counted, estimated, figures, fixed, listed};
use screendoor_study::study::analysis::{
    Answer, BUDGETS, Budget, Candidate, Need, RunName, Separation, answers, baseline, relative,
};
use screendoor_study::study::results::Results;
use screendoor_trace::param::Options;

pub(super) fn section(content: &Content<'_>) -> Markup {
    let answers = answers(content.results);
    let on = baseline(&content.results.study);
    html! {
        div class="answer" { @for sentence in lead(content, &answers) { p { (with_names(&sentence)) } } }
        h3 { "The least error for a need and a budget" }
        (figure("answers", &table(&answers), &html! {
            "In each cell the design with the least error over all scenes and its samples per pixel; \
             its error as a share of that of " code { (on.series) } " at " (on.samples)
            " samples, with a 95 % interval; its state and passes; and the best other design. It is " i { "ahead of" }
            " that one where their intervals separate them, " i { "level with" } " it where these seeds show no \
             difference, and " i { "before" } " it where one seed gives no interval."
        }, &content.study_command()))
        h3 { "Error against cost, all scenes" }
        (against::central(content))
        details {
            summary { "Error against cost, scene by scene" }
            (against::per_scene(content))
        }
    }
}

/// Which design to build, in sentences; names stand between backquotes.
pub fn answer(results: &Results) -> Vec<String> {
    let extras = Extras::default();
    lead(&Content::new(results, &extras), &answers(results))
}

fn bytes(c: &Candidate<'_>) -> String {
    match c.state {
        Some(bytes) => format!("{} bytes per pixel", figures_of_bytes(bytes)),
        None => "state that grows with the fragments".to_string(),
    }
}

fn figures_of_bytes(bytes: f64) -> String {
    if bytes.fract() == 0.0 { fixed(bytes, 0) } else { fixed(bytes, 1) }
}

fn passes(c: &Candidate<'_>) -> String {
    if c.passes == 1 { "one pass".into() } else { format!("{} passes", c.passes) }
}

/// What the choice gives up, as the end of a sentence.
fn price(c: &Candidate<'_>) -> String {
    let k = c.kept;
    let lacks = [
        (!k.unbiased, "it is biased"),
        (!k.same_expectation, "its picture depends on the order of fragments, its mean too"),
        (k.same_expectation && !k.same_picture, "its noise depends on the order of fragments"),
    ];
    let said: Vec<String> =
        lacks.iter().filter(|(holds, _)| *holds).map(|(_, what)| what.to_string()).collect();
    if said.is_empty() { String::new() } else { format!("; {}", listed(&said)) }
}

/// What the answers say, in sentences. Every word follows from the numbers.
pub(super) fn lead(content: &Content<'_>, answers: &[Answer<'_>]) -> Vec<String> {
    let find =
        |need: Need, budget: Budget| answers.iter().find(|a| a.need == need && a.budget == budget);
    let on = baseline(&content.results.study);
    let mut text = Vec::new();
    let scenes = content.results.study.scenes.len();
    let over =
        if scenes == 1 { "on the one scene".to_string() } else { format!("over {scenes} scenes") };
    let cases = [
        (Need::Any, Budget::Bounded, "With a fixed state per pixel"),
        (
            Need::All,
            Budget::Bounded,
            "Of those that are unbiased, have the same mean in any order of fragments and need one pass",
        ),
        (Need::All, Budget::Bytes(64), "Of the same within 64 bytes per pixel"),
    ];
    let mut before: Option<(&str, u32)> = None;
    for (need, budget, start) in cases {
        let Some(answer) = find(need, budget) else { continue };
        let Some(best) = &answer.best else {
            text.push(format!("{start}, none with results on all scenes meets this."));
            before = None;
            continue;
        };
        let run = (best.run.series, best.run.samples);
        if before == Some(run) {
            text.push(format!("{start}, it is the same."));
            continue;
        }
        before = Some(run);
        let first = text.is_empty();
        let share = if run == (on.series, on.samples) {
            "it is the baseline itself".to_string()
        } else {
            let of = if first {
                format!(" times that of {} at {} samples", spelt(on.series), on.samples)
            } else {
                String::new()
            };
            format!("{}{of}", estimated(best.error))
        };
        let over = if first { format!(" {over}") } else { String::new() };
        text.push(format!(
            "{start}, {} at {} has the least error{over}: {share}, with {} in {}{}. {}",
            spelt(best.design),
            counted(best.run.samples as usize, "sample"),
            bytes(best),
            passes(best),
            price(best),
            second(answer)
        ));
    }
    text.extend(left_out(content));
    text
}

/// A design's name within a sentence: between marks that no name has.
fn spelt(design: &str) -> String {
    format!("`{design}`")
}

/// A sentence with its designs' names set as such.
fn with_names(sentence: &str) -> Markup {
    html! {
        @for (i, part) in sentence.split('`').enumerate() {
            @if i % 2 == 1 { (name(part)) } @else { (part) }
        }
    }
}

/// What is said of the runner-up.
fn second(answer: &Answer<'_>) -> String {
    let Some(second) = &answer.runner_up else {
        return "No other design meets this.".to_string();
    };
    let whom =
        format!("{} at {}", spelt(second.design), counted(second.run.samples as usize, "sample"));
    match answer.separation {
        Separation::Alone => String::new(),
        Separation::Apart(share) => format!(
            "Next is {whom} with {}, and the intervals separate the two: the first has {} times \
             its error.",
            figures(second.error.value),
            estimated(share)
        ),
        Separation::NoDifference(_) => {
            format!("Between it and {whom} there is no difference that these seeds show.")
        }
        Separation::OneSeed => {
            format!(
                "Next is {whom} with {}; one seed cannot tell them apart.",
                figures(second.error.value)
            )
        }
    }
}

/// Which designs cannot be chosen at any sample count, since results are missing.
fn left_out(content: &Content<'_>) -> Option<String> {
    let study = &content.results.study;
    let known = |series: &String| {
        let has = |samples: &u32| {
            let run = RunName { series, samples: *samples };
            relative(content.results, run).is_ok()
        };
        study.samples.iter().any(has)
    };
    let gone: Vec<String> = study.designs.iter().filter(|s| !known(s)).map(|s| spelt(s)).collect();
    (!gone.is_empty())
        .then(|| format!("Left out, since results are missing on some scene: {}.", listed(&gone)))
}

fn table(answers: &[Answer<'_>]) -> Markup {
    html! {
        div class="scroll" tabindex="0" role="region" aria-label="Table" {
            table class="answers" {
                thead { tr {
                    th scope="col" { "state per pixel" }
                    @for choice in Need::CHOICES { th scope="col" title=(choice.help) { (choice.name) } }
                } }
                tbody { @for budget in BUDGETS {
                    tr {
                        th scope="row" { (match budget {
                            Budget::Bytes(most) => format!("≤ {most} bytes"),
                            Budget::Bounded => "any fixed size".into(),
                            Budget::Any => "may grow".into(),
                        }) }
                        @for answer in answers.iter().filter(|a| a.budget == budget) { (cell(answer)) }
                    }
                } }
            }
        }
    }
}

fn cell(answer: &Answer<'_>) -> Markup {
    let Some(best) = &answer.best else { return html! { td class="none" { "none" } } };
    let place = match answer.separation {
        Separation::Alone => "",
        Separation::Apart(_) => "ahead of",
        Separation::NoDifference(_) => "level with",
        Separation::OneSeed => "before",
    };
    let decimals = |e: f64| if e == 0.0 { 0 } else { 3 };
    html! {
        td data-v=(best.error.value) data-low=(best.error.low) data-high=(best.error.high)
            data-series=(best.run.series) data-samples=(best.run.samples) {
            span class="pick" { (name(best.design)) " at " (best.run.samples) }
            span class="value" {
                b { (fixed(best.error.value, decimals(best.error.value))) }
                @if best.error.low != best.error.high {
                    " " span class="pm" { (fixed(best.error.low, 3)) "–" (fixed(best.error.high, 3)) }
                }
            }
            span class="small" {
                @match best.state {
                    Some(bytes) => { (figures_of_bytes(bytes)) " B" },
                    None => { "grows" },
                }
                ", " (passes(best))
            }
            @if let Some(second) = &answer.runner_up {
                span class="small second" {
                    (place) " " (name(second.design)) " at " (second.run.samples) ", "
                    (fixed(second.error.value, decimals(second.error.value)))
                }
            }
        }
    }
}

/// A share for a table, or the scenes that lack.
pub(super) fn share_cell(content: &Content<'_>, series: &str, samples: u32) -> Cell {
    let run = RunName { series, samples };
    match relative(content.results, run) {
        Ok(e) => Cell::Estimate(e, 3),
        Err(scenes) => Cell::Missing(format!("no result on {}", scenes.join(", "))),
    }
}
