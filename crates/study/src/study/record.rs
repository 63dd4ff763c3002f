//! The one record of results: what every table, chart and export is made of.

use std::collections::BTreeMap;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::metrics::{EnsembleErrors, Estimate};
use crate::study::throughput::Spread;
use screendoor_rop::{EventCounts, Promises, StateBits};

/// Part of a record, for those who read records alone.
pub use screendoor_rop::Promise;

/// The version of the form of [`Record`] that this program writes. It rises where what an
/// older program would read means something else; a field that older records lack has a
/// default instead.
pub const VERSION: u32 = 1;

/// The version of records that name none.
fn first() -> u32 {
    1
}

fn is_first(version: &u32) -> bool {
    *version == first()
}

fn known<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let version = u32::deserialize(deserializer)?;
    check_version(version.into()).map_err(D::Error::custom)?;
    Ok(version)
}

/// Refuses a version that this program does not know.
pub(in crate::study) fn check_version(version: u64) -> Result<(), String> {
    if version <= u64::from(VERSION) {
        return Ok(());
    }
    Err(format!(
        "it is a record of version {version}, and this screendoor reads up to version {VERSION}: a \
         later screendoor wrote it"
    ))
}

/// One design at one sample count on one scene, over all seeds of the study.
///
/// Everything but [`Record::speed`] is a pure function of the study: measured again, on
/// whatever machine, it is the same to the last bit.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Of the form that this is, [`VERSION`]. Not written where it is 1: the form has begun
    /// without.
    #[serde(default = "first", skip_serializing_if = "is_first", deserialize_with = "known")]
    pub version: u32,
    /// Names the run within its study: a file name on every system.
    pub id: String,
    /// The scene's name in the study.
    pub scene: String,
    /// BLAKE3 of the trace's content.
    pub trace: String,
    /// The design as the study has it, the same at all sample counts: `kbuffer:layers={n}`.
    pub series: String,
    /// Name and changed parameters at this sample count: `kbuffer:layers=8`.
    pub design: String,
    /// The design's family: `stochastic`, `layered`, …
    pub family: String,
    /// What it promises with these parameters.
    pub promises: Promised,
    /// Samples per pixel.
    pub samples: u32,
    /// Seeds that were replayed, from the study's first on; 1 where no seed changes anything.
    pub seeds: u32,
    /// Fragments of the trace that cover one of these samples.
    pub fragments: u64,
    /// Those of them that share a depth with another one at a sample: where there are any,
    /// promises that ask for distinct depths are not kept.
    pub tied_fragments: u64,
    /// Errors against the exact picture of the same samples over the whole frame.
    pub frame: EnsembleErrors,
    /// The same over the pixels with at least one fragment. The figure of the charts.
    pub covered: EnsembleErrors,
    /// The same over covered pixels that no primitive's edge crosses.
    pub interior: EnsembleErrors,
    /// The same over the other covered pixels.
    pub edges: EnsembleErrors,
    /// RMSE over all covered pixels against the exact picture of all of the trace's
    /// samples, in 8-bit units: missing antialiasing counts.
    pub fine: Estimate,
    /// RMSE over the covered pixels after a Gaussian on the error, in 8-bit units: what is
    /// left of it from afar. Empty where it was not asked for.
    #[serde(default)]
    pub filtered: Vec<Filtered>,
    /// What filters of the finished pictures leave, in the study's order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub post: Vec<PostFiltered>,
    /// FLIP of the pictures as a display of standard range shows them.
    pub flip: Option<FlipOverSeeds>,
    /// FLIP over all exposures in which something shows.
    pub flip_hdr: Option<FlipOverSeeds>,
    /// The error's spectrum, mean over seeds.
    pub spectrum: Option<SpectrumOverSeeds>,
    /// RMSE over the frame after picture and exact picture are averaged over blocks of
    /// [`BLOCK`](crate::study::measure::BLOCK) × `BLOCK` pixels, in 8-bit units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocks: Option<Estimate>,
    /// What the design did with the first seed.
    pub events: EventCounts,
    /// State per pixel.
    pub state_bits: StateBits,
    /// How it is made up: `8 × (32 depth + 48 colour) + 40 tracking`.
    pub layout: String,
    /// Passes over the trace.
    pub passes: u32,
    /// Tiles that at least one fragment touched.
    pub touched_tiles: u64,
    /// BLAKE3 of the first seed's picture.
    pub picture: String,
    /// How fast engines replay it, by their names. Measured: no two runs give the same.
    pub speed: BTreeMap<String, Speed>,
}

