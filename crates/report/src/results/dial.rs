//! SLAB's dial from noise to bias.

use crate::chart::{Axis, Curve, Kind, Mark, Names, Plot, Styles, alone};
use crate::document::{Against, Agreement, Section};
use crate::results::Drawn;
use crate::results::claims::{RMSE, SAME, frames, ratios};
use crate::results::ratios::{Holding, holding};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::comparison::SLAB_LAYERS;
use screendoor_study::study::publications::claims::{DIAL, DISCRETE, ENDS, Trial, dialled};
use screendoor_study::study::publications::experiment::MeasuredScene;
use screendoor_study::study::throughput::Spread;

/// Errors below this, in 8-bit units, are rounding.
const ROUNDING: f64 = 0.01;

/// Noise and bias of a variant in 8-bit units: the roots of the mean variance over seeds
/// and of the pixels' mean squared mean errors.
fn split(scene: &MeasuredScene, design: &str) -> Option<[f64; 2]> {
    let e = &scene.variant(design)?.covered;
    // A design without seeds has its whole error as bias.
    let variance = e.variance.unwrap_or(0.0);
    let bias = e.bias_squared.map_or(e.rmse.value * e.rmse.value, |b| b.value);
    Some([variance, bias].map(|square| square.max(0.0).sqrt()))
}

/// Noise and bias along the dial.
fn along(scene: &MeasuredScene) -> Vec<[f64; 2]> {
    DIAL.into_iter().filter_map(|bits| split(scene, &dialled(bits))).collect()
}

/// Whether a part of the error goes one way from each place of the dial to the next, but
/// for chance.
fn goes(values: &[[f64; 2]], part: usize, up: bool) -> bool {
    values.windows(2).all(|pair| {
        let [a, b] = if up { [pair[0], pair[1]] } else { [pair[1], pair[0]] }.map(|v| v[part]);
        b >= a * (1.0 - SAME) - ROUNDING
    })
}

/// What is said of the dial, each on every scene.
struct Said {
    less_noise: Holding,
    more_bias: Holding,
    kbuffer: Holding,
    stochastic: Holding,
}

fn said(trial: &Trial) -> Said {
    let each = |of: &dyn Fn(&MeasuredScene) -> bool| {
        holding(trial.scenes.iter().map(|scene| (scene.name.as_str(), of(scene))))
    };
    let [stochastic, kbuffer] = ENDS;
    let same_error = |scene: &MeasuredScene| {
        let pair = scene.variant(&dialled(0)).zip(scene.variant(kbuffer));
        pair.is_some_and(|(a, b)| {
            let blocks = [a, b].map(|v| v.blocks.map(|e| e.value));
            a.covered.rmse.value == b.covered.rmse.value && blocks[0] == blocks[1]
        })
    };
    let ends = ratios(trial, RMSE, [DISCRETE, stochastic]);
    Said {
        less_noise: each(&|scene| goes(&along(scene), 0, false)),
        more_bias: each(&|scene| goes(&along(scene), 1, true)),
        kbuffer: each(&same_error),
        stochastic: ends.holding(|e| e.low <= 1.0 + SAME && e.high >= 1.0 - SAME),
    }
}

/// The dial beside what is measured.
fn against(trial: &Trial) -> Against {
    let said = said(trial);
    let all = [&said.less_noise, &said.more_bias, &said.kbuffer, &said.stochastic];
    let statements: Vec<bool> = all.iter().flat_map(|h| h.each.iter().copied()).collect();
    // Root mean squares over the scenes, at both ends of the dial.
    let mean = |bits: u32, part: usize| {
        let parts = trial.scenes.iter().filter_map(|s| split(s, &dialled(bits)).map(|v| v[part]));
        let squares: Vec<f64> = parts.map(|v| v * v).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    };
    let [first, .., last] = DIAL;
    Against {
        section: "SLAB's dial".to_string(),
        source: "Wyman 2016, abstract and section 2.1".to_string(),
        printed: "The number of coverage bits b trades noise for bias: from n, the number of \
                  layers, where SLAB is stochastic transparency, to infinity, where it is the \
                  k-buffer."
            .to_string(),
        measured: format!(
            "With {SLAB_LAYERS} layers and b from {first} to infinity the noise goes from {:.2} to \
             {:.2}, the bias from {:.2} to {:.2} (root mean squares over {} scenes).",
            mean(first, 0),
            mean(last, 0),
            mean(first, 1),
            mean(last, 1),
            trial.scenes.len()
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Noise falls with every step of b {}; bias grows with every step {}; without bound it \
             is `kbuffer` {}; with b = n, bits for opacity and hidden layers removed, the RMSE is \
             that of stochastic transparency {}.",
            said.less_noise.words(),
            said.more_bias.words(),
            said.kbuffer.words(),
            said.stochastic.words()
        ),
    }
}

/// The chart's file, without its ending.
const CHART: &str = "slab-dial";
/// Families of designs whose colours scenes have here.
const COLOURS: [&str; 4] = ["stochastic", "layered", "blended", "reference"];

