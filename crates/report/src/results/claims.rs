//! What Enderton et al. and LK say of variants of their samples, on every scene: a table of
//! masks, dithered numbers of samples, rounds stratified together, rounds of hashing.

use crate::document::{Against, Agreement, Section};
use crate::results::ratios::{Holding, OnScenes, above, below, holding};
use crate::results::{plain, ratio};
use screendoor_study::metrics::{Estimate, student_t};
use screendoor_study::study::measure::BLOCK;
use screendoor_study::study::publications::claims::{
    DITHERED, HASH_ROUNDS, STRATIFIED, TABLE, Trial,
};
use screendoor_study::study::publications::methods::Methods;
use screendoor_study::study::record::Record;

/// Ratios of RMSE nearer to 1 than this are called the same.
pub(super) const SAME: f64 = 0.02;

/// One chance in so many that a table of mean errors calls an unbiased one biased.
const CHANCE: f64 = 0.01;

/// What of a variant is held against another.
pub(super) type Of = fn(&Record) -> Option<Estimate>;
pub(super) const RMSE: Of = |v| Some(v.covered.rmse);
const BLOCKS: Of = |v| v.blocks;

/// A figure of one variant ÷ that of another, on every scene that has both.
pub(super) fn ratios(trial: &Trial, of: Of, [over, under]: [&str; 2]) -> OnScenes {
    let scenes = trial.scenes.iter().filter_map(|scene| {
        let (a, b) = scene.variant(over).zip(scene.variant(under))?;
        Some((scene.name.clone(), of(a)?.ratio(of(b)?)))
    });
    OnScenes(scenes.collect())
}

/// On which scenes a variant's mean error is nothing but chance, of `tests` that are looked
/// at together (Bonferroni).
fn centred(trial: &Trial, design: &str, tests: usize) -> Holding {
    let bound = student_t(1.0 - CHANCE / tests.max(1) as f64, trial.seeds as usize);
    holding(trial.scenes.iter().filter_map(|scene| {
        let mean = scene.variant(design)?.covered.mean;
        Some((scene.name.as_str(), mean.standard_errors(trial.seeds as usize) <= bound))
    }))
}

/// The largest mean error over the scenes, in 8-bit units.
fn farthest(trial: &Trial, design: &str) -> f64 {
    let means = trial.scenes.iter().filter_map(|s| s.variant(design).map(|v| v.covered.mean.value));
    means.fold(0.0, |most: f64, mean| if mean.abs() > most.abs() { mean } else { most })
}

/// In what frames a trial was made.
pub(super) fn frames(trial: &Trial) -> String {
    format!(
        "{} scenes, {} × {} pixels, {} samples{}, {} seeds",
        trial.scenes.len(),
        trial.side,
        trial.side,
        trial.samples,
        if trial.antialiased { "" } else { " at the pixel's centre" },
        trial.seeds
    )
}

/// A ratio's mean and range in words.
fn spread(list: &OnScenes) -> String {
    format!("{:.2} in the geometric mean, {}", list.mean(), list.range())
}

/// Rows of a table: each scene with a figure of every design, then ratios.
fn rows(trial: &Trial, designs: &[&str], pairs: &[(Of, [&str; 2])]) -> Vec<Vec<String>> {
    trial
        .scenes
        .iter()
        .map(|scene| {
            let mut row = vec![scene.name.clone()];
            let figure =
                |d: &&str| scene.variant(d).map_or("—".into(), |v| plain(v.covered.rmse));
            row.extend(designs.iter().map(figure));
            row.extend(pairs.iter().map(|(of, [a, b])| {
                let figure = |design: &str| scene.variant(design).and_then(of);
                let both = figure(a).zip(figure(b));
                both.map_or("—".into(), |(a, b)| ratio(a, b))
            }));
            row
        })
        .collect()
}

