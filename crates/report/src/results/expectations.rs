//! Whether what is declared unbiased is.

use crate::document::Section;
use crate::results::plain;
use crate::results::ratios::{Holding, holding};
use screendoor_study::metrics::student_t;
use screendoor_study::study::publications::{DESIGNS, MIXED, MeanError, Publications};
use screendoor_study::study::record::Record;

/// The section; nothing where no expectations were measured.
pub(super) fn section(p: &Publications) -> Option<Section> {
    let found = Found::of(&p.means);
    let closely = p.means.iter().find(|m| m.scene == MIXED)?;
    let briefly = p.means.iter().rfind(|m| m.scene != MIXED)?;
    let mut section = Section::new("Is it unbiased?");
    section.paragraph(format!(
        "Mean of picture minus exact over the covered pixels: on `{MIXED}`, whose triangles come in \
         random order, at {} × {} pixels over {} seeds; on every scene at 8 samples, {} × {} pixels, \
         over {} seeds. The paper takes LK figure 7 to be unbiased. Where primitives' edges share \
         pixels in mixed order, chance decides which fragments belong to one surface. A fragment \
         that covers samples A and B of the current surface's pixel, of which that surface holds A: \
         if the surface was *written* to A and is nearer, A fails the depth test, no conflict is \
         seen, and B is numbered into the same surface, with a reference value complementary to \
         A's low one, thus rather high. If it was not written, the conflict is seen and B gets a \
         fresh value. On average B passes too rarely.",
        closely.side,
        closely.side,
        closely.run.seeds,
        briefly.side,
        briefly.side,
        briefly.run.seeds,
    ));
    section.paragraph(format!(
        "Measured: `{}` is within what chance allows in this table (Bonferroni, 1 in 100) {}; it is \
         off by up to {:.1} standard errors. Designs declared unbiased (`track=covered`: the \
         tracking sees all covered samples, for a counter of log2(N)+1 bits more per pixel; and \
         every other variant in which chance does not decide the surface) are within it {}; the \
         largest deviation is {:.1} standard errors.",
        DESIGNS[0],
        found.lk.words(),
        found.lk_most,
        found.unbiased.words(),
        found.unbiased_most,
    ));
    let row = |m: &MeanError| {
        let MeanError { scene, side, run } = m;
        let mean = run.covered.mean;
        let outside = mean.low > 0.0 || mean.high < 0.0;
        [
            scene.clone(),
            format!("{side} × {side}"),
            format!("`{}`", run.design),
            run.samples.to_string(),
            format!("{:+.4} ± {:.4}", mean.value, mean.half_width()),
            if outside { format!("{:.1} σ", deviation(run)) } else { "within".to_string() },
            plain(run.covered.rmse),
            if run.kept().unbiased { "unbiased" } else { "biased" }.to_string(),
        ]
    };
    let header =
        ["scene", "pixels", "design", "samples", "mean error", "off 0", "RMSE", "declared"];
    section.table(header, p.means.iter().map(row));
    section.paragraph(
        "(σ: standard errors; 'within' is within the 95 % interval, one of twenty is expected \
         outside by chance.)",
    );
    Some(section)
}

/// How far a mean error lies from 0, in standard errors.
fn deviation(run: &Record) -> f64 {
    run.covered.mean.standard_errors(run.seeds as usize)
}

/// Whether a mean error is within what chance allows where so many are looked at together: 1 in
/// 100 for all of them (Bonferroni).
fn within_chance(run: &Record, together: usize) -> bool {
    let confidence = 1.0 - 0.01 / together.max(1) as f64;
    deviation(run) <= student_t(confidence, run.seeds as usize)
}

/// On which scenes all mean errors are within what chance allows where so many are looked at
/// together, and the largest in standard errors.
pub(super) fn on_scenes(runs: Vec<(&str, &Record)>, together: usize) -> (Holding, f64) {
    let mut scenes: Vec<&str> = runs.iter().map(|(scene, _)| *scene).collect();
    scenes.sort_unstable();
    scenes.dedup();
    let within = |scene: &str| {
        runs.iter().filter(|(of, _)| *of == scene).all(|(_, run)| within_chance(run, together))
    };
    let most = runs.iter().map(|(_, run)| deviation(run)).fold(0.0, f64::max);
    (holding(scenes.into_iter().map(|scene| (scene, within(scene)))), most)
}

/// Where mean errors are within what chance allows.
struct Found {
    lk: Holding,
    lk_most: f64,
    unbiased: Holding,
    unbiased_most: f64,
}

impl Found {
    /// Of all mean errors, looked at together: 1 in 100 for the whole table.
    fn of(means: &[MeanError]) -> Self {
        let chosen = |which: &dyn Fn(&Record) -> bool| {
            let those = means.iter().filter(|m| which(&m.run));
            on_scenes(those.map(|m| (m.scene.as_str(), &m.run)).collect(), means.len())
        };
        let (lk, lk_most) = chosen(&|run| run.design == DESIGNS[0]);
        let (unbiased, unbiased_most) = chosen(&|run| run.kept().unbiased);
        Found { lk, lk_most, unbiased, unbiased_most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::metrics::Estimate;
    use screendoor_study::study::analysis::made_up;
    use screendoor_study::study::record::Promise;

    fn mean(scene: &str, design: &str, value: f64, unbiased: bool) -> MeanError {
        let mut run = made_up::record(scene, design, 8, Estimate::exactly(1.0));
        run.covered.mean = Estimate::around(value, 0.1);
        run.seeds = 32;
        run.promises.unbiased = if unbiased { Promise::Always } else { Promise::Never };
        MeanError { scene: scene.to_string(), side: 64, run }
    }

    #[test]
    fn a_bias_is_found_on_the_scene_that_has_it() {
        let list = [
            mean("a", "lk", -0.9, false),
            mean("a", "enderton", 0.05, true),
            mean("b", "lk", 0.02, false),
            mean("b", "enderton", 0.0, true),
        ];
        let found = Found::of(&list);
        assert_eq!(found.lk.words(), "on 1 of 2 scenes (not on `a`)");
        assert!(found.unbiased.everywhere());
        // 0.9 less what rounding may be in units of 0.1 / t(31), where t(31) = 2.04.
        assert!((found.lk_most - 18.34).abs() < 0.02, "{}", found.lk_most);
        // A planted bias of an unbiased design.
        let planted = [mean("a", "enderton", 0.4, true), mean("b", "enderton", 0.0, true)];
        assert_eq!(Found::of(&planted).unbiased.words(), "on 1 of 2 scenes (not on `a`)");
    }
}
