//! What publications say of variants of their methods, measured on every scene that there
//! is: Enderton's table of masks, dithered and stratified rounds, LK's rounds of hashing,
//! and Wyman's dial from noise to bias.

use serde::Serialize;

use crate::study::comparison::SLAB_LAYERS;
use crate::study::file::{SceneEntry, Study};
use crate::study::publications::Effort;
use crate::study::publications::experiment::{Found, Frames, Lab, MeasuredScene, parse, studies};
use screendoor_scene::capture::PatternKind;
use screendoor_trace::error::Result;

/// Variants of a method on several scenes, at one sample count.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Samples per pixel, in each round where there are several.
    pub samples: u32,
    /// Frame side in pixels.
    pub side: u32,
    /// Seeds of each variant that has any.
    pub seeds: u32,
    /// Whether samples lie where an antialiased picture has them, and not all at the
    /// pixel's centre.
    pub antialiased: bool,
    /// Scene after scene.
    pub scenes: Vec<MeasuredScene>,
}

impl Trial {
    /// What an experiment says at one sample count.
    fn of(found: &Found) -> Self {
        let study = &found.results.study;
        let first = study.scenes.first();
        Trial {
            samples: study.samples.first().copied().unwrap_or_default(),
            side: first.map_or(0, |scene| scene.frame()[0]),
            seeds: study.seeds,
            antialiased: first.is_some_and(|scene| scene.pattern != PatternKind::Centre),
            scenes: found.scenes(SceneEntry::title),
        }
    }
}

/// What is said of Enderton's and LK's samples.
#[derive(Clone, Debug, Serialize)]
pub struct Claims {
    /// Masks of a finite table ([`TABLE`]), dithered numbers of samples ([`DITHERED`]) and
    /// rounds of figure 4's hash ([`HASH_ROUNDS`]).
    pub variants: Trial,
    /// Masks of a finite table without antialiasing.
    pub masks: Trial,
    /// Rounds stratified together ([`STRATIFIED`]).
    pub rounds: Trial,
}

/// Masks as published by Enderton et al. (sections 3.1 and 5): computed, and from a table;
/// a much larger table; and chosen among the survivors of the depth test.
pub const TABLE: [&str; 4] = [
    "enderton:among=covered",
    "enderton:mask=table",
    "enderton:mask=table,table-width=65535,alpha-bits=16",
    "enderton",
];

/// Numbers of samples rounded at random, and dithered.
pub const DITHERED: [&str; 4] =
    ["enderton", "enderton:dither=sequence", "enderton:dither=bayer", "enderton:dither=blue-noise"];

/// Rounds with seeds of their own, and stratified together.
pub const STRATIFIED: [[&str; 2]; 4] = [
    ["enderton:among=covered,rounds=8", "enderton:among=covered,rounds=8,strata=all"],
    ["enderton:rounds=8", "enderton:rounds=8,strata=all"],
    ["lk:rounds=8", "lk:rounds=8,strata=all"],
    ["systematic:rounds=8", "systematic:rounds=8,strata=all"],
];

/// Figure 4's hash with 1, 2, 3 and all 4 of its rounds, in a variant without other bias.
pub const HASH_ROUNDS: [&str; 4] = [
    "lk:reference=lk2011-1,track=covered",
    "lk:reference=lk2011-2,track=covered",
    "lk:reference=lk2011-3,track=covered",
    "lk:track=covered",
];

/// Coverage bits along Wyman's dial; 0 is without bound.
pub const DIAL: [u32; 7] = [8, 10, 12, 16, 32, 64, 0];
/// What the dial's ends are said to be: stochastic transparency and the k-buffer.
pub const ENDS: [&str; 2] = ["enderton:among=covered", "kbuffer:layers=8"];
/// The dial's lower end with as many random bits as layers.
pub const DISCRETE: &str = "slab:layers=8,bits=8,opacity=discrete,hidden=removed,normalise=none";

/// SLAB at a place of the dial: the design with its parameters.
pub fn dialled(bits: u32) -> String {
    format!("slab:layers={SLAB_LAYERS},bits={bits},normalise=none")
}

impl Effort {
    /// Frame side in pixels of the claims, which all scenes are tried for.
    pub(crate) fn claims_side(&self) -> u32 {
        (self.comparison_side / 2).max(16)
    }
}

