//! What publications say of variants of their methods, measured on every scene that there
//! is: Enderton's table of masks, dithered and stratified rounds, LK's rounds of hashing,
//! and Wyman's dial from noise to bias.

use std::path::Path;

use serde::Serialize;

use crate::metrics::{Ensemble, EnsembleErrors, Estimate, PixelClasses, Region};
use crate::study::comparison::{SLAB_LAYERS, SceneSpec};
use crate::study::publications::figures::averaged;
use crate::study::publications::{Effort, replay};
use screendoor_scene::capture::PatternKind;
use screendoor_trace::error::Result;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::Trace;

/// Variants of a method on several scenes, at one sample count.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Samples per pixel, in each round where there are several.
    pub samples: u32,
    /// Frame side in pixels.
    pub side: u32,
    /// Seeds of each variant.
    pub seeds: u32,
    /// Whether samples lie where an antialiased picture has them, and not all at the
    /// pixel's centre.
    pub antialiased: bool,
    /// Scene after scene.
    pub scenes: Vec<TriedScene>,
}

/// One scene of a trial.
#[derive(Clone, Debug, Serialize)]
pub struct TriedScene {
    /// Its name; a built-in scene's begins with `builtin:`.
    pub name: &'static str,
    /// Variant after variant.
    pub variants: Vec<Variant>,
}

/// A variant on a scene.
#[derive(Clone, Debug, Serialize)]
pub struct Variant {
    /// The design with its parameters.
    pub design: String,
    /// Errors over the covered pixels against the exact picture of the same samples.
    pub errors: EnsembleErrors,
    /// RMSE over the frame after both pictures are averaged over blocks of
    /// [`BLOCK`] × [`BLOCK`] pixels, in 8-bit units.
    pub blocks: Estimate,
}

impl TriedScene {
    /// A variant's figures.
    pub fn variant(&self, design: &str) -> Option<&Variant> {
        self.variants.iter().find(|v| v.design == design)
    }
}

/// Side of the blocks of [`Variant::blocks`].
pub const BLOCK: u32 = 4;

