//! What designs that drew a light's view found of the light that reaches a camera's fragments, on
//! the scenes of a study that have shadows.

use crate::chart::{Axis, Curve, Kind, Mark, Names, Plot, Styles};
use crate::document::{Section, Text, code};
use crate::html::words::{counted, grouped};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::results::{Results, ShadowFacts};
use screendoor_study::study::throughput::Spread;

/// A light on what a camera sees, and all that was tried to find its shadows.
pub(crate) struct LitView<'a> {
    /// What tells it from others.
    pub title: String,
    /// The scenes of the study, in its order.
    pub tried: Vec<(&'a str, &'a ShadowFacts)>,
}

/// The lights of a study, in its order.
pub(crate) fn views(results: &Results) -> Vec<LitView<'_>> {
    let mut views: Vec<LitView<'_>> = Vec::new();
    for scene in &results.scenes {
        let Some(facts) = &scene.shadow else { continue };
        let is_same = |view: &&mut LitView<'_>| {
            view.tried.iter().any(|(_, f)| (&f.camera, &f.light) == (&facts.camera, &facts.light))
        };
        match views.iter_mut().find(is_same) {
            Some(view) => view.tried.push((&scene.name, facts)),
            None => {
                let [width, height] = facts.size;
                let title = format!("{}, a map of {width} × {height}", facts.source);
                views.push(LitView { title, tried: vec![(&scene.name, facts)] });
            }
        }
    }
    views
}

/// What is said before the figures.
pub(crate) const INTRODUCTION: &str = "How much of a light reaches the fragments that a camera sees: the light's view was drawn by a \
     design, and each fragment that has something of that light was compared with it. Errors are of \
     visibility, 0 to 1, against the exact one over the same places of the map; the mean error is above 0 where \
     too much light is thought to come through. State is of a pixel of the light's map, without its colours.";

/// The section of documents; `None` where no scene has shadows.
pub(crate) fn section(results: &Results) -> Option<Section> {
    let views = views(results);
    if views.is_empty() {
        return None;
    }
    let mut section = Section::new("Visibility");
    section.paragraph(INTRODUCTION);
    for view in &views {
        let mut part = Section::new(Text::plain(&view.title));
        part.paragraph(asked(view));
        part.table(HEADER.map(Text::plain), rows(view));
        part.paragraph("RMSE by the fragments' depth, in eighths of the light's depth range:");
        let (header, rows) = by_depth(view);
        part.table(header, rows);
        section.parts.push(part);
    }
    Some(section)
}

/// How many fragments asked, and what is true on average.
pub(crate) fn asked(view: &LitView<'_>) -> String {
    let error = &view.tried[0].1.error;
    format!(
        "{} fragments ask; the mean of the true visibilities is {:.3}.",
        grouped(error.queries),
        error.truth
    )
}

/// The columns of [`rows`].
pub(crate) const HEADER: [&str; 9] = [
    "scene",
    "the light's design",
    "samples",
    "taps",
    "bits a pixel",
    "passes",
    "RMSE",
    "mean error",
    "greatest",
];

/// Everything that was tried.
pub(crate) fn rows(view: &LitView<'_>) -> Vec<[Text; 9]> {
    let row = |(scene, f): &(&str, &ShadowFacts)| {
        [
            Text::plain(*scene),
            code(&drawn(f, &f.design)).into(),
            f.samples.to_string().into(),
            f.pcf.to_string().into(),
            f.cost.state_bits.map_or("grows".into(), |bits| grouped(bits.into()).into()),
            f.cost.passes.to_string().into(),
            format!("{:.4}", f.error.rmse).into(),
            format!("{:+.4}", f.error.mean).into(),
            format!("{:.3}", f.error.max).into(),
        ]
    };
    view.tried.iter().map(row).collect()
}

/// Errors by depth: columns and rows. What nobody asked for has none.
pub(crate) fn by_depth(view: &LitView<'_>) -> (Vec<Text>, Vec<Vec<Text>>) {
    let mut parts: Vec<[f64; 2]> = Vec::new();
    for (_, facts) in &view.tried {
        for part in &facts.error.by_depth {
            if !parts.contains(&[part.from, part.to]) {
                parts.push([part.from, part.to]);
            }
        }
    }
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let header = std::iter::once("scene".into())
        .chain(parts.iter().map(|[from, to]| Text::plain(format!("{from:.3} to {to:.3}"))));
    let row = |(scene, facts): &(&str, &ShadowFacts)| {
        let at = |part: &[f64; 2]| {
            let found = facts.error.by_depth.iter().find(|d| [d.from, d.to] == *part);
            found.map_or("—".into(), |d| Text::plain(format!("{:.4}", d.rmse)))
        };
        std::iter::once(Text::plain(*scene)).chain(parts.iter().map(at)).collect()
    };
    (header.collect(), view.tried.iter().map(row).collect())
}

/// What drew the light's view, by one of its names, and how often.
fn drawn(facts: &ShadowFacts, name: &str) -> String {
    match facts.rounds {
        1 => name.to_string(),
        rounds => format!("{name}, {}", counted(rounds as usize, "round")),
    }
}

