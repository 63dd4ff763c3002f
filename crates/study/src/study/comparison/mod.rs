//! All designs over the same fragments: error and bias, state and passes; and the
//! question who wins at equal state. What is measured is in the study files that
//! [`publications`](crate::study::publications) embeds; here is what their records say.

mod contenders;

use serde::Serialize;

pub use contenders::{Contender, SLAB_CLAIM, SLAB_LAYERS, SLAB_LIMIT, SLAB_RIVALS};

use crate::study::file::Study;
use crate::study::publications::Effort;
use crate::study::publications::claims::{Trial, dial};
use crate::study::publications::experiment::{Frames, Lab, MeasuredScene, parse, studies};
use crate::study::record::Record;
use screendoor_trace::error::Result;

/// Samples per pixel, or layers, that every design is run with.
pub const COUNTS: [u32; 5] = [2, 4, 8, 16, 32];

/// A contender's error at a size of state between those of its counts: a line
/// between the logarithms of sizes and errors. `None` outside of them.
fn error_at(scene: &MeasuredScene, contender: &Contender, bytes: f64) -> Option<f64> {
    // Errors below this are rounding.
    let point = |r: &Record| Some((r.state_bytes()?.ln(), rmse(r).max(1e-3).ln()));
    let each = COUNTS.into_iter().filter_map(|count| scene.record(&contender.series, count));
    let points: Vec<(f64, f64)> = each.filter_map(point).collect();
    let at = bytes.ln();
    let (a, b) = points.iter().zip(points.get(1..)?).find(|(a, b)| a.0 <= at && at <= b.0)?;
    let share = if b.0 > a.0 { (at - a.0) / (b.0 - a.0) } else { 0.0 };
    Some((a.1 + share * (b.1 - a.1)).exp())
}

fn rmse(record: &Record) -> f64 {
    record.covered.rmse.value
}

/// The whole comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Frame side in pixels.
    pub side: u32,
    /// Seeds of each design that has any.
    pub seeds: u32,
    /// Who is compared.
    pub contenders: Vec<Contender>,
    /// On what.
    pub scenes: Vec<MeasuredScene>,
    /// The same scenes with all samples at the pixels' centres, as Enderton et al. and
    /// Wyman show theirs; with what [`SLAB_CLAIM`] is about alone.
    pub without_antialiasing: Vec<MeasuredScene>,
    /// SLAB along its dial from noise to bias, without antialiasing.
    pub dial: Trial,
    /// Models that were not given.
    pub missing: Vec<String>,
}

/// Compares all designs on the models in the lab's folder, or on built-in scenes where no
/// folder is given.
///
/// # Errors
/// As [`Lab`] measures.
pub fn compare(lab: &Lab<'_>, effort: Effort) -> Result<Comparison> {
    compare_some(lab, effort, &[parse(studies::COMPARISON)?])
}

/// As [`compare`], but only what [`SLAB_CLAIM`] is about.
///
/// # Errors
/// As [`compare`].
pub(crate) fn compare_slab(lab: &Lab<'_>, effort: Effort) -> Result<Comparison> {
    compare_some(lab, effort, &slab()?)
}

/// What Wyman's claim is about: SLAB, and its rivals at other counts.
fn slab() -> Result<[Study; 2]> {
    Ok([parse(studies::SLAB)?, parse(studies::SLAB_RIVALS)?])
}

fn compare_some(lab: &Lab<'_>, effort: Effort, studies: &[Study]) -> Result<Comparison> {
    let frames = Frames::new(effort.comparison_side, 32, effort.seeds);
    let (scenes, missing) = compared(lab, studies, frames)?;
    let (without_antialiasing, _) = compared(lab, &slab()?, frames.centred())?;
    let mut contenders: Vec<Contender> = Vec::new();
    for series in studies.iter().flat_map(|study| &study.designs) {
        contenders.push(Contender::of(series)?);
    }
    let dial = dial(lab, effort)?;
    let (side, seeds) = (effort.comparison_side, effort.seeds);
    Ok(Comparison { side, seeds, contenders, scenes, without_antialiasing, dial, missing })
}

/// The scenes with the records of all studies, and which are missing: models where their folder
/// is given, and what stands for them where not.
fn compared(
    lab: &Lab<'_>,
    studies: &[Study],
    frames: Frames,
) -> Result<(Vec<MeasuredScene>, Vec<String>)> {
    let mut scenes: Vec<MeasuredScene> = Vec::new();
    let mut lacking = Vec::new();
    for study in studies {
        let wanted = study.clone().only(|scene| scene.is_built_in() == lab.models.is_none());
        let mut found = lab.measure(wanted.in_frames(frames))?;
        lacking = std::mem::take(&mut found.missing);
        for measured in found.scenes(|entry| entry.name.replace("builtin-", "").replace('-', " ")) {
            match scenes.iter_mut().find(|scene| scene.name == measured.name) {
                Some(scene) => scene.records.extend(measured.records),
                None => scenes.push(measured),
            }
        }
    }
    Ok((scenes, lacking))
}

/// Two contenders at equal state over all scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Duel {
    /// Scenes on which the first has the smaller error by more than 2 %.
    pub won: u32,
    /// Scenes on which the second has.
    pub lost: u32,
    /// Scenes on which neither has.
    pub even: u32,
}

impl Comparison {
    /// Who of two has the smaller error with the same bytes of state: on each scene the
    /// geometric mean of the errors' ratio over the state sizes of either that lie
    /// between the least and the greatest of both.
    pub fn duel(&self, a: &Contender, b: &Contender) -> Duel {
        let mut duel = Duel::default();
        for scene in &self.scenes {
            let of_either = [a, b].into_iter().flat_map(|contender| {
                COUNTS.into_iter().filter_map(move |count| scene.record(&contender.series, count))
            });
            let logs: Vec<f64> = of_either
                .filter_map(|r| {
                    let error = |contender| error_at(scene, contender, r.state_bytes()?);
                    Some((error(a)? / error(b)?).ln())
                })
                .collect();
            if logs.is_empty() {
                continue;
            }
            let ratio = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
            if ratio < 0.98 {
                duel.won += 1;
            } else if ratio > 1.0 / 0.98 {
                duel.lost += 1;
            } else {
                duel.even += 1;
            }
        }
        duel
    }

    /// The contender with a label.
    pub fn contender(&self, label: &str) -> Option<&Contender> {
        self.contenders.iter().find(|c| c.label == label)
    }

    /// Whose record it is.
    pub fn contender_of(&self, record: &Record) -> Option<&Contender> {
        self.contenders.iter().find(|c| c.owns(record))
    }
}
