//! Whether two surfaces, two seeds and two neighbouring pixels get unrelated numbers: of
//! every hash of reference values, and in the pictures of every random design.

use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::study::publications::hashes::Values;
use crate::study::stress::SIGNIFICANCE;
use crate::study::stress::case::{Case, Group, layer};
use screendoor_designs::Configured;
use screendoor_rop::{Reference, ReplayOptions};
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;
use screendoor_trace::trace::{Fragment, Trace};

/// Distances that are tried: between numbers of surfaces, seeds and pixels.
const LAGS: [u32; 4] = [1, 2, 3, 8];

/// Pixels of an image, and numbers of surfaces or seeds in a pixel.
const COUNT: u32 = 1 << 14;

/// Pixels in which single ones are looked at.
const PIXELS: [u32; 8] = [0, 1, 2, 77, 1000, 65_535, 1 << 20, (1 << 31) + 5];

/// Samples of a pixel, and the one whose numbers are looked at.
const SAMPLES: u32 = 8;
const SAMPLE: u32 = 3;

/// What two numbers belong to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Between {
    /// Two surfaces of a pixel.
    Surfaces,
    /// The same surface of two runs.
    Seeds,
    /// The same surface in two pixels that follow each other on the curve, or lie beside
    /// each other in the picture.
    Pixels,
}

impl Between {
    /// All of them.
    pub const ALL: [Between; 3] = [Between::Surfaces, Between::Seeds, Between::Pixels];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Between::Surfaces => "two surfaces",
            Between::Seeds => "two seeds",
            Between::Pixels => "two neighbouring pixels",
        }
    }
}

/// The largest of several correlations.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Correlation {
    /// What is correlated.
    pub between: Between,
    /// Over the pixels of an image; else over the surfaces or seeds of single pixels.
    pub over_image: bool,
    /// Pearson's coefficient, the one that is farthest from 0; none where nothing varies.
    pub r: Option<f64>,
    /// Its distance from 0 in standard deviations of independent numbers.
    pub deviations: f64,
    /// Whether that is more than chance allows.
    pub correlated: bool,
}

/// A hash or a design, and what is correlated.
#[derive(Clone, Debug, Serialize)]
pub struct CorrelationRow {
    /// Its name.
    pub name: String,
    /// Whether two surfaces and two seeds are meant to be unrelated.
    pub promised: bool,
    /// Over images and in pixels, between surfaces, seeds and pixels.
    pub correlations: Vec<Correlation>,
}

impl CorrelationRow {
    /// What is correlated between two of a kind.
    pub fn get(&self, between: Between, over_image: bool) -> Option<&Correlation> {
        self.correlations.iter().find(|c| c.between == between && c.over_image == over_image)
    }
}

/// Pearson's coefficient, NaN where one side does not vary, and the number of pairs.
fn pearson(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let mut n = 0.0;
    let (mut a, mut b) = (0.0, 0.0);
    for (x, y) in pairs.clone() {
        n += 1.0;
        a += x;
        b += y;
    }
    let (a, b) = (a / n, b / n);
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xy += (x - a) * (y - b);
        xx += (x - a) * (x - a);
        yy += (y - b) * (y - b);
    }
    (if xx > 0.0 && yy > 0.0 { xy / (xx * yy).sqrt() } else { f64::NAN }, n)
}

/// Standard deviations beyond which one of `tests` is correlated.
fn threshold(tests: usize) -> f64 {
    let normal = Normal::standard();
    normal.inverse_cdf(1.0 - SIGNIFICANCE / tests.max(1) as f64 / 2.0)
}

/// The largest of the coefficients, of which `tests` there are in the whole table.
fn largest(
    between: Between,
    over_image: bool,
    tests: usize,
    all: impl Iterator<Item = (f64, f64)>,
) -> Correlation {
    let score = |(r, n): (f64, f64)| r * n.sqrt();
    let varies = all.filter(|(r, _)| !r.is_nan());
    let most = varies.max_by(|a, b| score(*a).abs().total_cmp(&score(*b).abs()));
    let deviations = most.map_or(0.0, |m| score(m).abs());
    let correlated = deviations > threshold(tests);
    Correlation { between, over_image, r: most.map(|m| m.0), deviations, correlated }
}

