//! What is seen of the errors: FLIP, what a blur leaves, the spectrum.

use maud::{Markup, html};

use crate::chart::{Axis, Bar, Curve, Kind, Mark, Names, Plot, Row, Rows, swatch};
use crate::html::page::{Place, given_within};
use crate::html::parts::{Cell, Content, figure, nothing, table};
use crate::html::words::{estimated, figures, fixed};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::record::{FlipOverSeeds, Record};
use screendoor_study::study::throughput::Spread;

pub(super) fn section(content: &Content<'_>) -> Markup {
    let count = content.count;
    let any = |has: &dyn Fn(&Record) -> bool| {
        content.results.records.iter().any(|r| r.samples == count && has(r))
    };
    html! {
        h3 { "FLIP at " (count) " samples" }
        @if any(&|r| r.flip.is_some() || r.flip_hdr.is_some()) { (flip_section(content)) }
        @else { (nothing("FLIP was not measured.")) }
        h3 { "After a blur, at " (count) " samples" }
        @if any(&|r| !r.filtered.is_empty()) { (filtered_section(content)) }
        @else { (nothing("Errors after a blur were not measured.")) }
        h3 { "Spectrum of the error at " (count) " samples" }
        @if any(&|r| r.spectrum.is_some()) { (spectrum_section(content)) }
        @else { (nothing("The spectrum was not measured.")) }
        h3 { "Flicker at " (count) " samples" }
        @if any(&|r| r.covered.temporal.is_some()) { (flicker_section(content)) }
        @else { (nothing("Flicker was not measured: it takes more than one seed.")) }
        (given_within(content.extras, Place::Perception))
    }
}

fn flip_section(content: &Content<'_>) -> Markup {
    html! {
        (figure("flip", &content.by_scene(|scene| flip(content, scene)), &html! {
            "FLIP estimates the difference that a viewer sees when alternating between two pictures: 0 is \
             none, 1 the largest. Marks are means over the frame with 95 % intervals over seeds, boxes the \
             weighted quartiles. " (swatch("a")) " on a display of standard range, "
            (swatch("b")) " over all exposures in which something shows."
        }, &content.study_command()))
        details {
            summary { "FLIP on all scenes" }
            (figure("flip-table", &flip_table(content), &html! {
                "Mean FLIP on a display of standard range at " (content.count) " samples."
            }, &content.study_command()))
        }
    }
}

fn filtered_section(content: &Content<'_>) -> Markup {
    figure(
        "filtered",
        &content.by_scene(|scene| filtered(content, scene)),
        &html! {
            "RMSE over covered pixels after a Gaussian on the error, in 8-bit units: what is left from \
             afar. " (swatch("a")) " 0 px, " (swatch("b")) " 1 px, "
            (swatch("c")) " 2 px of standard deviation. Noise falls; structure stays."
        },
        &content.study_command(),
    )
}

fn spectrum_section(content: &Content<'_>) -> Markup {
    figure(
        "spectrum",
        &content.by_scene(|scene| spectrum(content, scene)),
        &html! {
            "Radially averaged power spectrum of the error, mean over seeds. White noise lies level; power \
             at high frequencies is seen less. Blueness: 0 dB for white noise, above for blue."
        },
        &content.study_command(),
    )
}

fn flicker_section(content: &Content<'_>) -> Markup {
    figure(
        "flicker",
        &content.by_scene(|scene| flicker(content, scene)),
        &html! {
            "Standard deviation over seeds of a covered pixel, in 8-bit units " (content.results.values()) ": what changes \
             from frame to frame in a still scene where every frame has a seed of its own. Half of the \
             pixels, and 95 % of them, have no more."
        },
        &html! { (content.study_command()) (content.replay_one()) },
    )
}

/// A row for each design, of what `bars` makes of its record.
fn rows(content: &Content<'_>, scene: &str, bars: impl Fn(&Record) -> Vec<Bar>) -> Vec<Row> {
    let row = |series: &String| {
        let record = content.at_count(scene, series);
        let bars = record.map(&bars).unwrap_or_default();
        Row {
            id: record.map_or(String::new(), |r| r.id.clone()),
            series: series.clone(),
            style: content.styles.of(series),
            note: match record {
                None => "no result".into(),
                Some(_) if bars.is_empty() => "not measured".into(),
                Some(_) => String::new(),
            },
            bars,
        }
    };
    content.designs().iter().map(row).collect()
}

fn dot(e: Estimate, measure: &'static str, class: &'static str, says: String) -> Bar {
    Bar::Dot { value: [e.value, e.low, e.high], measure: measure.to_string(), class, says }
}

fn flip(content: &Content<'_>, scene: &str) -> Markup {
    let bars = |r: &Record| {
        let one = |f: &FlipOverSeeds, measure, class, name: &str| {
            let [first, median, third] = f.quartiles.map(|q| q.value);
            let says = format!(
                "{}\n{name}: mean {}\nquartiles {}, {}, {}",
                r.design,
                estimated(f.mean),
                figures(first),
                figures(median),
                figures(third)
            );
            let quartiles = [first, median, third];
            [Bar::Box { quartiles, class }, dot(f.mean, measure, class, says)]
        };
        let standard = r.flip.iter().flat_map(|f| one(f, "flip", "a", "FLIP"));
        let high = r.flip_hdr.iter().flat_map(|f| one(f, "flip-hdr", "b", "HDR-FLIP"));
        standard.chain(high).collect()
    };
    let chart = Rows {
        title: format!("FLIP on {scene}"),
        axis: "FLIP".into(),
        kind: Kind::Linear,
        together: false,
        rows: rows(content, scene, bars),
    };
    chart.draw().unwrap_or_else(|| nothing("FLIP was not measured here."))
}

