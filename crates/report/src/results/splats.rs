//! The results' part on Gaussian splats.

use crate::document::{Section, Text};
use crate::results::beyond::{means, ratios, scenes, share, two};
use crate::results::ratios::OnScenes;
use screendoor_study::study::analysis::{ROUNDING, RunName, ratio, ratio_on};
use screendoor_study::study::publications::beyond::Beyond;
use screendoor_study::study::results::Results;

/// Samples at which is told in short.
const SHOWN: u32 = 8;
/// Frames that are accumulated.
const FRAMES: u32 = 16;
/// What PlayCanvas ships.
const POWERED: &str = "hashed-alpha:noise=mask,power=2.2";

/// The part's only section.
pub(super) fn section(b: &Beyond) -> Section {
    let results = &b.results;
    let study = &results.study;
    let mut section = Section::new("Gaussian splats");
    section.paragraph(format!(
        "No publication's: files of trained splats ([SPLATS.md](SPLATS.md)), {} × {} pixels, {} seeds, blended \
         and judged as encoded values, as splats are trained; errors are over the covered pixels, against \
         the exact picture. `{}` is white noise, of which the shipped hashes are three kinds \
         (`noise=stochasticsplats`, `nvpro`, `spark`), `noise=mask` PlayCanvas' mask of blue noise with its 32 places, `power=2.2` the power that it \
         takes of it; `sorted-blend` sorts splats by their depths, as renderers without noise do, and with \
         `stop=0.0001` ends where the reference rasteriser does. An RMSE below {ROUNDING:.2}, which no 8-bit picture shows, counts as that in any share.",
        b.side, b.side, study.seeds, study.baseline
    ));
    for missing in &b.missing {
        section.paragraph(format!("`{missing}` was not given and is left out."));
    }
    if results.scenes.is_empty() {
        return section;
    }
    section.parts.push(layers(results));
    section.parts.extend(study.samples.iter().map(|n| ratios(results, *n)));
    section.parts.push(accumulated(results));
    section.parts.push(means(results));
    section
}

/// What they gain, in a sentence; nothing where no scene was there.
pub(super) fn in_short(b: &Beyond) -> Vec<Text> {
    let results = &b.results;
    let to = RunName { series: &results.study.baseline, samples: SHOWN };
    let gain = |series: &str| {
        let run = RunName { series, samples: SHOWN };
        let each = scenes(results)
            .filter_map(|scene| ratio_on(results, scene, run, to).map(|e| (scene.to_string(), e)));
        let mean = ratio(results, run, to).ok()?.value;
        Some(format!("`{series}` {}, {}", share(mean), OnScenes(each.collect()).range()))
    };
    let told = ["lk", "systematic", "residual", "merging:layers=8", "mboit"];
    let gains: Vec<String> = told.into_iter().filter_map(gain).collect();
    if gains.is_empty() {
        return Vec::new();
    }
    let biases = scenes(results).filter_map(|scene| {
        let record = results.record(scene, POWERED, SHOWN)?;
        let (_, bias) = record.parts()?;
        Some(format!("{:.1} (`{scene}`)", bias.value.max(0.0).sqrt()))
    });
    let biases: Vec<String> = biases.collect();
    let bias = match biases.is_empty() {
        true => String::new(),
        false => format!(
            " PlayCanvas' power of 2.2 leaves a bias of {} of 255, which no number of frames takes away.",
            biases.join(", ")
        ),
    };
    let text = format!(
        "**Gaussian splats** ({} scenes, {} × {} pixels, {} seeds): RMSE at {SHOWN} samples as a share of \
         that of white noise, geometric mean and range: {}.{bias}",
        results.scenes.len(),
        b.side,
        b.side,
        results.study.seeds,
        gains.join("; ")
    );
    vec![text.into()]
}

/// What the scenes are.
fn layers(results: &Results) -> Section {
    let mut part = Section::new("The scenes");
    let rows = results.scenes.iter().map(|scene| {
        let t = &scene.statistics;
        [
            scene.name.clone(),
            scene.source.clone(),
            format!("{:.2} M", t.fragments as f64 / 1e6),
            format!("{:.1}", t.depth_complexity.mean),
            t.depth_complexity.max.to_string(),
            two(t.alpha.mean),
        ]
    });
    let header = ["scene", "source", "fragments", "per covered pixel", "most", "mean alpha"];
    part.table(header, rows);
    part
}

/// One sample a frame, accumulated, beside as many samples in one frame.
fn accumulated(results: &Results) -> Section {
    let mut part = Section::new(format!("{FRAMES} frames of one sample, and {FRAMES} samples"));
    part.paragraph(format!(
        "RMSE of one frame of one sample; of the mean of {FRAMES} such frames of seeds of their own, which has \
         a {FRAMES}th of the variance and the whole bias; and of one frame of {FRAMES} samples. What keeps \
         layers has no noise, and the same error in any number of frames."
    ));
    let row = |series: &String| {
        let cells = scenes(results).map(|scene| {
            let records = [1, FRAMES].map(|samples| results.record(scene, series, samples));
            let [Some(one), Some(many)] = records else { return "—".to_string() };
            let Some((variance, bias)) = one.parts() else { return "—".to_string() };
            let mean = (variance / f64::from(FRAMES) + bias.value.max(0.0)).sqrt();
            let [one, many] = [one, many].map(|r| r.covered.rmse.value);
            format!("{one:.1} → {mean:.1}; {many:.1}")
        });
        std::iter::once(format!("`{series}`")).chain(cells).collect::<Vec<_>>()
    };
    let rows = results.study.designs.iter().map(row);
    part.table(std::iter::once("design").chain(scenes(results)), rows);
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::metrics::Estimate;
    use screendoor_study::study::analysis::made_up;

    #[test]
    fn frames_take_noise_away_and_leave_bias() {
        let record = |samples: u32, rmse: f64, variance: f64| {
            let mut record = made_up::record("s", "a", samples, Estimate::exactly(rmse));
            record.covered.variance = Some(variance);
            record.covered.bias_squared = Some(Estimate::exactly(rmse * rmse - variance));
            record
        };
        let mut results = made_up::planted(&["s"], &[1, 16], &[("a", &[Estimate::exactly(1.0)])]);
        results.records = vec![record(1, 5.0, 16.0), record(16, 3.5, 1.0)];
        let text = accumulated(&results).to_markdown(1, "");
        // 16/16 + 9.
        assert!(text.contains("5.0 → 3.2; 3.5"), "{text}");
    }
}
