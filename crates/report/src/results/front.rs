//! Error against state of what needs one pass in any order: the Pareto front without this
//! project's own designs and with them.

use crate::chart::{Axis, Curve, Kind, Mark, Names, Plot, Styles, alone};
use crate::document::Section;
use crate::results::Drawn;
use crate::results::ratios::OnScenes;
use screendoor_study::metrics::Estimate;
use screendoor_study::study::analysis::{ROUNDING, front};
use screendoor_study::study::comparison::{COUNTS, Comparison, Contender};
use screendoor_study::study::publications::experiment::MeasuredScene;
use screendoor_study::study::record::Record;
use screendoor_study::study::throughput::Spread;

/// What errors are held against: a design and its samples.
const BASELINE: (&str, u32) = ("lk", 8);
/// The designs without which there is a front, too.
const OWN: [&str; 2] = ["residual", "merging"];
/// The chart's file, without its ending.
const CHART: &str = "one-pass-front";

/// A design at a sample count over all scenes.
struct Point<'a> {
    contender: &'a Contender,
    family: &'a str,
    samples: u32,
    /// On the scene that takes most.
    bytes: f64,
    error: f64,
    unbiased: bool,
    own: bool,
}

impl Point<'_> {
    fn says(&self) -> String {
        format!("`{}` {}: {:.3}", self.contender.label, self.samples, self.error)
    }
}

/// All that read the trace once, whatever its order, and whose state does not grow.
fn points(c: &Comparison) -> Vec<Point<'_>> {
    let Some(baseline) = c.contender(BASELINE.0) else { return Vec::new() };
    let rmse = |r: &Record| r.covered.rmse.value.max(ROUNDING);
    let point = |contender: &'_ Contender, samples: u32| {
        let each = c.scenes.iter().map(|s| s.record(&contender.series, samples));
        let records: Vec<&Record> = each.collect::<Option<_>>()?;
        let bytes: Vec<f64> = records.iter().map(|r| r.state_bytes()).collect::<Option<_>>()?;
        if records.iter().any(|r| r.passes != 1) || contender.sorted_by_application {
            return None;
        }
        let ratio = |(s, r): (&MeasuredScene, &&Record)| {
            let to = s.record(&baseline.series, BASELINE.1)?;
            let value = rmse(r) / rmse(to);
            Some((s.name.clone(), Estimate { value, low: value, high: value }))
        };
        let ratios: Option<Vec<_>> = c.scenes.iter().zip(&records).map(ratio).collect();
        Some((records, bytes.into_iter().fold(0.0, f64::max), OnScenes(ratios?).mean()))
    };
    let mut list = Vec::new();
    for contender in &c.contenders {
        for samples in COUNTS {
            let Some((records, bytes, error)) = point(contender, samples) else { continue };
            let name = contender.label.split(':').next().unwrap_or_default();
            list.push(Point {
                contender,
                family: records.first().map_or("", |r| r.family.as_str()),
                samples,
                bytes,
                error,
                unbiased: records.iter().all(|r| r.kept().unbiased),
                own: OWN.contains(&name),
            });
        }
    }
    list
}

/// Those that nothing among them has less of one of and no more of the other.
fn best<'p, 'a>(points: impl Iterator<Item = &'p Point<'a>>) -> Vec<&'p Point<'a>> {
    let points: Vec<&Point<'_>> = points.collect();
    let pairs: Vec<(f64, f64)> = points.iter().map(|p| (p.bytes, p.error)).collect();
    let on = front(&pairs).into_iter();
    let mut best: Vec<&Point<'_>> =
        points.into_iter().zip(on).filter_map(|(p, on)| on.then_some(p)).collect();
    best.sort_by(|a, b| a.bytes.total_cmp(&b.bytes));
    best
}

/// The best within so many bytes.
fn within<'p, 'a>(front: &[&'p Point<'a>], bytes: f64) -> Option<&'p Point<'a>> {
    front.iter().rfind(|p| p.bytes <= bytes).copied()
}