fn flip_table(content: &Content<'_>) -> Markup {
    let scenes: Vec<&str> = content.scenes().collect();
    let mut header = vec!["design"];
    header.extend(&scenes);
    let row = |series: &String| {
        let cells = scenes.iter().map(|scene| match content.at_count(scene, series) {
            None => Cell::Missing("no result".into()),
            Some(r) => Cell::estimate(r.flip.map(|f| f.mean), 4, "not measured"),
        });
        std::iter::once(Cell::Text(content.named(series))).chain(cells).collect()
    };
    table(&header, &content.designs().iter().map(row).collect::<Vec<_>>())
}

fn filtered(content: &Content<'_>, scene: &str) -> Markup {
    let bars = |r: &Record| {
        let styles = [("filtered-0", "a"), ("filtered-1", "b"), ("filtered-2", "c")];
        // Without a blur it is the error itself.
        let mut left: Vec<(f64, Estimate)> = r.filtered.iter().map(|f| (f.sigma, f.rmse)).collect();
        if left.is_empty() {
            return Vec::new();
        }
        if left.iter().all(|(sigma, _)| *sigma != 0.0) {
            left.insert(0, (0.0, r.covered.rmse));
        }
        let each = left.iter().zip(styles).map(|((sigma, rmse), (measure, class))| {
            let says = format!("{}\nafter {sigma} px: {}", r.design, estimated(*rmse));
            dot(*rmse, measure, class, says)
        });
        each.collect()
    };
    let chart = Rows {
        title: format!("Error after a blur on {scene}"),
        axis: "RMSE, 8-bit units".into(),
        kind: Kind::Linear,
        together: true,
        rows: rows(content, scene, bars),
    };
    chart.draw().unwrap_or_else(|| nothing("Errors after a blur were not measured here."))
}

fn flicker(content: &Content<'_>, scene: &str) -> Markup {
    let row = |series: &String| -> Vec<Cell> {
        let mut cells = vec![Cell::Text(content.named(series))];
        let record = content.at_count(scene, series);
        match record.and_then(|r| r.covered.temporal) {
            Some(t) => {
                let each = [t.deviation_median, t.deviation_p95, t.deviation_max];
                cells.extend(each.map(|v| Cell::Number(v, fixed(v, 2))));
            }
            None => {
                let why = match record {
                    None => "no result",
                    Some(r) if r.promises.seeded => "one seed",
                    Some(_) => "the same for every seed",
                };
                cells.extend((0..3).map(|_| Cell::Missing(why.into())));
            }
        }
        cells
    };
    let rows: Vec<_> = content.designs().iter().map(row).collect();
    table(&["design", "median", "95 %", "most"], &rows)
}

/// Every so many bins of a spectrum have a marker.
const MARK_EVERY: usize = 6;

fn spectrum(content: &Content<'_>, scene: &str) -> Markup {
    let curve = |(place, series): (usize, &String)| {
        let record = content.at_count(scene, series)?;
        let s = record.spectrum.as_ref()?;
        let bins = s.frequency.iter().zip(&s.power).enumerate().filter(|(_, (_, p))| **p > 0.0);
        let marks: Vec<Mark> = bins
            .map(|(i, (frequency, power))| Mark {
                id: Some(record.id.clone()),
                samples: None,
                cost: Spread::exactly(*frequency),
                error: Estimate::exactly(*power),
                says: format!(
                    "{series}\n{} at {} cycles per pixel",
                    figures(*power),
                    fixed(*frequency, 3)
                ),
                front: false,
                // Not all at the same frequencies, so that they do not hide each other.
                marked: i % MARK_EVERY == place % MARK_EVERY,
            })
            .collect();
        let style = content.styles.of(series);
        (!marks.is_empty()).then(|| Curve { series: series.clone(), style, facts: None, marks })
    };
    let plot = Plot {
        title: format!("Spectrum of the error on {scene}"),
        x: Axis { title: "cycles per pixel".into(), kind: Kind::Linear },
        y: Axis { title: "power, squared 8-bit units".into(), kind: Kind::Log },
        size: [860.0, 430.0],
        curves: content.designs().iter().enumerate().filter_map(curve).collect(),
        front: false,
        names: Names::Beside,
        line: None,
    };
    let has = |series: &str| plot.curves.iter().any(|c| c.series == series);
    let row = |series: &String| {
        let record = content.at_count(scene, series);
        let spectrum = record.and_then(|r| r.spectrum.as_ref());
        let why = match (record, spectrum) {
            (None, _) => "no result",
            (_, None) => "not measured",
            _ => "no error",
        };
        let blueness = Cell::estimate(spectrum.and_then(|s| s.blueness), 2, why);
        vec![Cell::Text(content.named(series)), blueness]
    };
    html! {
        @match plot.draw() {
            Some(svg) => { (svg) (content.legend(has)) },
            None => (nothing("The spectrum was not measured here.")),
        }
        details {
            summary { "Blueness" }
            (table(&["design", "blueness, dB"], &content.designs().iter().map(row).collect::<Vec<_>>()))
        }
    }
}