/// Enderton's table of masks beside masks that are computed.
fn table_of_masks([antialiased, centred_samples]: [&Trial; 2]) -> Against {
    let [computed, table, larger, survivors] = TABLE;
    let of = |trial| ratios(trial, RMSE, [table, computed]);
    let (with, without) = (of(antialiased), of(centred_samples));
    let against_larger = ratios(antialiased, RMSE, [table, larger]);
    let ideal = ratios(antialiased, RMSE, [table, survivors]);
    let same = |e: Estimate| !above(e, 1.0 + SAME);
    let tests = antialiased.scenes.len() + centred_samples.scenes.len();
    let unbiased = centred(antialiased, table, tests);
    let (quiet, quiet_whole) = (with.holding(same), without.holding(same));
    let statements: Vec<bool> =
        [&quiet.each, &quiet_whole.each, &unbiased.each].into_iter().flatten().copied().collect();
    Against {
        section: "Enderton's table of masks".to_string(),
        source: "Enderton et al. 2011, sections 4 and 5".to_string(),
        printed: "Masks come from a table of 2047 for each alpha of about 10 bits, which is \
                  acceptable in practice; too small a table brings bias or noise."
            .to_string(),
        measured: format!(
            "RMSE of `{table}` ÷ that of masks computed for the same samples: {} with \
             antialiasing, {} without. ÷ `{survivors}`, which chooses among the survivors of the \
             depth test: {}. Largest mean error {:+.3}.",
            spread(&with),
            spread(&without),
            spread(&ideal),
            farthest(antialiased, table)
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "No more noise than computed masks (within {:.0} %) {} with antialiasing and {} \
             without; no bias beyond chance {}. ÷ a table of 65 535 masks for alphas of 16 bits the \
             RMSE is {}: {}",
            100.0 * SAME,
            quiet.words(),
            quiet_whole.words(),
            unbiased.words(),
            spread(&against_larger),
            cause(&with, &without, &against_larger),
        ),
    }
}

/// What makes the table noisier than computed masks.
fn cause(with: &OnScenes, without: &OnScenes, against_larger: &OnScenes) -> &'static str {
    let noisier = |list: &OnScenes| list.mean() > 1.0 + SAME;
    match (noisier(with), noisier(without), noisier(against_larger)) {
        (_, _, true) => "its size is what makes noise.",
        (true, false, false) => {
            "not its size makes noise, but that its masks are of whole pixels; of a fragment that \
             covers a part of the samples they choose more or fewer than its share."
        }
        (true, true, false) => "a larger table is as noisy; the masks themselves are.",
        (false, _, false) => "neither its size nor its masks of whole pixels make noise.",
    }
}

/// The section on a table of masks.
pub(super) fn masks_section(m: &Methods) -> Option<Section> {
    let [antialiased, centred_samples] = [&m.claims.variants, &m.claims.masks];
    let [computed, table, ..] = TABLE;
    let mut section = Section::answering(table_of_masks([antialiased, centred_samples]));
    section.paragraph(format!(
        "RMSE over the covered pixels; {}, and the same without antialiasing, where every fragment \
         covers all samples of its pixels.",
        frames(antialiased)
    ));
    let pair = [(RMSE, [table, computed])];
    let mut list = rows(antialiased, &TABLE, &pair);
    for (row, whole) in list.iter_mut().zip(rows(centred_samples, &[], &pair)) {
        row.extend(whole.into_iter().skip(1));
    }
    let mut header = vec!["scene".to_string()];
    header.extend(TABLE.map(|d| format!("`{d}`")));
    header.extend(["table ÷ computed".to_string(), "… without antialiasing".to_string()]);
    section.table(header, list);
    Some(section)
}

/// Dithered numbers of samples.
fn dithered(trial: &Trial) -> Against {
    let [white, dithers @ ..] = DITHERED;
    let of = |of: Of, dither| ratios(trial, of, [dither, white]);
    let smoother = dithers.map(|d| of(BLOCKS, d).holding(|e| below(e, 1.0)));
    let kept = dithers.map(|d| of(RMSE, d).holding(|e| !above(e, 1.0 + SAME)));
    let statements: Vec<bool> = smoother.iter().flat_map(|h| h.each.iter().copied()).collect();
    let figures = dithers
        .map(|d| format!("`{d}` {} (pixels: {:.2})", spread(&of(BLOCKS, d)), of(RMSE, d).mean()));
    let words = dithers.iter().zip(&smoother).map(|(d, h)| format!("`{d}` {}", h.words()));
    let everywhere = kept.iter().all(Holding::everywhere);
    Against {
        section: "Dithered numbers of samples".to_string(),
        source: "Enderton et al. 2011, section 3.1".to_string(),
        printed: "The number R of a fragment's samples could be dithered across a tile, for \
                  further stratification."
            .to_string(),
        measured: format!(
            "Averaged over {BLOCK} × {BLOCK} pixels, RMSE ÷ that of R rounded at random: {}.",
            figures.join("; ")
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Less is left of the noise over blocks, beyond chance: {}. Single pixels are {} noisier \
             for it (by more than {:.0} %, beyond chance).",
            words.collect::<Vec<_>>().join("; "),
            if everywhere { "nowhere" } else { "on some scenes" },
            100.0 * SAME
        ),
    }
}

