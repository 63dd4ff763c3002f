//! What the publications say of methods: Enderton's examples, Wyman's probabilities,
//! hashes, and LK figure 8. The first three enumerate or try small numbers rather than
//! replaying designs on scenes and so are no studies; the rest is.

use serde::Serialize;

use crate::study::file::SceneEntry;
use crate::study::publications::claims::{Claims, claims};
use crate::study::publications::examples::{BiasCase, ExampleRow, bias_cases, examples};
use crate::study::publications::experiment::{Frames, Lab, MeasuredScene, parse, studies};
use crate::study::publications::hashes::{HashRow, hashes};
use crate::study::publications::{Effort, NamedPicture};
use crate::study::run::Store;
use screendoor_rop::{visible_independent, visible_stratified};
use screendoor_trace::error::Result;
use screendoor_trace::picture::read;

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
    /// The scene with one run a design.
    pub scene: MeasuredScene,
}

/// Runs all of it.
///
/// # Errors
/// As [`Lab`] measures.
pub fn methods(lab: &Lab<'_>, effort: Effort) -> Result<Methods> {
    let progress = |what, done| (lab.watch)(what, done, 5);
    progress("Enderton's examples", 0);
    let (examples, bias_cases) = (examples()?, bias_cases()?);
    progress("Wyman's probabilities", 1);
    let probabilities = probabilities();
    progress("hashes", 2);
    let hashes = match effort.brief {
        true => Vec::new(),
        false => hashes(effort.seeds_of_means.min(64))?,
    };
    let (figure_8, pictures) = figure_8(lab, effort)?;
    let claims = claims(lab, effort)?;
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

/// The panels of the figure, by the pictures' names.
const PANELS: [(&str, &str); 2] = [("figure-8-lk", "lk"), ("figure-8-enderton", "enderton")];

fn figure_8(lab: &Lab<'_>, effort: Effort) -> Result<(Figure8, Vec<NamedPicture>)> {
    const MODEL: &str = "openusd_smoke_000003.vdb";
    let has_model = lab.models.is_some_and(|models| models.join(MODEL).is_file());
    let source = if has_model { MODEL } else { "builtin:smoke" };
    let study = parse(studies::FIGURE_8)?.only(|scene| scene.drawn() == source);
    let study = study.in_frames(Frames::new(effort.side / 2, 16, effort.seeds));
    let folder = lab.place(&study);
    let scene = lab.measure(study)?.scenes(SceneEntry::title).swap_remove(0);
    let kept = |design: &str, layer| {
        let record = scene.variant(design).expect("it was measured");
        read(folder.join(Store::picture_name(&record.id)), Some(layer))
    };
    let mut pictures = Vec::new();
    for (name, design) in PANELS {
        pictures.push((name, kept(design, "colour")?));
    }
    pictures.push(("figure-8-exact", kept("lk", "reference")?));
    Ok((Figure8 { source, scene }, pictures))
}