/// The section; nothing of it where the baseline lacks.
pub(super) fn section(c: &Comparison) -> Section {
    let mut part = Section::new("The Pareto front of one pass in any order");
    let points = points(c);
    part.paragraph(format!(
        "Designs that read the trace once, in any order of fragments, with a state that does not grow: \
         the least error within so many bytes per pixel, without {} and with them. Errors are the \
         geometric mean over the {} scenes of RMSE as a share of that of `{}` at {} samples; an RMSE below \
         {ROUNDING:.2}, which no 8-bit picture shows, counts as that.",
        OWN.map(|name| format!("`{name}`")).join(" and "),
        c.scenes.len(),
        BASELINE.0,
        BASELINE.1
    ));
    if let Some((name, drawn)) = figures(c).first() {
        part.figure(
            drawn.file(name),
            "Error against state of designs of one pass, and the Pareto front",
            "Error against state of the designs that are on either front; the step line is the front with \
             all of them.",
        );
    }
    for (which, all) in [("any", true), ("unbiased on all scenes", false)] {
        let shown = || points.iter().filter(|p| all || p.unbiased);
        let [before, after] = [best(shown().filter(|p| !p.own)), best(shown())];
        let mut sizes: Vec<f64> = before.iter().chain(&after).map(|p| p.bytes).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.dedup();
        let rows = sizes.into_iter().map(|bytes| {
            let [a, b] = [within(&before, bytes), within(&after, bytes)];
            let says = |p: Option<&Point<'_>>| p.map_or("—".to_string(), Point::says);
            let gain =
                a.zip(b).map_or("—".to_string(), |(a, b)| format!("{:.2}", b.error / a.error));
            [format!("{bytes:.0}"), says(a), says(b), gain]
        });
        let mut table = Section::new(format!("Designs: {which}"));
        table.table(["bytes", "without", "with", "with ÷ without"], rows);
        part.parts.push(table);
    }
    part
}

/// The chart; none without results.
pub(super) fn figures(c: &Comparison) -> Vec<(&'static str, Drawn)> {
    let points = points(c);
    let fronts = [best(points.iter().filter(|p| !p.own)), best(points.iter())];
    let is_shown = |p: &Point<'_>| fronts.iter().flatten().any(|on| on.contender == p.contender);
    let shown: Vec<&Contender> = {
        let mut list: Vec<&Contender> = Vec::new();
        for p in points.iter().filter(|p| is_shown(p) || p.contender.label == BASELINE.0) {
            if !list.contains(&p.contender) {
                list.push(p.contender);
            }
        }
        list
    };
    let family = |contender: &Contender| {
        points.iter().find(|p| p.contender == contender).map_or("", |p| p.family)
    };
    let styles = Styles::new(shown.iter().map(|c| (c.label.as_str(), family(c))));
    let [_, after] = &fronts;
    let curves = shown.iter().map(|contender| Curve {
        series: contender.label.clone(),
        style: styles.of(&contender.label),
        facts: None,
        marks: points
            .iter()
            .filter(|p| p.contender == *contender)
            .map(|p| Mark {
                id: None,
                samples: Some(p.samples),
                cost: Spread { low: p.bytes, median: p.bytes, high: p.bytes },
                error: Estimate { value: p.error, low: p.error, high: p.error },
                says: format!(
                    "{} at {}\n{:.0} bytes, {:.3}",
                    contender.label, p.samples, p.bytes, p.error
                ),
                front: after.iter().any(|on| std::ptr::eq(*on, p)),
                marked: true,
            })
            .collect(),
    });
    let plot = Plot {
        title: "Error against state of designs of one pass".to_string(),
        x: Axis { title: "state, bytes per pixel".to_string(), kind: Kind::Log2 },
        y: Axis {
            title: format!("error relative to {} at {}", BASELINE.0, BASELINE.1),
            kind: Kind::Log,
        },
        size: [860.0, 520.0],
        curves: curves.collect(),
        front: true,
        names: Names::At(8),
        line: Some(1.0),
    };
    plot.draw().map(|chart| (CHART, Drawn::Chart(alone(&chart)))).into_iter().collect()
}
