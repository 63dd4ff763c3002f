//! Stochastic shadow maps: Enderton's figures 3 and 5, and all designs that tell visibility.

use crate::chart::{Axis, Curve, Kind, Mark, Names, Plot, Styles, alone};
use crate::document::{Against, Agreement, Section, Text};
use crate::results::Drawn;
use crate::results::ratios::{Holding, below, holding};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::publications::shadows::{
    FIGURE_5, LightView, SAMPLES, ShadowRow, Shadows, Slope, TAPS,
};
use screendoor_study::study::throughput::Spread;
use screendoor_trace::param::Options as _;

/// Samples of what is said of figure 5, as it has them.
const EIGHT: u32 = 8;

/// Bits of a pixel of the map within which the best is named.
const BUDGET: u32 = 512;

/// Exponents of designs that choose masks: all but coin tosses.
fn masks(s: &Shadows) -> impl Iterator<Item = &Slope> {
    s.slopes.iter().filter(|slope| slope.design != FIGURE_5[0])
}

fn figure_3_against(s: &Shadows) -> Against {
    let clouds = &s.clouds.clouds;
    let narrower = clouds.windows(2).all(|pair| pair[1].rmse < pair[0].rmse);
    // Of so many independent estimates; curves of one estimate hang together.
    let unbiased =
        clouds.iter().all(|c| c.mean.abs() <= 4.0 * c.rmse / (c.estimates as f64).sqrt());
    let between = |e: Estimate| e.high >= 0.5 && e.low <= 1.0;
    let within: Vec<bool> = masks(s).map(|slope| between(slope.exponent)).collect();
    let exponents: Vec<f64> = masks(s).map(|slope| slope.exponent.value).collect();
    let [least, most] = [f64::min, f64::max].map(|of| exponents.iter().copied().reduce(of));
    let rmse: Vec<String> = clouds.iter().map(|c| format!("{:.4}", c.rmse)).collect();
    let samples: Vec<String> = clouds.iter().map(|c| c.samples.to_string()).collect();
    Against {
        section: "Visibility by samples".to_string(),
        source: "Enderton et al. 2011, sections 3.1 and 3.2, figure 3".to_string(),
        printed: "The visibility that S samples tell converges to the true one; its error lies \
                  between O(1/√S) and O(1/S)."
            .to_string(),
        measured: format!(
            "RMSE {} at {} samples behind {} random blockers; with masks it falls as S to the power \
             of −{:.2} to −{:.2}.",
            rmse.join(", "),
            samples.join(", "),
            s.clouds.blockers.len(),
            least.unwrap_or_default(),
            most.unwrap_or_default(),
        ),
        agreement: Agreement::of(&[vec![narrower, unbiased], within.clone()].concat()),
        remark: format!(
            "Clouds {} as samples grow; their mean is {} chance; {} of {} exponents lie between \
             −1/2 and −1 within their intervals.",
            if narrower { "narrow" } else { "do not always narrow" },
            if unbiased { "off by no more than" } else { "off by more than" },
            within.iter().filter(|holds| **holds).count(),
            within.len(),
        ),
    }
}

/// The section of figure 3.
pub(super) fn figure_3(s: &Shadows) -> Option<Section> {
    let mut section = Section::answering(figure_3_against(s));
    section.paragraph(format!(
        "`enderton` draws {} layers of random depths and opacities before each of {} pixels, and is asked \
         how much light reaches a depth. 64 samples are the most that a pixel has: more are the mean of \
         several maps with other seeds, so that masks are stratified in parts of 64.",
        s.clouds.blockers.len(),
        s.clouds.clouds.first().map_or(0, |c| c.estimates),
    ));
    for (name, drawn) in figures(s) {
        let caption = match name {
            TWO => "The true visibility and two estimates of 8 samples each.",
            _ => {
                "The true visibility, and between which values nine tenths of the estimates lie: \
                 pairs of lines for 8, 32, 256 and 1024 samples, from the outermost to the innermost."
            }
        };
        section.figure(drawn.file(name), "Visibility over depth", caption);
    }
    section.paragraph(
        "The exponent p of RMSE ≈ a·S^−p, fitted over 1 to 64 samples of a pixel, with its interval \
         from the points' scatter. Where coins are tossed for each sample it is 1/2 whatever the \
         blockers; a single layer's mask has no more noise than the rounding of αS to whole samples.",
    );
    let counts = s.slopes.first().map_or(Vec::new(), |slope| slope.errors.clone());
    let counts = counts.iter().map(|(n, _)| format!("{n}"));
    let header: Vec<String> =
        ["blockers", "design", "p"].map(String::from).into_iter().chain(counts).collect();
    let rows = s.slopes.iter().map(|slope| {
        let e = slope.exponent;
        let first = [
            slope.blockers.to_string(),
            format!("`{}`", slope.design),
            format!("{:.2} [{:.2}, {:.2}]", e.value, e.low, e.high),
        ];
        first.into_iter().chain(slope.errors.iter().map(|(_, e)| format!("{e:.4}")))
    });
    section.table(header, rows);
    Some(section)
}

