//! What was measured, on what, and how.

use maud::{Markup, html};

use crate::html::page::{Place, given_within};
use crate::html::parts::{Cell, Content, command, figure, rounded, table};
use crate::html::words::{figures, fixed, grouped, quoted};
use screendoor_study::study::analysis::{Cost, ROUNDING, baseline};
use screendoor_study::study::record::Promise;
use screendoor_study::study::record::Record;
use screendoor_trace::param::Options;

pub(super) fn designs(content: &Content<'_>) -> Markup {
    html! {
        dl class="designs" {
            @for series in content.designs() {
                @let text = content.extras.designs.iter().find(|d| d.series == *series);
                @let record = content.results.records.iter().find(|r| r.series == *series);
                dt id=(format!("design-{}", anchor(series))) { (content.named(series)) }
                dd {
                    @if let Some(text) = text {
                        p { (text.summary) }
                        @if !text.citation.is_empty() { p class="citation" { (text.citation) } }
                    }
                    p class="promises" { (promises(text.map(|t| &t.promises[..]), record)) }
                    @if let Some(needs) = needs(content, series) { p class="promises" { (needs) } }
                }
            }
        }
        (command("screendoor designs"))
        (given_within(content.extras, Place::Designs))
    }
}

fn anchor(series: &str) -> String {
    series.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

/// What a pixel and a picture take at the sample count at which designs are compared: of
/// scenes with opaque fragments, for which some keep a z-buffer, apart where that differs.
fn needs(content: &Content<'_>, series: &str) -> Option<String> {
    let own = || {
        let all = content.results.records.iter();
        all.filter(move |r| r.series == series && r.samples == content.count)
    };
    let words = |r: &Record| {
        let passes = if r.passes == 1 { "pass" } else { "passes" };
        let bytes = match r.state_bytes() {
            Some(bytes) => format!("{} B", figures(bytes)),
            None => "grows".to_string(),
        };
        format!("{bytes}, {} {passes}", r.passes)
    };
    let cost = |r: &&Record| (r.passes, r.state_bits.total());
    let (least, most) = (own().min_by_key(cost)?, own().max_by_key(cost)?);
    let more = if cost(&least) == cost(&most) {
        String::new()
    } else {
        format!("; {} with opaque fragments", words(most))
    };
    Some(format!("{}{more}, at {} samples: {}", words(least), content.count, most.layout))
}

/// What a design promises: as it is told, or as its records have it.
fn promises(told: Option<&[String]>, record: Option<&Record>) -> String {
    let mut words: Vec<String> =
        record.iter().filter(|r| !r.family.is_empty()).map(|r| r.family.clone()).collect();
    match (told, record) {
        (Some(told), _) if !told.is_empty() => words.extend_from_slice(told),
        (_, Some(r)) => {
            let p = r.promises;
            let list = [
                (p.unbiased, "unbiased"),
                (p.consistent, "consistent"),
                (Promise::always_if(p.same_picture), "the same picture in any order"),
                (p.same_expectation, "the same mean in any order"),
                (Promise::always_if(!p.seeded), "the same for every seed"),
            ];
            words.extend(list.iter().filter_map(|(promise, what)| promise.words(what)));
        }
        (_, None) => words.push("no results".into()),
    }
    words.join(" · ")
}

pub(super) fn scenes(content: &Content<'_>) -> Markup {
    let header = [
        "scene",
        "source",
        "size",
        "fragments",
        "covered pixels",
        "fragments per covered pixel",
        "95 % of pixels",
        "most",
        "mean alpha",
        "opaque, %",
        "at equal depths, %",
        "samples",
    ];
    let count = |n: u64| Cell::Number(n as f64, grouped(n));
    let row = |name: &str| -> Vec<Cell> {
        let mut cells = vec![Cell::text(name)];
        let Some(s) = content.results.scenes.iter().find(|s| s.name == name) else {
            cells.extend((1..header.len()).map(|_| Cell::Missing("no trace".into())));
            return cells;
        };
        let t = &s.statistics;
        let percent = |n: u64| 100.0 * n as f64 / t.fragments.max(1) as f64;
        let (opaque, tied) = (percent(t.alpha.opaque), percent(t.tied_fragments));
        cells.extend([
            Cell::text(&s.source),
            Cell::text(format!("{} × {}", s.size[0], s.size[1])),
            count(t.fragments),
            count(t.covered_pixels),
            Cell::Number(t.depth_complexity.mean, fixed(t.depth_complexity.mean, 1)),
            count(u64::from(t.depth_complexity.p95)),
            count(u64::from(t.depth_complexity.max)),
            Cell::Number(t.alpha.mean, fixed(t.alpha.mean, 2)),
            Cell::Number(opaque, fixed(opaque, 0)),
            Cell::Number(tied, rounded(tied, 1)),
            count(u64::from(s.samples)),
        ]);
        cells
    };
    let first = content.results.scenes.first();
    let again = html! {
        @if let Some(s) = first { (command(&format!("screendoor info {}", quoted(&s.trace)))) }
    };
    html! {
        (figure("scene-facts", &table(&header, &content.scenes().map(row).collect::<Vec<_>>()),
            &html! { "The traces in numbers. Mean alpha is over fragments; opaque fragments have an alpha of 1. At equal \
            depths lie fragments that share a depth with another one at a sample that both cover: where there \
            are any, promises for differing depths are not kept." },
            &again))
        @for s in content.results.scenes.iter().filter(|s| !s.warnings.is_empty()) {
            p class="absent" { b { "Not drawn of " (s.name) ": " } (s.warnings.join("; ")) "." }
        }
        details {
            summary { "Cameras" }
            dl class="plain" {
                @for s in &content.results.scenes { dt { (s.name) } dd { (s.camera) } }
            }
        }
    }
}

pub(super) fn method(content: &Content<'_>) -> Markup {
    let study = &content.results.study;
    let on = baseline(study);
    html! {
        div class="prose" {
            p {
                "The fragments of each scene are recorded once, as a trace. Every design is given the \
                 same fragments in the same order, at each sample count, with "
                (study.seeds) " seeds where a seed changes anything, from seed " (study.first_seed)
                " on. Its picture is held against the exact one: every sample's fragments sorted by depth \
                 and composited."
            }
            dl class="definitions" {
                dt { "Error" }
                dd {
                    "Root mean square over covered pixels and channels of picture minus exact picture of the \
                     same samples, " (content.results.values()) ", in units of 1/255 of the range from black to white."
                }
                dt { "Relative error" }
                dd {
                    "RMSE divided by that of " code { (on.series) } " at " (on.samples)
                    " samples on the same scene. Over all scenes the geometric mean, so that no scene \
                     counts more for being harder. In it an RMSE below " (figures(ROUNDING))
                    " counts as that much, 1/√12: rounding to 8 bits makes such an error itself. Without any error the share is 0. Where one \
                     scene's result is missing there is no figure."
                }
                dt { "Intervals" }
                dd {
                    "95 % by Student's t over the seeds; half-widths of ratios add in quadrature on a \
                     logarithmic scale. They say what other seeds would give on these scenes, and nothing \
                     of other scenes. One seed has none."
                }
                dt { "Variance and bias" }
                dd {
                    "Per pixel over the seeds, averaged over covered pixels. The squared bias is the square \
                     of the mean error less a share of the variance, so that it is 0 on average for an \
                     unbiased design and can be negative; its interval is that of products of seeds two by \
                     two, which needs four seeds."
                }
                dt { "Mean error" }
                dd {
                    "Mean over covered pixels and channels of picture minus exact picture, with its sign. Of \
                     a design that seeds change its 95 % interval over the seeds holds 0 where no bias of \
                     this kind shows; of others it is a figure without an interval. Biases of both signs in \
                     different pixels cancel in it and not in the squared bias."
                }
                dt { "Promises" }
                dd {
                    "Unbiased: the expectation over seeds is the exact picture. The same picture in any order \
                     of fragments, but for rounding, those of equal depth staying in sequence; the same mean \
                     in any order says that of the expectation alone, and noise may differ. Where depths \
                     differ: where no two fragments share a depth at a sample that both cover."
                }
                dt { "FLIP" }
                dd {
                    "Andersson et al., FLIP: A Difference Evaluator for Alternating Images, 2020; for high \
                     dynamic range Andersson et al., Visualizing Errors in Rendered High Dynamic Range \
                     Images, 2021. No unit, 0 to 1."
                }
                dt { "Spectrum and blueness" }
                dd {
                    "Power density of the error by radial frequency in cycles per pixel, in squared 8-bit \
                     units. Blueness in decibels."
                }
                dt { "Convergence" }
                dd { "The exponent p of RMSE ∝ N" sup { "−p" } " through all sample counts, by least squares of logarithms." }
                @for (cost, choice) in Cost::ALL.iter().zip(Cost::CHOICES) {
                    dt { (choice.help) }
                    dd { (sentence(cost.meaning())) " Unit: " (cost.unit()) "." }
                }
                dt { "Not modelled" }
                dd { "Cycles, caches and bandwidth: events are counted, and what they cost in silicon is not." }
            }
        }
    }
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first: String = letters.next().map_or(String::new(), |c| c.to_uppercase().collect());
    format!("{first}{}.", letters.as_str())
}
