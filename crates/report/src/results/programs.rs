//! The results' part on fragments that programs drew.

use crate::document::{Section, Text, code};
use crate::results::beyond::{scenes, share, two};
use crate::results::ratios::{OnScenes, holding};
use screendoor_study::study::analysis::{ROUNDING, RunName, ratio, ratio_on};
use screendoor_study::study::results::Results;
use screendoor_trace::param::Options;

/// Samples at which every scene is shown.
const SHOWN: u32 = 8;
/// What drew the scenes, and what stands for depth.
const DRAWN: [(&str, &str, &str); 4] = [
    ("glass", "pygfx (WebGPU)", "depths"),
    ("shells", "VTK (OpenGL over zink)", "depths"),
    ("markers", "datoviz", "painted"),
    ("cards", "Qt Quick", "painted"),
];

/// The part's only section.
pub(super) fn section(results: &Results) -> Section {
    let mut section = Section::new("Frames of four programs");
    section.paragraph(format!(
        "No publication's: what each design would have done for the fragments of four programs \
         ([sources](capture/programs)), as a Vulkan layer recorded them: {}. Errors are over the covered pixels, in \
         1/255 of the values that the program blends, against the exact picture of the same fragments. `{{n}}` is the \
         number of samples. An RMSE below {ROUNDING:.2}, which no 8-bit picture shows, counts as that in any share.",
        frames(results)
    ));
    section.paragraph(
        "Frames with depths are drawn with depth tests; `blend` is what the program shows of them, in whatever order \
         it draws. Painted frames have no depth test: a fragment's depth is its place in the order of drawing, an \
         order that `blend` alone needs and that is right by construction, so that the other designs pay for what \
         the program had given. They come from back to front, one of the two orders in which `residual` is exact \
         ([RESIDUAL.md](RESIDUAL.md)). A recorded fragment covers its whole pixel: there are no edges within \
         pixels, so that nothing is said of antialiasing.",
    );
    if results.scenes.is_empty() {
        return section;
    }
    section.paragraph(format!("**In short**: {}", verdict(results)));
    section.parts.extend([drawn(results), errors(results), shares(results)]);
    section
}

/// What they gain, in two sentences.
pub(super) fn in_short(results: &Results) -> Vec<Text> {
    match results.scenes.is_empty() {
        true => Vec::new(),
        false => {
            let text =
                format!("**Fragments of programs** ({}): {}", frames(results), verdict(results));
            vec![text.into()]
        }
    }
}

/// How many there are and how large.
fn frames(results: &Results) -> String {
    let count = results.study.scenes.len();
    let size = results.scenes.first().map_or(String::new(), |scene| {
        let [width, height] = scene.size;
        format!(", {width} × {height} pixels")
    });
    format!("{count} frames{size}, {} seeds", results.study.seeds)
}

/// Designs' gains over the baseline, and where the order of drawing suffices.
fn verdict(results: &Results) -> String {
    let to = RunName { series: &results.study.baseline, samples: SHOWN };
    let gain = |series: &str| {
        let run = RunName { series, samples: SHOWN };
        let each = scenes(results)
            .filter_map(|scene| ratio_on(results, scene, run, to).map(|e| (scene.to_string(), e)));
        let mean = ratio(results, run, to).ok()?.value;
        let range = OnScenes(each.collect()).range();
        let name = series.replace("{n}", &SHOWN.to_string());
        Some(format!("`{name}` ({} bytes) {}, {range}", bytes(results, series), share(mean)))
    };
    let told = ["residual", "residual:per=sample,errors=8", "merging:layers={n}", "mboit"];
    let gains: Vec<String> = told.into_iter().filter_map(gain).collect();
    let blended = |scene| {
        let record = results.record(scene, "blend", SHOWN);
        (scene, record.map_or(f64::INFINITY, |r| r.covered.rmse.value))
    };
    let blended: Vec<(&str, f64)> = scenes(results).map(blended).collect();
    let right = holding(blended.iter().map(|(scene, rmse)| (*scene, *rmse < ROUNDING)));
    let wrong = blended.iter().filter(|(_, rmse)| *rmse >= ROUNDING);
    let wrong: Vec<String> =
        wrong.map(|(scene, rmse)| format!("{rmse:.1} ({})", code(scene))).collect();
    let wrong = match wrong.is_empty() {
        true => String::new(),
        false => format!(", and is off by {} of 255 elsewhere", wrong.join(", ")),
    };
    format!(
        "RMSE at {SHOWN} samples as a share of that of `{}` ({} bytes), geometric mean and range: {}. `blend`, in \
         the order of drawing, is right {}{wrong}.",
        to.series,
        bytes(results, to.series),
        gains.join("; "),
        right.words()
    )
}