/// Every hash of reference values, its surfaces and seeds hashed first or not.
pub(super) fn hashes() -> Vec<CorrelationRow> {
    let all: Vec<(Values, &str)> = Values::all().collect();
    let tests = all.len() * 3 * LAGS.len() * (1 + PIXELS.len());
    let row = |(values, name): &(Values, &str)| {
        let of = |pixel, surface, seed| f64::from(values.at(SAMPLE, SAMPLES, pixel, surface, seed));
        // The same sample on both sides.
        let pair = |between, pixel: u32, i: u32, lag: u32| match between {
            Between::Surfaces => (of(pixel, i, 0), of(pixel, i.wrapping_add(lag), 0)),
            Between::Seeds => (of(pixel, 5, i), of(pixel, 5, i.wrapping_add(lag))),
            Between::Pixels => (of(pixel, i, 0), of(pixel.wrapping_add(lag), i, 0)),
        };
        let correlations = Between::ALL.into_iter().flat_map(|between| {
            let image = LAGS
                .into_iter()
                .map(|lag| pearson((0..COUNT).map(move |pixel| pair(between, pixel, 2, lag))));
            let single = PIXELS.into_iter().flat_map(|pixel| {
                LAGS.into_iter()
                    .map(move |lag| pearson((0..COUNT).map(move |i| pair(between, pixel, i, lag))))
            });
            [largest(between, true, tests, image), largest(between, false, tests, single)]
        });
        let Values { reference, prehash } = *values;
        let prehashed = if prehash { ", prehashed" } else { "" };
        // Neighbouring seeds of the second version stay related unless they are hashed first.
        let promised = reference.scrambles() && (prehash || reference != Reference::VegdahlV2);
        let name = format!("{name}{prehashed}");
        CorrelationRow { name, promised, correlations: correlations.collect() }
    };
    all.par_iter().map(row).collect()
}

/// Frame side and seeds of the pictures.
const SIDE: u32 = 64;
const SEEDS: u32 = 8;

/// What the pictures of random designs have in common: of one layer of alpha 0.3, the
/// second surface of each pixel after a black one, and the third.
///
/// # Errors
/// As [`Configured::replay`].
pub(super) fn pictures(designs: &[Configured]) -> Result<Vec<CorrelationRow>> {
    // What is drawn is the same; its surface is another, and so is what it belongs to.
    let surface = |before: u32| -> Result<Trace> {
        let black = (0..before).map(|i| layer(400 - i, [0.0; 3], 1.0));
        let seen = Fragment { primitive: before, object: before, ..layer(0, [1.0; 3], 0.3) };
        let case = Case { side: SIDE, ..Case::new(Group::Order, "correlation", "") };
        case.kind(black.chain([seen])).trace()
    };
    let traces = [surface(1)?, surface(2)?];
    let tests = designs.len() * 3 * SEEDS as usize * 2;
    let row = |design: &Configured| -> Result<CorrelationRow> {
        let picture = |trace: &Trace, seed| -> Result<Picture> {
            Ok(design.replay(trace, SAMPLES, seed, &ReplayOptions::default())?.picture)
        };
        let first: Vec<Picture> =
            (0..=SEEDS).map(|seed| picture(&traces[0], seed)).collect::<Result<_>>()?;
        let second: Vec<Picture> =
            (0..SEEDS).map(|seed| picture(&traces[1], seed)).collect::<Result<_>>()?;
        let seeds = || 0..SEEDS as usize;
        let over = |a: &Picture, b: &Picture, step: (u32, u32)| {
            let all = (0..SIDE - step.1).flat_map(|y| (0..SIDE - step.0).map(move |x| (x, y)));
            let pair = |(x, y): (u32, u32)| (a.get(x, y)[0], b.get(x + step.0, y + step.1)[0]);
            pearson(all.map(pair))
        };
        let correlations = vec![
            largest(
                Between::Surfaces,
                true,
                tests,
                seeds().map(|s| over(&first[s], &second[s], (0, 0))),
            ),
            largest(
                Between::Seeds,
                true,
                tests,
                seeds().map(|s| over(&first[s], &first[s + 1], (0, 0))),
            ),
            largest(
                Between::Pixels,
                true,
                tests,
                seeds().flat_map(|s| [(1, 0), (0, 1)].map(|step| over(&first[s], &first[s], step))),
            ),
        ];
        Ok(CorrelationRow { name: design.label(), promised: false, correlations })
    };
    designs.par_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_designs::configure;

    #[test]
    fn what_is_known_of_the_hashes_is_found() {
        let rows = hashes();
        let of = |name: &str| rows.iter().find(|r| r.name == name).unwrap();
        // Independent and fully scrambled numbers pass everywhere but where stratification
        // is meant to show.
        for name in ["white", "owen", "owen, prehashed"] {
            for c in &of(name).correlations {
                assert!(!c.correlated || c.between == Between::Pixels, "{name}: {c:?}");
            }
        }
        // What does not scramble is one sequence moved along.
        let moved = of("radical-inverse").get(Between::Surfaces, true).unwrap();
        assert!(moved.correlated && moved.r.unwrap().abs() > 0.1, "{moved:?}");
    }

    #[test]
    fn a_planted_correlation_is_found_in_pictures() {
        let of = |spec: &str| configure(spec, &[]).unwrap();
        let rows = pictures(&[of("enderton"), of("lk:reference=radical-inverse")]).unwrap();
        let seeds = |i: usize| rows[i].get(Between::Seeds, true).unwrap();
        assert!(!seeds(0).correlated, "{:?}", seeds(0));
        let surfaces = rows[1].get(Between::Surfaces, true).unwrap();
        assert!(surfaces.correlated, "{surfaces:?}");
    }
}