/// The section on that.
pub(super) fn dither_section(m: &Methods) -> Option<Section> {
    let trial = &m.claims.variants;
    let [white, dithers @ ..] = DITHERED;
    let mut section = Section::answering(dithered(trial));
    section.paragraph(format!(
        "RMSE over the covered pixels, and the ratio of what is left over blocks; {}. The gain is \
         smaller the more layers hide each other, since each has its own dither.",
        frames(trial)
    ));
    let pairs = dithers.map(|d| (BLOCKS, [d, white]));
    let mut header = vec!["scene".to_string()];
    header.extend(DITHERED.map(|d| format!("`{d}`")));
    let name = |d: &str| format!("{}, blocks", d.rsplit('=').next().unwrap_or(d));
    header.extend(dithers.map(name));
    section.table(header, rows(trial, &DITHERED, &pairs));
    Some(section)
}

/// Rounds that are stratified together.
fn rounds_together(trial: &Trial) -> Against {
    let of = STRATIFIED.map(|[apart, together]| ratios(trial, RMSE, [together, apart]));
    let holds = of.each_ref().map(|list| list.holding(|e| !above(e, 1.0)));
    let statements: Vec<bool> = holds.iter().flat_map(|h| h.each.iter().copied()).collect();
    let named = STRATIFIED.map(|[apart, _]| format!("`{apart}`"));
    let figures: Vec<String> =
        named.iter().zip(&of).map(|(name, list)| format!("{name} {}", spread(list))).collect();
    let words: Vec<String> =
        named.iter().zip(&holds).map(|(name, h)| format!("{name} {}", h.words())).collect();
    // Chosen among all that a fragment covers, as published, against rounds apart that choose
    // among the survivors.
    let [[_, published], [survivors, _], ..] = STRATIFIED;
    let unlike = ratios(trial, RMSE, [published, survivors]);
    Against {
        section: "Rounds stratified together".to_string(),
        source: "Enderton et al. 2011, footnotes 3 and 4".to_string(),
        printed: "Results are slightly improved if masks are stratified across all passes, rather \
                  than in each of them."
            .to_string(),
        measured: format!(
            "8 rounds of {} samples, RMSE stratified together ÷ apart: {}.",
            trial.samples,
            figures.join("; ")
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Together is not worse: {}. Masks over all rounds as published are chosen among all \
             samples that a fragment covers, whatever the depth test has left of them in each \
             round; against rounds apart that choose among the survivors they have {} times the \
             RMSE (more on {} of {} scenes). Among survivors it is the rounding of each \
             round's number of samples that is stratified here.",
            words.join("; "),
            spread(&unlike),
            unlike.above(1.0),
            unlike.0.len()
        ),
    }
}

/// The section on that.
pub(super) fn rounds_section(m: &Methods) -> Option<Section> {
    let trial = &m.claims.rounds;
    let mut section = Section::answering(rounds_together(trial));
    section.paragraph(format!(
        "RMSE over the covered pixels of the mean of 8 rounds; {} in each round. \
         `enderton:among=covered` takes its samples over all rounds from one mask. `enderton` \
         chooses among the samples that pass the depth test, which differ from round to round: \
         there the rounds' ξ lie in a stratum each, in random order, so that a fragment of which \
         every round leaves the same n samples writes ⌊8αn⌋ or ⌈8αn⌉ in all; so do those of a \
         surface of `systematic`. `lk` numbers the samples of all rounds one after the other in its \
         sequence. Where rounds differ in their surfaces, as chance decides, these are not \
         stratified together.",
        frames(trial)
    ));
    let designs: Vec<&str> = STRATIFIED.into_iter().flatten().collect();
    let pairs = STRATIFIED.map(|[apart, together]| (RMSE, [together, apart]));
    let mut header = vec!["scene".to_string()];
    let short = |d: &str| d.replace(":rounds=8", "").replace(",rounds=8", "");
    for [apart, _] in STRATIFIED {
        header.extend(["apart", "together"].map(|how| format!("`{}`, {how}", short(apart))));
    }
    header.extend(STRATIFIED.map(|[apart, _]| format!("`{}`, together ÷ apart", short(apart))));
    section.table(header, rows(trial, &designs, &pairs));
    Some(section)
}

