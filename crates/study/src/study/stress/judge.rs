//! Holding a design's pictures of a case against the truth.

use serde::Serialize;

use crate::metrics::student_t;
use crate::study::stress::case::Case;
use crate::study::stress::truth::{Truth, truth};
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;

/// The chance that any bound of a whole table, on means or on correlations, is crossed by
/// chance alone.
pub const SIGNIFICANCE: f64 = 1e-3;

/// The widest bound that tells something, as a share of the scale.
pub const DECIDED: f64 = 0.05;

/// How close a design's pictures come to the truth. Errors are shares of the scale of a
/// pixel's contributions, the worst channel of the worst kind of pixel.
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(tag = "outcome", rename_all = "kebab-case")]
pub enum Outcome {
    /// To the last bit of a single-precision number.
    Exact,
    /// Within a bound that is stated.
    Within {
        /// The error; of the mean over pixels and seeds, where the design is random.
        error: f64,
        /// The bound at that place: what rounding may come to, or what chance may.
        bound: f64,
        /// Root mean square of the single pixels' deviations from the mean.
        noise: f64,
    },
    /// Within the bound, which is so wide ([`DECIDED`]) that this says little: too much noise
    /// for so many seeds, or something too rare.
    Undecided {
        /// The error of the mean.
        error: f64,
        /// The bound at that place.
        bound: f64,
        /// Root mean square of the single pixels' deviations.
        noise: f64,
    },
    /// Beyond it.
    Degraded {
        /// The error of the mean.
        error: f64,
        /// The bound that it is beyond.
        bound: f64,
        /// Root mean square of the single pixels' deviations from the mean.
        noise: f64,
    },
    /// Pixels are NaN or infinite, and the replay says so.
    NotFinite {
        /// How many, over all seeds.
        pixels: u64,
    },
    /// The design says why it cannot.
    Refused {
        /// What it says.
        message: String,
    },
}

impl Outcome {
    /// What outcomes there are, in a word each.
    pub const KINDS: [&str; 6] =
        ["exact", "within", "undecided", "degraded", "not finite", "refused"];

    fn kind(&self) -> usize {
        match self {
            Outcome::Exact => 0,
            Outcome::Within { .. } => 1,
            Outcome::Undecided { .. } => 2,
            Outcome::Degraded { .. } => 3,
            Outcome::NotFinite { .. } => 4,
            Outcome::Refused { .. } => 5,
        }
    }

    /// Whether it is as close to the truth as the suite can tell.
    fn is_right(&self) -> bool {
        matches!(self, Outcome::Exact | Outcome::Within { .. })
    }

    /// How many there are of each kind.
    pub fn count<'a>(all: impl IntoIterator<Item = &'a Outcome>) -> [usize; Self::KINDS.len()] {
        all.into_iter().fold(Default::default(), |mut counts, outcome| {
            counts[outcome.kind()] += 1;
            counts
        })
    }
}

/// How many cases a design is right in, as tables have it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Tally {
    /// Cases that were tried.
    pub cases: usize,
    /// Those in which it is exact or within the stated bound.
    pub right: usize,
    /// Those whose bound is too wide to tell: neither right nor wrong.
    pub undecided: usize,
}

impl Tally {
    /// Of these outcomes.
    pub fn of<'a>(all: impl IntoIterator<Item = &'a Outcome>) -> Self {
        all.into_iter().fold(Tally::default(), |tally, outcome| Tally {
            cases: tally.cases + 1,
            right: tally.right + usize::from(outcome.is_right()),
            undecided: tally.undecided + usize::from(matches!(outcome, Outcome::Undecided { .. })),
        })
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Tally { cases, right, undecided } = self;
        match undecided {
            0 => write!(f, "of {cases}: {right}"),
            _ => write!(f, "of {cases}: {right}, {undecided} undecided"),
        }
    }
}