/// A design's row at these samples and taps.
fn row<'a>(view: &'a LightView, design: &str, samples: u32, taps: u32) -> Option<&'a ShadowRow> {
    let wanted = |r: &&ShadowRow| r.design == design && r.samples == samples && r.taps == taps;
    view.rows.iter().find(wanted)
}

/// Figure 5's three on a view.
fn three(view: &LightView, taps: u32) -> Option<[&ShadowRow; 3]> {
    let [a, b, c] = FIGURE_5.map(|design| row(view, design, EIGHT, taps));
    Some([a?, b?, c?])
}

/// What is said of figure 5, each on every view and filter.
fn figure_5_said(s: &Shadows) -> [Holding; 3] {
    let each = |rule: &dyn Fn([&ShadowRow; 3]) -> bool| {
        holding(s.scenes.iter().map(|view| {
            let found = TAPS.iter().all(|(taps, _)| three(view, *taps).is_some_and(rule));
            (view.name, found)
        }))
    };
    [
        each(&|[tosses, masks, _]| below(masks.rmse.ratio(tosses.rmse), 1.0)),
        each(&|[_, masks, corrected]| below(corrected.rmse.ratio(masks.rmse), 1.0)),
        holding(s.scenes.iter().map(|view| (view.name, view.worse > 0.0))),
    ]
}

fn figure_5_against(s: &Shadows) -> Against {
    let said = figure_5_said(s);
    let statements: Vec<bool> = said.iter().flat_map(|h| h.each.iter().copied()).collect();
    let values = |of: usize| {
        let all = s.scenes.iter().filter_map(|view| {
            let rows = three(view, 1)?;
            Some(format!("{:.3} ({})", rows[of].rmse.value / rows[0].rmse.value, view.name))
        });
        all.collect::<Vec<_>>().join(", ")
    };
    let worse = s.scenes.iter().map(|view| {
        format!("{:.0} % of those that were not right ({})", 100.0 * view.worse, view.name)
    });
    Against {
        section: "Shadow maps, stratified and corrected".to_string(),
        source: "Enderton et al. 2011, section 3.6, figure 5".to_string(),
        printed:
            "Masks have somewhat less noise than a coin toss for each sample; alpha correction \
                  fits the visibility better on average, and may be less accurate at a particular \
                  depth."
                .to_string(),
        measured: format!(
            "RMSE of visibility at {EIGHT} samples as a share of coin tosses': masks {}; corrected {}.",
            values(1),
            values(2)
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Masks have less noise {}; correction lessens the RMSE {}; it makes single \
             answers worse {}: {}.",
            said[0].words(),
            said[1].words(),
            said[2].words(),
            worse.collect::<Vec<_>>().join(", "),
        ),
    }
}