/// State per pixel as hardware holds it.
fn bytes(results: &Results, series: &str) -> String {
    let record = scenes(results).find_map(|scene| results.record(scene, series, SHOWN));
    record.map_or("—".to_string(), |record| {
        record.state_bytes().map_or("grows".to_string(), |bytes| format!("{bytes:.0}"))
    })
}

/// What the scenes are.
fn drawn(results: &Results) -> Section {
    let mut part = Section::new("The frames");
    let rows = results.scenes.iter().map(|scene| {
        let t = &scene.statistics;
        let known = DRAWN.iter().find(|(name, ..)| *name == scene.name);
        let (_, program, order) = known.unwrap_or(&("", "—", "—"));
        [
            scene.name.clone(),
            program.to_string(),
            order.to_string(),
            scene.space.name().to_string(),
            t.fragments.to_string(),
            format!("{:.1}", t.depth_complexity.mean),
            t.depth_complexity.max.to_string(),
            two(t.alpha.mean),
        ]
    });
    let header = [
        "scene",
        "drawn by",
        "order",
        "values",
        "fragments",
        "a covered pixel",
        "most",
        "mean alpha",
    ];
    part.table(header, rows);
    part
}

/// Every design's error on every scene.
fn errors(results: &Results) -> Section {
    let mut part = Section::new(format!("RMSE and bytes of state a pixel, {SHOWN} samples"));
    let row = |series: &String| {
        let cells = scenes(results).map(|scene| {
            let record = results.record(scene, series, SHOWN);
            record.map_or("—".to_string(), |r| two(r.covered.rmse.value))
        });
        [format!("`{series}`"), bytes(results, series)].into_iter().chain(cells).collect::<Vec<_>>()
    };
    let header = ["design", "bytes"].into_iter().chain(scenes(results));
    part.table(header, results.study.designs.iter().map(row));
    part
}

/// Every design's error as a share of the baseline's, over the scenes, count by count.
fn shares(results: &Results) -> Section {
    let study = &results.study;
    let mut part = Section::new(format!("RMSE as a share of `{}`'s", study.baseline));
    part.paragraph("Geometric means over the scenes, by samples a pixel.");
    let row = |series: &String| {
        let cells = study.samples.iter().map(|samples| {
            let [run, to] =
                [series, &study.baseline].map(|s| RunName { series: s, samples: *samples });
            ratio(results, run, to).map_or("—".to_string(), |e| share(e.value))
        });
        std::iter::once(format!("`{series}`")).chain(cells).collect::<Vec<_>>()
    };
    let header = std::iter::once("design".to_string())
        .chain(study.samples.iter().map(|samples| samples.to_string()));
    part.table(header, study.designs.iter().map(row));
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::metrics::Estimate;
    use screendoor_study::study::analysis::made_up;

    #[test]
    fn where_the_order_of_drawing_suffices_is_worked_out() {
        let [lk, blend] = [[4.0, 2.0], [6.0, 0.0]].map(|e| e.map(Estimate::exactly));
        let results = made_up::planted(&["a", "b"], &[8], &[("lk", &lk), ("blend", &blend)]);
        let text = verdict(&results);
        assert!(
            text.contains("is right on 1 of 2 scenes (not on `a`), and is off by 6.0 (`a`) of 255"),
            "{text}"
        );
    }
}