/// The truth about all kinds of pixels of a case, and the bounds.
#[derive(Debug)]
pub(super) struct Judge<'a> {
    case: &'a Case,
    truths: Vec<Truth>,
    /// Means of seeded designs that the suite tests: what [`SIGNIFICANCE`] is shared by.
    tests: usize,
}

/// Of one channel of one kind of pixel: how far it is off and may be.
struct Channel {
    error: f64,
    bound: f64,
    noise: f64,
    exact: bool,
}

impl<'a> Judge<'a> {
    /// # Errors
    /// As [`Case::positions`].
    pub(super) fn new(case: &'a Case, tests: usize) -> Result<Self> {
        let positions = case.positions()?;
        let kinds = 0..case.kinds.len();
        let truths = kinds.map(|kind| truth(case, &case.stored(kind), &positions)).collect();
        Ok(Judge { case, truths, tests })
    }

    /// The verdict on one picture, or on those of several seeds.
    pub(super) fn outcome(&self, pictures: &[Picture]) -> Outcome {
        let pixels = (0..self.truths.len()).flat_map(|kind| self.case.pixels(kind));
        let pixels: Vec<(u32, u32)> = pixels.collect();
        let finite = |p: &Picture, (x, y): (u32, u32)| p.get(x, y).iter().all(|c| c.is_finite());
        let broken = |p: &Picture| pixels.iter().filter(|at| !finite(p, **at)).count() as u64;
        let broken: u64 = pictures.iter().map(broken).sum();
        if broken > 0 {
            return Outcome::NotFinite { pixels: broken };
        }
        let channels: Vec<Channel> = (0..self.truths.len())
            .flat_map(|kind| (0..3).map(move |c| (kind, c)))
            .map(|(kind, c)| self.channel(kind, c, pictures))
            .collect();
        if channels.iter().all(|c| c.exact) {
            return Outcome::Exact;
        }
        let worst =
            |of: fn(&Channel) -> f64| move |a: &&Channel, b: &&Channel| of(a).total_cmp(&of(b));
        let noise = channels.iter().map(|c| c.noise).fold(0.0, f64::max);
        let beyond = channels.iter().filter(|c| c.error > c.bound).max_by(worst(|c| c.error));
        if let Some(c) = beyond {
            return Outcome::Degraded { error: c.error, bound: c.bound, noise };
        }
        let widest = channels.iter().max_by(worst(|c| c.bound));
        let (error, bound) = widest.map_or((0.0, 0.0), |c| (c.error, c.bound));
        if bound > DECIDED {
            return Outcome::Undecided { error, bound, noise };
        }
        let nearest = channels.iter().max_by(worst(|c| c.error / c.bound));
        let (error, bound) = nearest.map_or((error, bound), |c| (c.error, c.bound));
        Outcome::Within { error, bound, noise }
    }

    fn channel(&self, kind: usize, c: usize, pictures: &[Picture]) -> Channel {
        let truth = &self.truths[kind];
        let pixels = self.case.pixels(kind).count() as f64;
        let (mut square, mut exact) = (0.0, true);
        let mut means = Vec::with_capacity(pictures.len());
        for picture in pictures {
            let mut sum = 0.0;
            for (x, y) in self.case.pixels(kind) {
                let off = (picture.get(x, y)[c] - truth.colour[c]) / truth.scale;
                exact &= off.abs() <= f64::from(f32::EPSILON);
                sum += off;
                square += off * off;
            }
            means.push(sum / pixels);
        }
        let runs = means.len() as f64;
        let mean = means.iter().sum::<f64>() / runs;
        let rounding = self.rounding(kind);
        let bound = if means.len() < 2 {
            rounding
        } else {
            let variance =
                means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / (runs - 1.0);
            // What is so rare that it may not have happened once: with N draws, a chance p
            // is missed with a probability of e^-pN.
            let draws = runs * pixels * f64::from(self.case.samples);
            let rare = self.per_test().recip().ln() / draws + 2_f64.powi(-32);
            rounding
                + student_t(1.0 - self.per_test(), means.len()) * (variance / runs).sqrt()
                + rare * truth.range / truth.scale
        };
        let noise = (square / runs / pixels - mean * mean).max(0.0).sqrt();
        Channel { error: mean.abs(), bound, noise, exact }
    }