/// What a design promises, as far as one chooses by it. Under what condition is said with
/// it; [`Record::kept`] is what comes of it on the record's scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Promised {
    /// Its expectation over seeds is the exact picture.
    pub unbiased: Promise,
    /// Its picture approaches the exact one as samples increase.
    pub consistent: Promise,
    /// Its picture is the same in any order of fragments, but for rounding.
    pub same_picture: bool,
    /// Its expectation over seeds is the same in any order of fragments, but for rounding.
    /// How far pictures scatter about it may still depend on the order.
    pub same_expectation: Promise,
    /// Its picture depends on the seed: it is noise, not structure.
    pub seeded: bool,
}

/// The promises that are kept on some scenes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Kept {
    /// As [`Promised::unbiased`].
    pub unbiased: bool,
    /// As [`Promised::consistent`].
    pub consistent: bool,
    /// As [`Promised::same_picture`].
    pub same_picture: bool,
    /// As [`Promised::same_expectation`].
    pub same_expectation: bool,
}

impl From<Promises> for Promised {
    fn from(promises: Promises) -> Self {
        Promised {
            unbiased: promises.unbiased,
            consistent: promises.consistent,
            same_picture: promises.same_picture(),
            same_expectation: promises.same_expectation(),
            seeded: promises.seeded,
        }
    }
}

impl Promised {
    /// What is kept where so many fragments share a depth with another.
    pub fn kept(self, tied_fragments: u64) -> Kept {
        Kept {
            unbiased: self.unbiased.holds(tied_fragments),
            consistent: self.consistent.holds(tied_fragments),
            same_picture: self.same_picture,
            same_expectation: self.same_expectation.holds(tied_fragments),
        }
    }
}

impl Kept {
    /// What is kept here and there.
    pub fn and(self, other: Kept) -> Kept {
        Kept {
            unbiased: self.unbiased && other.unbiased,
            consistent: self.consistent && other.consistent,
            same_picture: self.same_picture && other.same_picture,
            same_expectation: self.same_expectation && other.same_expectation,
        }
    }
}

/// Error after a Gaussian.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Filtered {
    /// Its standard deviation in pixels.
    pub sigma: f64,
    /// What is left, in 8-bit units.
    pub rmse: Estimate,
}

/// Errors of the finished pictures after a filter, against the exact picture that is not filtered, in
/// 8-bit units.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PostFiltered {
    /// The filter as the study has it.
    pub filter: String,
    /// Over the covered pixels.
    pub covered: Estimate,
    /// Over those that no primitive's edge crosses.
    pub interior: Estimate,
    /// Over the other covered pixels.
    pub edges: Estimate,
    /// Mean FLIP over the frame, where it is asked for.
    pub flip: Option<Estimate>,
    /// Of the exact picture itself after the filter: what it blurs.
    pub blur: f64,
}

/// FLIP of several seeds: 0 (the same) to 1.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlipOverSeeds {
    /// Mean over the frame.
    pub mean: Estimate,
    /// Weighted first quartile, median and third quartile.
    pub quartiles: [Estimate; 3],
}

/// Radially averaged power spectrum.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpectrumOverSeeds {
    /// Centres of the bins in cycles per pixel.
    pub frequency: Vec<f64>,
    /// Mean power density in each, in squared 8-bit units: white noise has its variance
    /// in every bin.
    pub power: Vec<f64>,
    /// How blue it is, in decibels: 0 for white noise, above for blue. `None` where
    /// there is no error.
    pub blueness: Option<Estimate>,
}