/// What is said of Enderton's and LK's samples.
#[derive(Clone, Debug, Serialize)]
pub struct Claims {
    /// Masks of a finite table, with antialiasing and without ([`TABLE`]).
    pub table: [Trial; 2],
    /// Dithered numbers of samples ([`DITHERED`]).
    pub dither: Trial,
    /// Rounds stratified together ([`STRATIFIED`]).
    pub rounds: Trial,
    /// Rounds of figure 4's hash ([`HASH_ROUNDS`]).
    pub hash_rounds: Trial,
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

/// A scene's trace, by its name.
type Named = (&'static str, Trace);

/// Every scene that there is, in frames of `side` pixels.
fn scenes(models: Option<&Path>, side: u32, pattern: PatternKind) -> Result<Vec<Named>> {
    let mut list = Vec::new();
    for spec in SceneSpec::all(models) {
        if let Some(trace) = spec.capture(models, side, pattern)? {
            list.push((spec.label(), trace));
        }
    }
    Ok(list)
}

impl Effort {
    /// Frame side in pixels of the claims, which all scenes are tried for.
    pub fn claims_side(&self) -> u32 {
        (self.comparison_side / 2).max(16)
    }
}

/// Tries all that [`Claims`] holds on every scene that there is. `progress` is told what
/// runs.
///
/// # Errors
/// As [`screendoor_scene::scene::load`] and [`screendoor_designs::Configured::replay`].
pub(super) fn claims(
    models: Option<&Path>,
    effort: Effort,
    mut progress: impl FnMut(&str),
) -> Result<Claims> {
    let side = effort.claims_side();
    progress("scenes of the claims");
    let scenes_of = |pattern| scenes(models, side, pattern);
    let (antialiased, centred) = (scenes_of(PatternKind::Auto)?, scenes_of(PatternKind::Centre)?);
    let mut tried = |what: &str, scenes: &[Named], designs: &[&str], samples| {
        progress(what);
        trial(scenes, designs, samples, effort.seeds, std::ptr::eq(scenes, &*antialiased))
    };
    let rounds: Vec<&str> = STRATIFIED.into_iter().flatten().collect();
    Ok(Claims {
        table: [
            tried("the table of masks", &antialiased, &TABLE, 8)?,
            tried("the table of masks without antialiasing", &centred, &TABLE, 8)?,
        ],
        dither: tried("dithered numbers of samples", &antialiased, &DITHERED, 8)?,
        rounds: tried("rounds stratified together", &antialiased, &rounds, 4)?,
        hash_rounds: tried("rounds of hashing", &antialiased, &HASH_ROUNDS, 8)?,
    })
}

/// SLAB along its dial, without antialiasing, on every scene that there is.
///
/// # Errors
/// As [`screendoor_scene::scene::load`] and [`screendoor_designs::Configured::replay`].
pub(in crate::study) fn dial(models: Option<&Path>, side: u32, seeds: u32) -> Result<Trial> {
    let along = DIAL.map(dialled);
    let mut designs: Vec<&str> = along.iter().map(String::as_str).collect();
    designs.push(DISCRETE);
    designs.extend(ENDS);
    let scenes = scenes(models, (side / 2).max(16), PatternKind::Centre)?;
    trial(&scenes, &designs, SLAB_LAYERS, seeds, false)
}

fn trial(
    scenes: &[Named],
    designs: &[&str],
    samples: u32,
    seeds: u32,
    antialiased: bool,
) -> Result<Trial> {
    let side = scenes.first().map_or(0, |(_, trace)| trace.header().width);
    let scenes = scenes
        .iter()
        .map(|(name, trace)| {
            Ok(TriedScene { name, variants: tried(trace, designs, samples, seeds)? })
        })
        .collect::<Result<_>>()?;
    Ok(Trial { samples, side, seeds, antialiased, scenes })
}

fn tried(trace: &Trace, designs: &[&str], samples: u32, seeds: u32) -> Result<Vec<Variant>> {
    let exact = replay("exact", trace, samples, 0)?.picture;
    let covered = PixelClasses::of(trace, samples)?.covered;
    let exact_blocks = averaged(&exact, BLOCK);
    let side = exact.width() / BLOCK;
    let frame = Region::frame(TileGrid::new(side, side));
    let variant = |design: &&str| {
        let mut whole = Ensemble::new(&exact, &[&covered]);
        let mut blocks = Ensemble::new(&exact_blocks, &[&frame]);
        for seed in 0..seeds {
            let picture = replay(design, trace, samples, seed)?.picture;
            blocks.add(&averaged(&picture, BLOCK));
            whole.add(&picture);
        }
        let design = design.to_string();
        let [errors, blocks] = [whole, blocks].map(|e| e.finish().swap_remove(0));
        Ok(Variant { design, errors, blocks: blocks.rmse })
    };
    designs.iter().map(variant).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_designs::configure;

    #[test]
    fn every_variant_is_a_design() {
        let named = TABLE.iter().chain(&DITHERED).chain(STRATIFIED.iter().flatten());
        let all = named.chain(&HASH_ROUNDS).chain(&ENDS).chain(&[DISCRETE]);
        for spec in all.map(ToString::to_string).chain(DIAL.map(dialled)) {
            configure(&spec, &[]).unwrap();
        }
    }

    #[test]
    fn rounds_stratified_together_are_less_noisy_than_apart() {
        let spec = SceneSpec::all(None).find(|spec| spec.label() == "builtin:cloth").unwrap();
        let trace = spec.capture(None, 48, PatternKind::Auto).unwrap().unwrap();
        let designs: Vec<&str> = STRATIFIED.into_iter().flatten().collect();
        let found = trial(&[("builtin:cloth", trace)], &designs, 4, 3, true).unwrap();
        for [apart, together] in STRATIFIED {
            let rmse = |d: &str| found.scenes[0].variant(d).unwrap().errors.rmse.value;
            let ratio = rmse(together) / rmse(apart);
            // LK's surfaces differ from round to round, so that it gains little. Steps of
            // alpha N from round to round, which repeat, would make it 1.2.
            let most = if apart.starts_with("lk") { 1.02 } else { 0.98 };
            assert!(ratio < most, "{apart}: {ratio}");
        }
    }

    #[test]
    fn a_trial_has_every_scene_and_variant_and_finds_a_biased_one() {
        let trace = |name: &'static str| {
            let find = |spec: &&&SceneSpec| spec.label() == name;
            let all = SceneSpec::all(None).collect::<Vec<_>>();
            let spec = all.iter().find(find).unwrap();
            (name, spec.capture(None, 32, PatternKind::Auto).unwrap().unwrap())
        };
        let scenes = [trace("builtin:cloth"), trace("builtin:hair")];
        let found = trial(&scenes, &["exact", "enderton", "kbuffer:layers=2"], 4, 3, true).unwrap();
        assert_eq!((found.side, found.samples, found.scenes.len()), (32, 4, 2));
        for scene in &found.scenes {
            let rmse = |design: &str| scene.variant(design).unwrap().errors.rmse.value;
            assert_eq!(rmse("exact"), 0.0);
            assert!(rmse("enderton") > 1.0 && rmse("kbuffer:layers=2") > 1.0);
            let noise = |d: &str| scene.variant(d).unwrap().errors.variance.unwrap();
            assert!(noise("enderton") > 1.0 && noise("kbuffer:layers=2") < 1e-9);
            // Noise averages out over blocks, an error that has one sign less.
            let left = |d: &str| scene.variant(d).unwrap().blocks.value / rmse(d);
            assert!(left("enderton") < left("kbuffer:layers=2"));
        }
    }
}