/// Tries all that [`Claims`] holds on every scene that there is.
///
/// # Errors
/// As [`Lab`] measures.
pub(super) fn claims(lab: &Lab<'_>, effort: Effort) -> Result<Claims> {
    let frames = Frames::new(effort.claims_side(), 32, effort.seeds);
    let tried = |study: Study, frames| Ok(Trial::of(&lab.measure(study.in_frames(frames))?));
    Ok(Claims {
        variants: tried(parse(studies::VARIANTS)?, frames)?,
        masks: tried(parse(studies::MASKS)?, frames.centred())?,
        rounds: tried(parse(studies::ROUNDS)?, frames)?,
    })
}

/// SLAB along its dial, without antialiasing, on every scene that there is.
///
/// # Errors
/// As [`Lab`] measures.
pub(in crate::study) fn dial(lab: &Lab<'_>, effort: Effort) -> Result<Trial> {
    let frames = Frames::new(effort.claims_side(), 32, effort.seeds).centred();
    Ok(Trial::of(&lab.measure(parse(studies::DIAL)?.in_frames(frames))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::publications::experiment::Quiet;

    #[test]
    fn the_study_files_have_the_designs_that_are_spoken_of() {
        let files = |study: Result<Study>| study.unwrap().designs;
        let (variants, masks, rounds, along) = (
            files(parse(studies::VARIANTS)),
            files(parse(studies::MASKS)),
            files(parse(studies::ROUNDS)),
            files(parse(studies::DIAL)),
        );
        let has =
            |list: &[String], design: &str| assert!(list.iter().any(|d| d == design), "{design}");
        let at_eight = TABLE.iter().chain(&DITHERED).chain(&HASH_ROUNDS);
        at_eight.for_each(|design| has(&variants, design));
        assert_eq!(masks, TABLE);
        assert_eq!(rounds, STRATIFIED.concat());
        DIAL.map(dialled).iter().for_each(|design| has(&along, design));
        ENDS.iter().chain([&DISCRETE]).for_each(|design| has(&along, design));
    }

    #[test]
    fn rounds_stratified_together_are_less_noisy_than_apart() {
        let quiet = Quiet::new();
        let study = parse(studies::ROUNDS).unwrap().only(|s| s.drawn() == "builtin:cloth");
        let found = quiet.lab().measure(study.in_frames(Frames::new(48, 32, 3))).unwrap();
        let found = Trial::of(&found);
        for [apart, together] in STRATIFIED {
            let rmse = |d: &str| found.scenes[0].variant(d).unwrap().covered.rmse.value;
            let ratio = rmse(together) / rmse(apart);
            // LK's surfaces differ from round to round, so that it gains little. Steps of
            // alpha N from round to round, which repeat, would make it 1.2.
            let most = if apart.starts_with("lk") { 1.02 } else { 0.98 };
            assert!(ratio < most, "{apart}: {ratio}");
        }
    }

    #[test]
    fn a_trial_has_every_scene_and_variant_and_finds_a_biased_one() {
        let quiet = Quiet::new();
        let mut study = parse(studies::ROUNDS)
            .unwrap()
            .only(|s| ["builtin:cloth", "builtin:hair"].contains(&s.drawn()));
        study.designs = ["exact", "enderton", "kbuffer:layers=2"].map(String::from).to_vec();
        study.baseline = study.designs[0].clone();
        let found =
            Trial::of(&quiet.lab().measure(study.in_frames(Frames::new(32, 32, 3))).unwrap());
        assert_eq!((found.side, found.samples, found.scenes.len()), (32, 4, 2));
        assert_eq!(found.scenes[0].name, "builtin:cloth");
        for scene in &found.scenes {
            let rmse = |design: &str| scene.variant(design).unwrap().covered.rmse.value;
            assert_eq!(rmse("exact"), 0.0);
            assert!(rmse("enderton") > 1.0 && rmse("kbuffer:layers=2") > 1.0);
            // A design without seeds has one replay, whose error is bias alone.
            let noise = |d: &str| scene.variant(d).unwrap().covered.variance;
            assert!(noise("enderton").unwrap() > 1.0 && noise("kbuffer:layers=2").is_none());
            // Noise averages out over blocks, an error that has one sign less.
            let left = |d: &str| scene.variant(d).unwrap().blocks.unwrap().value / rmse(d);
            assert!(left("enderton") < left("kbuffer:layers=2"));
        }
    }
}
