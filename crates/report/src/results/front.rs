//! Error against state of what needs one pass in any order: the Pareto front without this
//! project's own designs and with them.

use crate::chart::{Axis, Curve, Kind, Mark, Names, Plot, Styles, alone};
use crate::document::Section;
use crate::results::Drawn;
use screendoor_study::metrics::Estimate;
use screendoor_study::study::analysis::{ROUNDING, front, shares};
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

/// The scenes on which no design needs a pass more than elsewhere: what keeps layers or blends
/// draws opaque geometry first, in a pass of its own, where there is any.
fn without_opaque<'a>(
    contenders: &[Contender],
    scenes: &'a [MeasuredScene],
) -> Vec<&'a MeasuredScene> {
    let passes = |contender: &Contender, scene: &MeasuredScene| {
        let of = |samples| scene.record(&contender.series, samples).map(|r| r.passes);
        COUNTS.into_iter().find_map(of)
    };
    let least: Vec<Option<u32>> =
        contenders.iter().map(|c| scenes.iter().filter_map(|s| passes(c, s)).min()).collect();
    let usual = |scene: &&MeasuredScene| {
        contenders.iter().zip(&least).all(|(c, least)| passes(c, scene) == *least)
    };
    scenes.iter().filter(usual).collect()
}

/// All that read the trace once, whatever its order, and whose state does not grow.
fn points<'a>(contenders: &'a [Contender], scenes: &[&'a MeasuredScene]) -> Vec<Point<'a>> {
    let baseline = contenders.iter().find(|c| c.label == BASELINE.0);
    let to = |s: &&'a MeasuredScene| s.record(&baseline?.series, BASELINE.1);
    let Some(to) = scenes.iter().map(to).collect::<Option<Vec<&Record>>>() else {
        return Vec::new();
    };
    let point = |contender: &'a Contender, samples: u32| {
        let each = scenes.iter().map(|scene| scene.record(&contender.series, samples));
        let records = each.collect::<Option<Vec<&Record>>>()?;
        if contender.sorted_by_application || records.iter().any(|r| r.passes != 1) {
            return None;
        }
        let bytes = records.iter().map(|r| r.state_bytes()).collect::<Option<Vec<f64>>>()?;
        let pairs: Vec<(&Record, &Record)> =
            records.iter().copied().zip(to.iter().copied()).collect();
        Some(Point {
            contender,
            family: records.first()?.family.as_str(),
            samples,
            bytes: bytes.into_iter().fold(0.0, f64::max),
            error: shares(&pairs).value,
            unbiased: records.iter().all(|r| r.kept().unbiased),
            own: contender.label.split(':').next().is_some_and(|name| OWN.contains(&name)),
        })
    };
    let runs = contenders.iter().flat_map(|c| COUNTS.map(|samples| (c, samples)));
    runs.filter_map(|(contender, samples)| point(contender, samples)).collect()
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
    let scenes = without_opaque(&c.contenders, &c.scenes);
    let points = points(&c.contenders, &scenes);
    part.paragraph(format!(
        "Designs that read the trace once, in any order of fragments, with a state that does not grow: \
         the least error within so many bytes per pixel, without {} and with them. Errors are the \
         geometric mean over {} of RMSE as a share of that of `{}` at {} samples; an RMSE below \
         {ROUNDING:.2}, which no 8-bit picture shows, counts as that. Where a scene has opaque geometry, \
         what keeps layers or blends draws that first, in a pass of its own: such scenes are left out.",
        OWN.map(|name| format!("`{name}`")).join(" and "),
        scenes.iter().map(|s| format!("`{}`", s.name)).collect::<Vec<_>>().join(", "),
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
            let gain = a.zip(b).filter(|(a, _)| a.error > 0.0);
            let gain = gain.map_or("—".to_string(), |(a, b)| format!("{:.2}", b.error / a.error));
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
    let points = points(&c.contenders, &without_opaque(&c.contenders, &c.scenes));
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
                cost: Spread::exactly(p.bytes),
                error: Estimate::exactly(p.error),
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

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::study::analysis::made_up;

    #[test]
    fn a_front_has_who_is_best_for_its_size_and_changes_with_what_is_new() {
        let contender = |label: &str| Contender {
            label: label.to_string(),
            series: label.to_string(),
            sorted_by_application: label == "sorted-blend",
        };
        let names = ["lk", "mlab", "merging", "mboit", "sorted-blend"];
        let contenders = names.map(contender);
        // Errors at 8 samples; at 4 twice as much.
        let errors = [8.0, 4.0, 1.0, 0.5, 0.5];
        let record = |(name, error): (&&str, &f64), samples: u32| {
            let error = error * 8.0 / f64::from(samples);
            let mut record = made_up::record("a", name, samples, Estimate::exactly(error));
            (record.state_bits.samples, record.state_bits.extra) = (64 * samples, 0);
            record.state_bits.unbounded = false;
            record.passes = if *name == "mboit" { 2 } else { 1 };
            record
        };
        let counts = |pair| [4, 8].map(|samples| record(pair, samples));
        let records = names.iter().zip(&errors).flat_map(counts).collect();
        // With opaque geometry one of them needs a pass for it.
        let other = names.iter().zip(&errors).flat_map(|pair| {
            let opaque = u32::from(*pair.0 == "mlab");
            counts(pair).map(|r| Record { passes: r.passes + opaque, ..r })
        });
        let scenes = [made_up::scene("a", records), made_up::scene("b", other.collect())];
        let scenes = without_opaque(&contenders, &scenes);
        assert_eq!(scenes.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["a"]);
        let points = points(&contenders, &scenes);
        let said = |list: Vec<&Point<'_>>| list.iter().map(|p| p.says()).collect::<Vec<_>>();
        assert_eq!(points.len(), 6);
        let before = best(points.iter().filter(|p| !p.own));
        assert_eq!(said(before), ["`mlab` 4: 1.000", "`mlab` 8: 0.500"]);
        assert_eq!(said(best(points.iter())), ["`merging` 4: 0.250", "`merging` 8: 0.125"]);
    }
}