/// How fast an engine replays a trace.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Speed {
    /// Seconds from the file, or from its fragments as an earlier replay left them, to the
    /// picture, with so many [`threads`](Speed::threads); `None`
    /// where the engine cannot do it.
    pub seconds: Option<Spread>,
    /// Seconds in which a GPU draws, by its own clock.
    pub kernel: Option<Spread>,
    /// Threads that each of these replays had; not known of what was measured before this was
    /// put down, when they had all of the machine's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub threads: Option<u32>,
    /// Whether its picture is bit for bit the one that the errors are of.
    pub same_bits: Option<bool>,
    /// Why there is no figure.
    pub missing: Option<String>,
}

impl Record {
    /// State in bytes per pixel, as hardware would hold it; `None` where it grows with
    /// the fragments.
    pub fn state_bytes(&self) -> Option<f64> {
        (!self.state_bits.unbounded).then(|| f64::from(self.state_bits.total()) / 8.0)
    }

    /// `None` where nothing was counted: a design that draws counts its fragments.
    fn per_fragment(&self, count: f64) -> Option<f64> {
        let counted = self.fragments > 0 && self.events.fragments > 0;
        counted.then(|| count / self.fragments as f64)
    }

    /// Bytes of pixel state read and written for each fragment of the trace, over all passes.
    pub fn bytes_moved_per_fragment(&self) -> Option<f64> {
        let bits = self.events.state_bits_read + self.events.state_bits_written;
        self.per_fragment(bits as f64 / 8.0)
    }

    /// Hashes evaluated for each fragment of the trace.
    pub fn hashes_per_fragment(&self) -> Option<f64> {
        self.per_fragment(self.events.hashes as f64)
    }

    /// Comparisons of depths for each fragment of the trace: depth tests, and those of
    /// sorting networks ([`EventCounts::comparators`]).
    pub fn comparators_per_fragment(&self) -> Option<f64> {
        self.per_fragment(self.events.comparators() as f64)
    }

    /// Multiplications for each fragment of the trace ([`EventCounts::multiplications`]); `None`
    /// too of a design that does not say.
    pub fn multiplications_per_fragment(&self) -> Option<f64> {
        self.per_fragment(self.events.multiplications? as f64)
    }

    /// An engine's nanoseconds for each fragment of the trace.
    pub fn nanoseconds_per_fragment(&self, engine: &str) -> Option<Spread> {
        let seconds = self.speed.get(engine)?.seconds?;
        let each = |s: f64| s * 1e9 / self.fragments as f64;
        (self.fragments > 0).then(|| Spread {
            low: each(seconds.low),
            median: each(seconds.median),
            high: each(seconds.high),
        })
    }

    /// The promises that are kept on this scene.
    pub fn kept(&self) -> Kept {
        self.promises.kept(self.tied_fragments)
    }

    /// The share of the fragments that share a depth with another, 0 to 1; `None` where
    /// there are none.
    pub fn tied_share(&self) -> Option<f64> {
        (self.fragments > 0).then(|| self.tied_fragments as f64 / self.fragments as f64)
    }

    /// Variance and squared bias over the covered pixels: what the mean square error is made up
    /// of. All of it is bias where seeds change nothing; of one draw of many neither is known.
    pub fn parts(&self) -> Option<(f64, Estimate)> {
        let errors = &self.covered;
        match (errors.variance, errors.bias_squared) {
            (Some(variance), Some(bias)) => Some((variance, bias)),
            _ => (!self.promises.seeded)
                .then(|| (0.0, Estimate::exactly(errors.rmse.value * errors.rmse.value))),
        }
    }

    /// Whether seeds change the picture and only one was replayed, so that neither the mean
    /// error has an interval nor variance and bias are known.
    pub fn is_one_draw(&self) -> bool {
        self.promises.seeded && self.seeds < 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::made_up;

    #[test]
    fn an_error_without_noise_is_bias_and_one_draw_of_many_is_not_known() {
        let mut record = made_up::record("s", "a", 8, Estimate::exactly(3.0));
        record.covered.variance = Some(8.0);
        record.covered.bias_squared = Some(Estimate::exactly(1.0));
        assert_eq!(record.parts(), Some((8.0, Estimate::exactly(1.0))));
        (record.covered.variance, record.covered.bias_squared) = (None, None);
        record.promises.seeded = true;
        assert_eq!(record.parts(), None);
        record.promises.seeded = false;
        assert_eq!(record.parts(), Some((0.0, Estimate::exactly(9.0))));
    }
}