    /// What rounding to single precision may come to: half a unit in the last place at each
    /// multiplication by what is in front, at each sample's sum, and at the sum and the
    /// weight of the contribution itself, twice.
    fn rounding(&self, kind: usize) -> f64 {
        let operations = self.truths[kind].place + f64::from(self.case.samples) + 2.0;
        operations * f64::from(f32::EPSILON)
    }

    fn per_test(&self) -> f64 {
        SIGNIFICANCE / self.tests.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::stress::case::{Group, layer};
    use screendoor_trace::tile::TileGrid;

    fn case() -> Case {
        Case { background: [0.0; 3], ..Case::new(Group::Layers, "a", "") }.kind([layer(
            0,
            [1.0, 0.5, 0.0],
            0.5,
        )])
    }

    fn picture(case: &Case, value: impl Fn(u32) -> f64) -> Picture {
        let [width, height] = case.size();
        Picture::from_fn(TileGrid::new(width, height), |x, y| {
            [0.5, 0.25, 0.0].map(|v| v * value(y * width + x))
        })
    }

    #[test]
    fn what_is_undecided_is_neither_right_nor_wrong() {
        let numbers = || (0.1, 0.2, 0.3);
        let within = {
            let (error, bound, noise) = numbers();
            Outcome::Within { error, bound, noise }
        };
        let undecided = {
            let (error, bound, noise) = numbers();
            Outcome::Undecided { error, bound, noise }
        };
        let off = {
            let (error, bound, noise) = numbers();
            Outcome::Degraded { error, bound, noise }
        };
        let told = |list: &[&Outcome]| Tally::of(list.iter().copied()).to_string();
        assert_eq!(told(&[&Outcome::Exact, &within, &off]), "of 3: 2");
        assert_eq!(told(&[&Outcome::Exact, &undecided, &off]), "of 3: 1, 1 undecided");
        assert_eq!(told(&[&Outcome::NotFinite { pixels: 1 }]), "of 1: 0");
    }

    #[test]
    fn one_picture_is_exact_within_rounding_or_degraded() {
        let case = case();
        let judge = Judge::new(&case, 100).unwrap();
        let of = |value: f64| judge.outcome(&[picture(&case, |_| value)]);
        assert_eq!(of(1.0), Outcome::Exact);
        assert!(matches!(of(1.0 + 5e-7), Outcome::Within { error, .. } if error > 4e-7));
        assert!(matches!(of(1.01), Outcome::Degraded { error, .. } if (error - 0.01).abs() < 1e-9));
        assert_eq!(of(f64::NAN), Outcome::NotFinite { pixels: 256 });
        let one = picture(&case, |i| if i == 7 { f64::INFINITY } else { 1.0 });
        assert_eq!(judge.outcome(&[one]), Outcome::NotFinite { pixels: 1 });
    }

    #[test]
    fn noise_is_told_from_bias() {
        let case = case();
        let judge = Judge::new(&case, 100).unwrap();
        // All or nothing, decided by a hash: unbiased, however noisy.
        let coin = |seed: u32, lift: f64| {
            picture(&case, |i| {
                2.0 * f64::from(screendoor_trace::random::hash([seed, i]) >> 31) + lift
            })
        };
        let seeds = |lift: f64| (0..16).map(|s| coin(s, lift)).collect::<Vec<_>>();
        // So noisy that 16 seeds of 256 pixels do not tell a twentieth.
        let Outcome::Undecided { error, bound, noise } = judge.outcome(&seeds(0.0)) else {
            panic!("no bias is there")
        };
        assert!(error < bound && bound < 0.2 && (noise - 1.0).abs() < 0.01, "{error} {bound}");
        let biased = judge.outcome(&seeds(0.3));
        assert!(matches!(biased, Outcome::Degraded { error, .. } if (error - 0.3).abs() < 0.1));
    }
}