/// Whether a hash of fewer rounds gives what all four give, on every scene: no mean error
/// beyond chance, and no more noise, in pixels nor in blocks.
fn suffices(trial: &Trial, design: &str) -> Holding {
    let [.., all] = HASH_ROUNDS;
    let no_bias = centred(trial, design, trial.scenes.len() * HASH_ROUNDS.len());
    let same = |of| ratios(trial, of, [design, all]).holding(|e| !above(e, 1.0 + SAME)).each;
    let (pixels, blocks) = (same(RMSE), same(BLOCKS));
    let both = pixels.iter().zip(&blocks).zip(&no_bias.each).map(|((a, b), c)| *a && *b && *c);
    holding(trial.scenes.iter().map(|s| s.name.as_str()).zip(both))
}

/// Rounds of figure 4's hash.
fn rounds_of_hashing(trial: &Trial) -> Against {
    let each = HASH_ROUNDS.map(|design| suffices(trial, design));
    let fewest = each.iter().position(Holding::everywhere).map(|i| i + 1);
    let four = each[HASH_ROUNDS.len() - 1].everywhere();
    let [one, two, three, all] = HASH_ROUNDS;
    let noise = [one, two, three].map(|d| {
        format!(
            "{:.3} ({:.3} over blocks)",
            ratios(trial, RMSE, [d, all]).mean(),
            ratios(trial, BLOCKS, [d, all]).mean()
        )
    });
    let means = HASH_ROUNDS.map(|d| format!("{:+.3}", farthest(trial, d)));
    let words: Vec<String> =
        (1..).zip(&each).map(|(k, holding)| format!("{k} {}", holding.words())).collect();
    Against {
        section: "Rounds of hashing".to_string(),
        source: "Laine and Karras 2011, section 3, figure 4".to_string(),
        printed: "One multiplication is not enough; four rounds with different constants are \
                  sufficient to remove any detectable structure."
            .to_string(),
        measured: format!(
            "RMSE with the first 1, 2, 3 rounds ÷ all four, in the geometric mean: {}. Largest mean \
             error with 1, 2, 3, 4: {}.",
            noise.join(", "),
            means.join(", ")
        ),
        agreement: Agreement::of(&[!each[0].everywhere(), four]),
        remark: format!(
            "As many rounds give no mean error beyond chance, and no more noise than four, in pixels \
             and in blocks of {BLOCK} × {BLOCK} (within {:.0} %): {}. {}",
            100.0 * SAME,
            words.join("; "),
            fewest.map_or("No number of them suffices on all.".to_string(), |k| format!(
                "The fewest that suffice on all: {k}."
            ))
        ),
    }
}

/// The section on that.
pub(super) fn hashing_section(m: &Methods) -> Option<Section> {
    let trial = &m.claims.variants;
    let mut section = Section::answering(rounds_of_hashing(trial));
    section.paragraph(format!(
        "`lk:track=covered`, which has no other bias; {}: RMSE over the covered pixels, its ratio \
         to that of all four rounds, the ratio over blocks, and mean error.",
        frames(trial)
    ));
    let [.., all] = HASH_ROUNDS;
    let mut list = Vec::new();
    for scene in &trial.scenes {
        for (rounds, design) in (1..).zip(HASH_ROUNDS) {
            let Some((own, four)) = scene.variant(design).zip(scene.variant(all)) else { continue };
            let mean = own.covered.mean;
            list.push([
                scene.name.clone(),
                format!("{rounds}"),
                plain(own.covered.rmse),
                ratio(own.covered.rmse, four.covered.rmse),
                own.blocks.zip(four.blocks).map_or("—".into(), |(a, b)| ratio(a, b)),
                format!("{:+.3} ± {:.3}", mean.value, mean.half_width()),
            ]);
        }
    }
    let header = ["scene", "rounds", "RMSE", "÷ four", "÷ four, blocks", "mean error"];
    section.table(header, list);
    Some(section)
}

#[cfg(test)]
#[path = "claims_tests.rs"]
pub(super) mod tests;
