//! What the publications say of methods: Enderton's examples, Wyman's probabilities,
//! hashes, and LK figure 8.

use std::path::Path;

use serde::Serialize;

use crate::metrics::{Ensemble, Estimate, PixelClasses};
use crate::study::publications::claims::{Claims, claims};
use crate::study::publications::examples::{BiasCase, ExampleRow, bias_cases, examples};
use crate::study::publications::hashes::{HashRow, hashes};
use crate::study::publications::{Effort, NamedPicture, capture, replay};
use screendoor_rop::{visible_independent, visible_stratified};
use screendoor_scene::capture::CaptureOptions;
use screendoor_trace::error::Result;
use screendoor_trace::trace::{Statistics, statistics};

/// Everything that is reproduced of the methods.
#[derive(Debug)]
pub struct Methods {
    /// What was spent.
    pub effort: Effort,
    /// Enderton's two examples.
    pub examples: Vec<ExampleRow>,
    /// What Enderton says of bias.
    pub bias_cases: Vec<BiasCase>,
    /// Wyman's probabilities.
    pub probabilities: Probabilities,
    /// The hashes; none where brief.
    pub hashes: Vec<HashRow>,
    /// LK figure 8.
    pub figure_8: Figure8,
    /// Variants of Enderton's and LK's samples.
    pub claims: Claims,
    /// Pictures by name.
    pub pictures: Vec<NamedPicture>,
}

/// Wyman's `P_b(s, t)` beside enumeration.
#[derive(Clone, Debug, Serialize)]
pub struct Probabilities {
    /// The largest difference of equation 1 from enumeration over all masks of every
    /// b up to [`MOST_BITS`].
    pub worst_stratified: f64,
    /// The same of the probability without stratification.
    pub worst_independent: f64,
    /// For b = [`TABLE_BITS`], by s and then t: equation 1, enumeration, and the
    /// probability without stratification.
    pub table: Vec<Vec<[f64; 3]>>,
}

/// The most bits that are enumerated.
pub const MOST_BITS: u32 = 16;
/// Bits of the printed table.
pub const TABLE_BITS: u32 = 4;

/// LK figure 8: a cloud of smoke, alpha 0.05, at 16 samples.
#[derive(Clone, Debug, Serialize)]
pub struct Figure8 {
    /// What was drawn.
    pub source: &'static str,
    /// Its trace in numbers.
    pub statistics: Statistics,
    /// Designs with their errors in 8-bit units over the covered pixels, against the
    /// exact picture of the same samples.
    pub rmse: Vec<(&'static str, Estimate)>,
}

/// Runs all of it. Models are looked for in the folder `models`.
///
/// # Errors
/// As [`screendoor_scene::scene::load`] and [`screendoor_designs::Configured::replay`].
pub fn methods(
    models: Option<&Path>,
    effort: Effort,
    mut progress: impl FnMut(&str, u64, u64),
) -> Result<Methods> {
    progress("Enderton's examples", 0, 5);
    let (examples, bias_cases) = (examples()?, bias_cases()?);
    progress("Wyman's probabilities", 1, 5);
    let probabilities = probabilities();
    progress("hashes", 2, 5);
    let hashes = match effort.brief {
        true => Vec::new(),
        false => hashes(effort.seeds_of_means.min(64))?,
    };
    progress("LK figure 8", 3, 5);
    let (figure_8, pictures) = figure_8(models, effort)?;
    let claims = claims(models, effort, |what| progress(what, 4, 5))?;
    Ok(Methods { effort, examples, bias_cases, probabilities, hashes, figure_8, claims, pictures })
}

fn probabilities() -> Probabilities {
    let mut found =
        Probabilities { worst_stratified: 0.0, worst_independent: 0.0, table: Vec::new() };
    for b in 1..=MOST_BITS {
        for s in 0..=b {
            let mut row = Vec::new();
            for t in 0..=b {
                let [stratified, independent] = enumerated(b, s, t);
                let formulas = [visible_stratified(b, s, t), visible_independent(b, s, t)];
                let worse = |worst: f64, a: f64, b: f64| worst.max((a - b).abs());
                found.worst_stratified = worse(found.worst_stratified, formulas[0], stratified);
                found.worst_independent = worse(found.worst_independent, formulas[1], independent);
                row.push([formulas[0], stratified, formulas[1]]);
            }
            if b == TABLE_BITS {
                found.table.push(row);
            }
        }
    }
    found
}

/// The probability that a mask of b bits shows before one of s bits, over every mask:
/// of those with t bits, and of those whose bits are set on their own with t/b.
fn enumerated(b: u32, s: u32, t: u32) -> [f64; 2] {
    let hidden_by = (1_u32 << s) - 1;
    let (mut seen, mut all, mut probability) = (0.0, 0.0, 0.0);
    let share = f64::from(t) / f64::from(b);
    for mask in 0..1_u32 << b {
        let ones = mask.count_ones();
        let shows = mask & !hidden_by != 0;
        if ones == t {
            all += 1.0;
            seen += f64::from(u8::from(shows));
        }
        if shows {
            probability += share.powi(ones as i32) * (1.0 - share).powi((b - ones) as i32);
        }
    }
    [seen / all, probability]
}

const FIGURE_8_DESIGNS: [&str; 6] = [
    "lk",
    "systematic",
    "enderton",
    "enderton:mask=naive",
    "lk:method=depth-correction",
    "enderton:method=depth-correction",
];

fn figure_8(models: Option<&Path>, effort: Effort) -> Result<(Figure8, Vec<NamedPicture>)> {
    const SAMPLES: u32 = 16;
    const MODEL: &str = "openusd_smoke_000003.vdb";
    let side = effort.side / 2;
    let options = CaptureOptions {
        width: side,
        height: side,
        samples: SAMPLES,
        alpha: Some(0.05),
        ..CaptureOptions::default()
    };
    let path = models.map(|m| m.join(MODEL)).filter(|p| p.is_file());
    let (source, trace) = match path {
        Some(path) => (MODEL, capture(&path.display().to_string(), &options, false)?),
        None => ("builtin:smoke", capture("builtin:smoke", &options, false)?),
    };
    let exact = replay("exact", &trace, SAMPLES, 0)?.picture;
    let covered = PixelClasses::of(&trace, SAMPLES)?.covered;
    let mut rmse = Vec::new();
    let mut pictures = vec![];
    for spec in FIGURE_8_DESIGNS {
        let mut ensemble = Ensemble::new(&exact, &[&covered]);
        for seed in 0..effort.seeds {
            let picture = replay(spec, &trace, SAMPLES, seed)?.picture;
            ensemble.add(&picture);
            match (seed, spec) {
                (0, "lk") => pictures.push(("figure-8-lk", picture)),
                (0, "enderton") => pictures.push(("figure-8-enderton", picture)),
                _ => {}
            }
        }
        rmse.push((spec, ensemble.finish().swap_remove(0).rmse));
    }
    pictures.push(("figure-8-exact", exact));
    Ok((Figure8 { source, statistics: statistics(&trace, |_| ())?, rmse }, pictures))
}