/// The section of figure 5.
pub(super) fn figure_5(s: &Shadows) -> Option<Section> {
    let mut section = Section::answering(figure_5_against(s));
    section.paragraph(format!(
        "RMSE of visibility (0 to 1) at {EIGHT} samples over {} seeds; lights' views of {} pixels. \
         Who asks are fragments of the view itself, each at its depth, a little drawn towards the \
         light. Eighths of the fragments by depth, from near to far. Filters average over 1 or 16 \
         pixels of the map, here and in the truth.",
        s.seeds,
        format_args!("{0} × {0}", s.side),
    ));
    let parts = (1..=8).map(|part| format!("{part}/8"));
    let header: Vec<String> =
        ["view", "taps", "design", "RMSE"].map(String::from).into_iter().chain(parts).collect();
    let mut rows = Vec::new();
    for view in &s.scenes {
        for (taps, _) in TAPS {
            for r in three(view, taps).into_iter().flatten() {
                let first = [
                    view.name.to_string(),
                    taps.to_string(),
                    format!("`{}`", r.design),
                    with_interval(r.rmse),
                ];
                let parts = r.by_depth.iter().map(|e| format!("{e:.3}"));
                rows.push(first.into_iter().chain(parts).collect::<Vec<String>>());
            }
        }
    }
    section.table(header, rows);
    Some(section)
}

/// A value with half of its interval; without seeds there is none.
fn with_interval(e: Estimate) -> String {
    match e.half_width() {
        half if half > 0.0 && half.is_finite() => format!("{:.4} ± {half:.4}", e.value),
        _ => format!("{:.4}", e.value),
    }
}

/// The section of all designs.
pub(super) fn designs(s: &Shadows) -> Option<Section> {
    let mut section = Section::new("Visibility by every design");
    section.paragraph(
        "A light's trace is an ordinary trace: whatever keeps depths can be asked how much light \
         reaches one. Samples count those whose depth does not lie before; layers and nodes are \
         multiplied; moments are reconstructed; `exact`, Π(1 − α) over what lies nearer, is the truth. \
         `blend`, `sorted-blend`, `wboit` and `depth-peeling` keep nothing that tells. State is of a \
         pixel of the map, without its colours; the mean error is above 0 where too much light is thought to come through.",
    );
    for view in &s.scenes {
        let mut part = Section::new(format!("Seen from the light: {}", view.name));
        part.paragraph(format!(
            "{} fragments ask; the mean of the true visibilities is {:.3}.",
            view.queries, view.truth
        ));
        if let Some((name, drawn)) = chart(view) {
            part.figure(
                drawn.file(&name),
                "Error of visibility against state",
                "RMSE of visibility against the state of a pixel, one tap; each design at 1, 4 and 8 \
                 samples.",
            );
        }
        let mut header: Vec<String> = ["design", "passes"].map(String::from).into();
        for samples in SAMPLES {
            header.push(format!("bits, {samples}"));
            header.extend(TAPS.iter().map(|(taps, _)| format!("RMSE, {samples}, {taps} taps")));
        }
        header.push("mean error, 8, 1 tap".to_string());
        let mut names: Vec<&str> = view.rows.iter().map(|r| r.design.as_str()).collect();
        names.dedup();
        let rows = names.into_iter().map(|design| {
            let of = |samples, taps| row(view, design, samples, taps);
            let passes = of(EIGHT, 1).map_or(0, |r| r.passes);
            let mut cells = vec![format!("`{design}`"), passes.to_string()];
            for samples in SAMPLES {
                cells.push(of(samples, 1).map_or("—".into(), |r| r.bits.to_string()));
                cells.extend(TAPS.iter().map(|(taps, _)| {
                    of(samples, *taps).map_or("—".into(), |r| format!("{:.4}", r.rmse.value))
                }));
            }
            cells.push(of(EIGHT, 1).map_or("—".into(), |r| format!("{:+.4}", r.mean.value)));
            cells
        });
        part.table(header, rows.collect::<Vec<_>>());
        section.parts.push(part);
    }
    Some(section)
}

/// What is told in short.
pub(super) fn in_short(s: &Shadows) -> Vec<Text> {
    let best = |view: &LightView| {
        let at = |r: &&ShadowRow| r.samples == EIGHT && r.taps == 1;
        let lk = row(view, "lk", EIGHT, 1)?;
        let least = view.rows.iter().filter(at).filter(|r| r.bits <= BUDGET);
        let least = least.min_by(|a, b| a.rmse.value.total_cmp(&b.rmse.value))?;
        Some(format!(
            "{}: `{}` {:.4} in {} bits, `lk` {:.4} in {}",
            view.name, least.design, least.rmse.value, least.bits, lk.rmse.value, lk.bits
        ))
    };
    let best: Vec<String> = s.scenes.iter().filter_map(best).collect();
    vec![
        format!(
            "**Shadow maps by every design**: RMSE of visibility at {EIGHT} samples, the least within \
             {BUDGET} bits a pixel of the map beside `lk`'s: {}.",
            best.join("; ")
        )
        .into(),
    ]
}