/// The chart of error against state: a curve for each design and number of taps, its points by
/// samples.
pub(crate) fn chart(view: &LitView<'_>) -> Plot {
    let series = |f: &ShadowFacts| match (drawn(f, &f.series), f.pcf) {
        (name, 1) => name,
        (name, taps) => format!("{name}, {taps} taps"),
    };
    let mut curves: Vec<(String, String, Vec<Mark>)> = Vec::new();
    for (_, facts) in &view.tried {
        // What has no bound has no place along.
        let Some(bits) = facts.cost.state_bits else { continue };
        let name = series(facts);
        let error = facts.error.rmse;
        let mark = Mark {
            id: None,
            samples: Some(facts.samples),
            cost: Spread::exactly(f64::from(bits)),
            error: Estimate::exactly(error),
            says: format!(
                "{name}\n{}, {bits} bits: RMSE {error:.4}",
                counted(facts.samples as usize, "sample")
            ),
            front: false,
            marked: true,
        };
        match curves.iter_mut().find(|(known, ..)| *known == name) {
            Some((.., marks)) => marks.push(mark),
            None => curves.push((name, facts.family.clone(), vec![mark])),
        }
    }
    let styles = Styles::new(curves.iter().map(|(name, family, _)| (&**name, &**family)));
    Plot {
        title: format!("Error of visibility against state, {}", view.title),
        x: Axis {
            title: "state without colours, bits a pixel of the map".into(),
            kind: Kind::Log2,
        },
        y: Axis { title: "RMSE of visibility, lower is better".into(), kind: Kind::Log },
        size: [860.0, 480.0],
        curves: curves
            .into_iter()
            .map(|(series, _, mut marks)| {
                marks.sort_by_key(|mark| mark.samples);
                Curve { style: styles.of(&series), series, facts: None, marks }
            })
            .collect(),
        front: false,
        names: Names::Beside,
        line: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::study::analysis::made_up::plausible;
    use screendoor_study::study::shadows::{DepthError, ShadowCost, VisibilityError};

    fn facts(light: &str, pcf: u32, samples: u32, state_bits: Option<u32>) -> ShadowFacts {
        let part =
            |from: f64| DepthError { from, to: from + 0.125, queries: 10, rmse: 0.25, mean: 0.0 };
        ShadowFacts {
            source: "builtin:engine, light key".into(),
            camera: "c".into(),
            light: light.into(),
            size: [96, 80],
            series: "lk".into(),
            design: "lk".into(),
            family: "stochastic".into(),
            samples,
            rounds: 1,
            pcf,
            cost: ShadowCost { state_bits, passes: 1 },
            error: VisibilityError {
                queries: 20,
                rmse: 0.25 / f64::from(samples),
                mean: -0.01,
                max: 0.9,
                truth: 0.5,
                by_depth: vec![part(0.125 * f64::from(samples)), part(0.5)],
            },
        }
    }

    #[test]
    fn scenes_of_one_light_stand_together_and_designs_have_a_curve_for_each_number_of_taps() {
        let mut results = plausible(6, 2, &[8]);
        assert!(section(&results).is_none());
        let all = [
            facts("a", 1, 2, Some(96)),
            facts("a", 1, 1, Some(64)),
            facts("b", 1, 1, Some(64)),
            facts("a", 4, 1, Some(64)),
            facts("a", 1, 1, None),
        ];
        for (scene, facts) in results.scenes.iter_mut().zip(all) {
            scene.shadow = Some(facts);
        }
        let found = views(&results);
        let names = |view: &LitView<'_>| -> Vec<String> {
            view.tried.iter().map(|(name, _)| (*name).to_string()).collect()
        };
        let scene = |i: usize| results.scenes[i].name.clone();
        assert_eq!(found.len(), 2);
        assert_eq!(names(&found[0]), [scene(0), scene(1), scene(3), scene(4)]);
        assert_eq!(names(&found[1]), [scene(2)]);
        let plot = chart(&found[0]);
        let points: Vec<_> =
            plot.curves.iter().map(|c| (c.series.as_str(), c.marks.len())).collect();
        assert_eq!(points, [("lk", 2), ("lk, 4 taps", 1)]);
        assert_eq!(plot.curves[0].marks[0].samples, Some(1), "by samples");
        let (header, rows) = by_depth(&found[0]);
        let header: Vec<String> = header.iter().map(Text::words).collect();
        assert_eq!(header, ["scene", "0.125 to 0.250", "0.250 to 0.375", "0.500 to 0.625"]);
        let rows: Vec<Vec<String>> =
            rows.iter().map(|row| row.iter().map(Text::words).collect()).collect();
        assert_eq!(rows[0], [&*scene(0), "—", "0.2500", "0.2500"]);
        let text = section(&results).unwrap().to_markdown(2, ".");
        assert!(text.contains("| `lk` | 1 | 1 | grows | 1 | 0.2500 | -0.0100 | 0.900 |"), "{text}");
    }
}