/// The dial as curves, one of each scene; none without results.
pub(super) fn figures(trial: &Trial) -> Vec<(&'static str, Drawn)> {
    let scenes = trial.scenes.iter().zip(COLOURS.iter().cycle());
    let styles = Styles::new(scenes.map(|(scene, colour)| (scene.name.as_str(), *colour)));
    let curves = trial.scenes.iter().map(|scene| Curve {
        series: scene.name.clone(),
        style: styles.of(&scene.name),
        facts: None,
        marks: DIAL
            .iter()
            .filter_map(|bits| {
                let [noise, bias] = split(scene, &dialled(*bits))?;
                Some(Mark {
                    id: None,
                    samples: Some(*bits),
                    cost: Spread::exactly(noise),
                    error: Estimate::exactly(bias),
                    says: format!(
                        "{}, {}\nnoise {noise:.2}, bias {bias:.2}",
                        scene.name,
                        place(*bits)
                    ),
                    front: false,
                    marked: true,
                })
            })
            .collect(),
    });
    let plot = Plot {
        title: "Noise and bias of SLAB as its coverage bits grow, scene by scene".to_string(),
        x: Axis { title: "noise, 8-bit units".to_string(), kind: Kind::Log },
        y: Axis { title: "bias, 8-bit units".to_string(), kind: Kind::Log },
        size: [860.0, 480.0],
        curves: curves.collect(),
        front: false,
        names: Names::At(DIAL[0]),
        line: None,
    };
    plot.draw().map(|chart| (CHART, Drawn::Chart(alone(&chart)))).into_iter().collect()
}

fn place(bits: u32) -> String {
    if bits == 0 { "b = ∞".to_string() } else { format!("b = {bits}") }
}

/// The section.
pub(super) fn section(trial: &Trial) -> Section {
    let mut section = Section::answering(against(trial));
    section.paragraph(format!(
        "RMSE over the covered pixels, in brackets its noise and its bias: the roots of the mean \
         variance over seeds, and of the mean square of the pixels' mean errors. `slab` with \
         `normalise=none` and continuous opacity along the dial; {}. Beside it b = {SLAB_LAYERS} with \
         discrete opacity (`{DISCRETE}`), and what the ends are said to be: `{}` and `{}`.",
        frames(trial),
        ENDS[0],
        ENDS[1]
    ));
    let mut columns: Vec<(String, String)> =
        DIAL.iter().map(|bits| (place(*bits), dialled(*bits))).collect();
    columns.insert(0, ("b = n, discrete".to_string(), DISCRETE.to_string()));
    columns.insert(0, ("stochastic".to_string(), ENDS[0].to_string()));
    columns.push(("k-buffer".to_string(), ENDS[1].to_string()));
    let cell = |scene: &MeasuredScene, design: &str| {
        let parts = scene.variant(design).zip(split(scene, design));
        parts.map_or("—".to_string(), |(v, [noise, bias])| {
            format!("{:.2} ({noise:.2}, {bias:.2})", v.covered.rmse.value)
        })
    };
    let rows = trial.scenes.iter().map(|scene| {
        let cells = columns.iter().map(|(_, design)| cell(scene, design));
        std::iter::once(scene.name.clone()).chain(cells)
    });
    let names = columns.iter().map(|(name, _)| name.as_str());
    section.table(std::iter::once("scene").chain(names), rows);
    for (name, figure) in figures(trial) {
        let caption = format!(
            "Bias over noise along the dial: each curve is a scene, each mark a place, from b = {} \
             at its name to infinity, where no noise is left.",
            DIAL[0]
        );
        section.figure(figure.file(name), "Curves of bias over noise.", caption);
    }
    section
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::claims::tests::variant;
    use screendoor_study::study::analysis::made_up;

    /// A scene with noise and bias along the dial, its ends as given.
    fn scene(
        name: &'static str,
        of: impl Fn(usize) -> [f64; 2],
        [stochastic, kbuffer]: [f64; 2],
    ) -> MeasuredScene {
        let made = |design: &str, noise: f64, bias: f64| {
            let mut v = variant(design, noise.hypot(bias), 1.0, 0.0);
            v.covered.variance = Some(noise * noise);
            v.covered.bias_squared = Some(Estimate::of(&[bias * bias]));
            v
        };
        let dial = DIAL.iter().enumerate().map(|(i, bits)| {
            let [noise, bias] = of(i);
            made(&dialled(*bits), noise, bias)
        });
        let ends = [made(DISCRETE, 9.0, 0.0), made(ENDS[0], stochastic, 0.0)];
        let variants = dial.chain(ends).chain([made(ENDS[1], 0.0, kbuffer)]).collect();
        made_up::scene(name, variants)
    }

    fn verdict(scenes: Vec<MeasuredScene>) -> Against {
        against(&Trial { samples: 8, side: 64, seeds: 4, antialiased: false, scenes })
    }

    #[test]
    fn the_dial_is_confirmed_where_noise_becomes_bias_between_its_ends() {
        let right = |name| scene(name, |i| [6.0 - i as f64, i as f64], [9.0, 6.0]);
        let found = verdict(vec![right("a"), right("b")]);
        assert_eq!(found.agreement, Agreement::Confirmed, "{}", found.remark);
        assert!(found.measured.contains("from 6.00 to 0.00, the bias from 0.00 to 6.00"));
    }

    #[test]
    fn each_thing_that_is_said_of_the_dial_can_fail() {
        let right = || scene("a", |i| [6.0 - i as f64, i as f64], [9.0, 6.0]);
        let wrong = [
            scene("b", |i| [if i == 3 { 6.0 } else { 6.0 - i as f64 }, i as f64], [9.0, 6.0]),
            scene("b", |i| [6.0 - i as f64, if i == 3 { 1.0 } else { i as f64 }], [9.0, 6.0]),
            scene("b", |i| [6.0 - i as f64, i as f64], [9.0, 6.1]),
            scene("b", |i| [6.0 - i as f64, i as f64], [8.0, 6.0]),
        ];
        for wrong in wrong {
            let found = verdict(vec![right(), wrong]);
            assert_eq!(found.agreement, Agreement::InPart);
            let named = found.remark.matches("on 1 of 2 scenes (not on `b`)").count();
            assert_eq!(named, 1, "{}", found.remark);
        }
    }
}