const TWO: &str = "visibility-two-estimates";
const CLOUDS: &str = "visibility-clouds";

/// The charts of the lights' views, by the names of their files.
pub(super) fn view_charts(s: &Shadows) -> Vec<(String, Drawn)> {
    s.scenes.iter().filter_map(chart).collect()
}

/// The charts of figure 3.
pub(super) fn figures(s: &Shadows) -> Vec<(&'static str, Drawn)> {
    let c = &s.clouds;
    let curve = |series: String, family: &str, values: Vec<f64>| {
        let style = Styles::new([(series.as_str(), family)]).of(&series);
        let marks = c.depths.iter().zip(values).map(|(depth, value)| Mark {
            id: None,
            samples: None,
            cost: Spread::exactly(*depth),
            error: Estimate::exactly(value),
            says: format!("{series}\ndepth {depth:.3}: {value:.3}"),
            front: false,
            marked: false,
        });
        Curve { marks: marks.collect(), series, style, facts: None }
    };
    let plot = |title: &str, curves: Vec<Curve>| Plot {
        title: title.to_string(),
        x: Axis { title: "depth, share of the range".to_string(), kind: Kind::Linear },
        y: Axis { title: "light that reaches it".to_string(), kind: Kind::Linear },
        size: [860.0, 420.0],
        curves,
        front: false,
        names: Names::Beside,
        line: None,
    };
    let truth = || curve("true visibility".to_string(), "reference", c.truth.clone());
    let two = c.two.iter().enumerate().map(|(i, values)| {
        let family = ["stochastic", "layered"][i];
        curve(format!("8 samples, estimate {}", i + 1), family, values.clone())
    });
    let mut bands = vec![truth()];
    for (cloud, family) in c.clouds.iter().zip(["stochastic", "layered", "blended", "other"]) {
        for (edge, name) in ["5 %", "95 %"].into_iter().enumerate() {
            let values = cloud.between.iter().map(|band| band[edge]).collect();
            bands.push(curve(format!("{} samples, {name}", cloud.samples), family, values));
        }
    }
    let two: Vec<Curve> = std::iter::once(truth()).chain(two).collect();
    [(TWO, "True visibility and two estimates", two), (CLOUDS, "Clouds of estimates", bands)]
        .into_iter()
        .filter_map(|(name, title, curves)| {
            Some((name, Drawn::Chart(alone(&plot(title, curves).draw()?))))
        })
        .collect()
}

/// Error against state on a light's view.
fn chart(view: &LightView) -> Option<(String, Drawn)> {
    let mut names: Vec<(&str, &str)> =
        view.rows.iter().map(|r| (r.design.as_str(), r.family.name())).collect();
    names.dedup();
    let styles = Styles::new(names.iter().copied());
    let curves = names.iter().map(|(design, _)| Curve {
        series: (*design).to_string(),
        style: styles.of(design),
        facts: None,
        marks: SAMPLES
            .iter()
            .filter_map(|samples| row(view, design, *samples, 1))
            .map(|r| Mark {
                id: None,
                samples: Some(r.samples),
                cost: Spread::exactly(f64::from(r.bits)),
                error: r.rmse,
                says: format!(
                    "{design}\n{} samples, {} bits: RMSE {:.4}",
                    r.samples, r.bits, r.rmse.value
                ),
                front: false,
                marked: true,
            })
            .collect(),
    });
    let plot = Plot {
        title: format!("Error of visibility against state, {}", view.name),
        x: Axis {
            title: "state without colours, bits a pixel of the map".to_string(),
            kind: Kind::Log2,
        },
        y: Axis { title: "RMSE of visibility, lower is better".to_string(), kind: Kind::Log },
        size: [860.0, 520.0],
        curves: curves.collect(),
        front: false,
        names: Names::Beside,
        line: None,
    };
    let chart = plot.draw()?;
    Some((format!("visibility-{}", view.name), Drawn::Chart(alone(&chart))))
}
