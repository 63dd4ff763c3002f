//! Errors over several seeds, variance and bias apart.

use std::borrow::Cow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::metrics::temporal::Deviations;
use crate::metrics::{Encoded, Errors, Estimate, ROUNDING, Region, Temporal, UNIT};
use screendoor_trace::picture::{Picture, TilePixels};
use screendoor_trace::tile::{TILE_PIXELS, TileMap};

/// Runs whose deviation is less than this agree, as a share of the range from black to white.
const AGREEMENT: f64 = 1e-3;

/// Something as probable as this, divided by how many runs there are, is missed by all of them
/// once in 10^9 times: e^-RARE.
const RARE: f64 = 20.7;

/// Gathers the pictures of independent seeds against one reference, over one or
/// more regions of the frame.
#[derive(Debug)]
pub struct Ensemble<'a> {
    reference: &'a Picture,
    encoded: Cow<'a, Encoded>,
    regions: Vec<&'a Region>,
    /// One row a region, one entry a run.
    runs: Vec<Vec<Errors>>,
    /// Sums over the runs of the error and of its square, at each pixel.
    sums: TileMap<(TilePixels, TilePixels)>,
    /// One row a region, one entry for every two runs: the mean of the product of their
    /// errors, whose expectation is the squared bias.
    products: Vec<Vec<f64>>,
    /// A run that has no second one yet.
    waiting: Option<Picture>,
    /// The same as `sums` of the untouched pixels' common error.
    rest: ([f64; 3], [f64; 3]),
}

/// The errors of a design over several seeds, in 8-bit units.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct EnsembleErrors {
    /// How many seeds.
    pub seeds: usize,
    /// How many pixels.
    pub pixels: u64,
    /// Root of the mean square error on the pictures' own values.
    pub rmse: Estimate,
    /// Root of the mean square error on sRGB-encoded values.
    pub rmse_srgb: Estimate,
    /// Mean of picture minus reference, on the pictures' own values.
    pub mean: Estimate,
    /// Largest absolute difference of any run, on the same.
    pub max: f64,
    /// Mean over pixels and channels of the variance over seeds; in squared
    /// units. `None` for a single seed.
    pub variance: Option<f64>,
    /// Mean over pixels and channels of the squared bias, estimated without bias
    /// of its own: scatters around 0 for an unbiased design, so it can be
    /// negative. In squared units; `None` for a single seed. The half-width of its
    /// interval is that of the mean of products of two runs' errors, no run in two of
    /// them: never too narrow, as the estimate itself averages over all such pairings.
    /// Below four seeds it is infinite.
    pub bias_squared: Option<Estimate>,
    /// What a viewer of a pixel sees over frames of different seeds; `None` for a single
    /// seed or an empty region.
    pub temporal: Option<Temporal>,
}

impl<'a> Ensemble<'a> {
    /// An ensemble without runs.
    pub fn new(reference: &'a Picture, regions: &[&'a Region]) -> Self {
        Self::begin(reference, Cow::Owned(Encoded::of(reference)), regions)
    }

    /// The same against a reference that was encoded before.
    pub fn against(reference: &'a Picture, encoded: &'a Encoded, regions: &[&'a Region]) -> Self {
        Self::begin(reference, Cow::Borrowed(encoded), regions)
    }

    fn begin(reference: &'a Picture, encoded: Cow<'a, Encoded>, regions: &[&'a Region]) -> Self {
        Ensemble {
            reference,
            encoded,
            regions: regions.to_vec(),
            runs: vec![Vec::new(); regions.len()],
            sums: TileMap::new(reference.grid()),
            products: vec![Vec::new(); regions.len()],
            waiting: None,
            rest: ([0.0; 3], [0.0; 3]),
        }
    }

    /// Adds the picture of one seed.
    ///
    /// # Panics
    /// Where its frame differs from the reference's.
    pub fn add(&mut self, picture: &Picture) {
        let found = self.errors(picture);
        self.put(picture, found);
    }

    /// Adds those of several, in their order; looks at them side by side.
    ///
    /// # Panics
    /// As [`Ensemble::add`].
    pub fn add_all(&mut self, pictures: &[Picture]) {
        let found: Vec<Vec<Errors>> = pictures.par_iter().map(|p| self.errors(p)).collect();
        pictures.iter().zip(found).for_each(|(picture, found)| self.put(picture, found));
    }

    fn errors(&self, picture: &Picture) -> Vec<Errors> {
        self.encoded.errors(picture, self.reference, &self.regions)
    }

    fn put(&mut self, picture: &Picture, found: Vec<Errors>) {
        let reference = self.reference;
        for (runs, found) in self.runs.iter_mut().zip(found) {
            runs.push(found);
        }
        match self.waiting.take() {
            None => self.waiting = Some(picture.clone()),
            Some(first) => {
                for (products, region) in self.products.iter_mut().zip(&self.regions) {
                    products.push(mean_product(&first, picture, reference, region));
                }
            }
        }
        let add = |sum: &mut [f64; 3], square: &mut [f64; 3], a: [f64; 3], b: [f64; 3]| {
            for i in 0..3 {
                let difference = a[i] - b[i];
                sum[i] += difference;
                square[i] += difference * difference;
            }
        };
        // A tile that earlier runs did not touch had their common error so far.
        let rest = self.rest;
        let mut tiles = picture.tiles_with(reference);
        tiles.extend(self.sums.touched().iter().map(|(tile, _)| *tile));
        tiles.sort_unstable();
        tiles.dedup();
        for tile in tiles {
            let (sum, square) = self.sums.get_or_insert_with(tile, || {
                (Box::new([rest.0; TILE_PIXELS]), Box::new([rest.1; TILE_PIXELS]))
            });
            let (a, b) = (picture.tile(tile), reference.tile(tile));
            for within in 0..TILE_PIXELS {
                add(
                    &mut sum[within],
                    &mut square[within],
                    a.map_or(picture.background(), |t| t[within]),
                    b.map_or(reference.background(), |t| t[within]),
                );
            }
        }
        add(&mut self.rest.0, &mut self.rest.1, picture.background(), reference.background());
    }

    /// Calls `each` with the mean errors and the variances over the runs of the
    /// channels of every pixel of `region`, and with how many pixels have just these: 1,
    /// or all that no run has touched.
    fn for_each_pixel(&self, region: &Region, mut each: impl FnMut([f64; 3], [f64; 3], u64)) {
        let n = self.runs.first().map_or(0, Vec::len) as f64;
        let mut pixel = |sum: &[f64; 3], square: &[f64; 3], times| {
            let mean = sum.map(|s| s / n);
            let variance = |i: usize| ((square[i] - sum[i] * mean[i]) / (n - 1.0)).max(0.0);
            each(mean, std::array::from_fn(variance), times);
        };
        let mut visited = 0;
        for (tile, (sum, square)) in self.sums.touched() {
            for within in region.of_tile(*tile).iter_ones() {
                pixel(&sum[within], &square[within], 1);
                visited += 1;
            }
        }
        if region.pixels() > visited {
            pixel(&self.rest.0, &self.rest.1, region.pixels() - visited);
        }
    }

    /// For every channel of every pixel of the region at place `region` (of those that
    /// no run touched, one for all):
    /// the mean error over the runs less [`ROUNDING`], in units of its standard error, and less what so many
    /// runs may have missed where they agree. 0 where
    /// all runs agree with the reference, infinite where they agree with each other
    /// and not with it.
    pub fn z_scores(&self, region: usize) -> Vec<f64> {
        let n = self.runs[region].len() as f64;
        let mut scores = Vec::new();
        self.for_each_pixel(self.regions[region], |means, variances, _| {
            for (mean, variance) in means.into_iter().zip(variances) {
                // Rounding is no chance: where there is nearly none of that, it would count as
                // a bias. So would what is too rare to have happened in so many runs, where
                // they agree because of that.
                let agree = variance < AGREEMENT * AGREEMENT;
                let unseen = if agree { RARE / n } else { 0.0 };
                let beyond = (mean.abs() - ROUNDING * UNIT - unseen).max(0.0).copysign(mean);
                scores.push(if beyond == 0.0 { 0.0 } else { beyond / (variance / n).sqrt() });
            }
        });
        scores
    }

    /// The errors over the runs so far, region by region.
    pub fn finish(&self) -> Vec<EnsembleErrors> {
        (0..self.regions.len()).map(|region| self.over(region)).collect()
    }

    fn over(&self, place: usize) -> EnsembleErrors {
        let (region, runs) = (self.regions[place], &self.runs[place]);
        let products = &self.products[place];
        let n = runs.len() as f64;
        let squares = |f: fn(&Errors) -> f64| {
            let squares: Vec<f64> = runs.iter().map(|r| f(r) * f(r)).collect();
            Estimate::of(&squares).sqrt()
        };
        let means: Vec<f64> = runs.iter().map(|r| r.mean).collect();
        let (mut variance, mut bias_squared) = (0.0, 0.0);
        let mut deviations = Deviations::default();
        if runs.len() > 1 {
            self.for_each_pixel(region, |means, variances, pixels| {
                for (mean, v) in means.into_iter().zip(variances) {
                    variance += v * pixels as f64;
                    // E[mean²] = bias² + v/n.
                    bias_squared += (mean * mean - v / n) * pixels as f64;
                }
                deviations.add((variances.iter().sum::<f64>() / 3.0).sqrt() / UNIT, pixels);
            });
        }
        let scale = 1.0 / ((3 * region.pixels()).max(1) as f64 * UNIT * UNIT);
        let known = |v: f64| (runs.len() > 1).then_some(v * scale);
        EnsembleErrors {
            seeds: runs.len(),
            pixels: region.pixels(),
            rmse: squares(|r| r.rmse),
            rmse_srgb: squares(|r| r.rmse_srgb),
            mean: Estimate::of(&means),
            max: runs.iter().map(|r| r.max).fold(0.0, f64::max),
            variance: known(variance),
            bias_squared: known(bias_squared).map(|value| {
                let half = match products.len() {
                    0 | 1 => f64::INFINITY,
                    _ => Estimate::of(products).half_width(),
                };
                Estimate::around(value, half)
            }),
            temporal: deviations.finish(),
        }
    }
}

/// The mean over a region's pixels and channels of the product of two pictures' errors, in
/// squared 8-bit units.
fn mean_product(a: &Picture, b: &Picture, reference: &Picture, region: &Region) -> f64 {
    let mut tiles = [a.tiles_with(reference), b.tiles_with(reference)].concat();
    tiles.sort_unstable();
    tiles.dedup();
    let product = |a: [f64; 3], b: [f64; 3], r: [f64; 3]| -> f64 {
        (0..3).map(|i| (a[i] - r[i]) * (b[i] - r[i])).sum()
    };
    let (mut sum, mut visited) = (0.0, 0);
    for tile in tiles {
        let [a, b, r] = [a, b, reference].map(|p| (p.tile(tile), p.background()));
        for within in region.of_tile(tile).iter_ones() {
            let [a, b, r] = [a, b, r].map(|(t, rest)| t.map_or(rest, |t| t[within]));
            sum += product(a, b, r);
            visited += 1;
        }
    }
    let rest = product(a.background(), b.background(), reference.background());
    sum += rest * (region.pixels() - visited) as f64;
    sum / (3 * region.pixels()).max(1) as f64 / (UNIT * UNIT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::random::hash;
    use screendoor_trace::tile::TileGrid;

    #[test]
    fn variance_and_bias_come_apart() {
        let grid = TileGrid::new(48, 48);
        let reference = Picture::from_fn(grid, |_, _| [0.5; 3]);
        let region = Region::frame(grid);
        let mut ensemble = Ensemble::new(&reference, &[&region]);
        let unit = |words| f64::from(hash::<4>(words)) / 2_f64.powi(32);
        // Uniform noise of variance 0.2²/12 with a bias of 0.03.
        for seed in 0..40 {
            ensemble.add(&Picture::from_fn(grid, |x, y| {
                std::array::from_fn(|c| 0.53 + 0.2 * (unit([seed, x, y, c as u32]) - 0.5))
            }));
        }
        let e = &ensemble.finish()[0];
        let unit = 255.0 * 255.0;
        let (variance, bias) = (e.variance.unwrap() / unit, e.bias_squared.unwrap().value / unit);
        assert!((variance - 0.04 / 12.0).abs() < 1e-4, "{variance}");
        assert!((bias - 0.03 * 0.03).abs() < 1e-5, "{bias}");
        let interval = e.bias_squared.unwrap();
        assert!(interval.low > 0.0 && interval.half_width() < 0.2 * interval.value, "{interval:?}");
        assert!((e.mean.value / 255.0 - 0.03).abs() < 1e-3);
        assert!(e.mean.low > 0.0);
        let rmse = (variance + bias).sqrt() * 255.0;
        assert!((e.rmse.value / rmse - 1.0).abs() < 1e-2 && e.rmse.low < e.rmse.value);
        // Records can be read back; serde_json may miss a number's last bit.
        let json = serde_json::to_string(e).unwrap();
        let back: EnsembleErrors = serde_json::from_str(&json).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-15 * b.abs();
        assert_eq!((back.seeds, back.pixels), (e.seeds, e.pixels));
        assert!(near(back.rmse.value, e.rmse.value) && near(back.max, e.max));
        let p95 = |e: &EnsembleErrors| e.temporal.unwrap().deviation_p95;
        assert!(near(p95(&back), p95(e)) && near(back.variance.unwrap(), e.variance.unwrap()));
    }

    #[test]
    fn the_squared_bias_of_noise_has_0_in_its_interval() {
        let grid = TileGrid::new(16, 16);
        let reference = Picture::from_fn(grid, |_, _| [0.5; 3]);
        let region = Region::frame(grid);
        let unit = |words| f64::from(hash::<4>(words)) / 2_f64.powi(32);
        let (mut missed, mut negative) = (0, 0);
        for trial in 0..400 {
            let mut ensemble = Ensemble::new(&reference, &[&region]);
            for seed in 0..6 {
                ensemble.add(&Picture::from_fn(grid, |x, y| {
                    std::array::from_fn(|c| unit([trial * 6 + seed, x, y, c as u32]))
                }));
            }
            let e = ensemble.finish()[0].bias_squared.unwrap();
            missed += u32::from(e.low > 0.0 || e.high < 0.0);
            negative += u32::from(e.value < 0.0);
        }
        // 5 % of 400 at most, plus three standard deviations; about half below 0.
        assert!(missed <= 20 + 13, "{missed}");
        assert!((170..230).contains(&negative), "{negative}");
    }

    #[test]
    fn a_bias_stands_out_in_the_z_scores() {
        let grid = TileGrid::new(16, 16);
        let reference = Picture::from_fn(grid, |_, _| [0.0; 3]);
        let region = Region::frame(grid);
        let mut ensemble = Ensemble::new(&reference, &[&region]);
        for seed in 0..100_u32 {
            // ±1 in turn, but for one pixel that is always 1.
            let sign = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
            ensemble.add(&Picture::from_fn(grid, |x, y| {
                if (x, y) == (5, 5) { [1.0; 3] } else { [sign; 3] }
            }));
        }
        let scores = ensemble.z_scores(0);
        assert_eq!(scores.iter().filter(|z| z.is_infinite()).count(), 3);
        assert_eq!(scores.iter().filter(|z| **z == 0.0).count(), 3 * 255);
    }

    #[test]
    fn tiles_that_only_some_runs_touch_count_in_all() {
        let grid = TileGrid::new(32, 16);
        let reference = Picture::new(grid, [0.0; 3]);
        let region = Region::frame(grid);
        let mut ensemble = Ensemble::new(&reference, &[&region]);
        let mut touched = Picture::new(grid, [1.0; 3]);
        touched.tile_mut(grid.tile(0, 0)).fill([3.0; 3]);
        ensemble.add(&Picture::new(grid, [1.0; 3]));
        ensemble.add(&touched);
        ensemble.add(&Picture::new(grid, [1.0; 3]));
        let e = &ensemble.finish()[0];
        // Half of the pixels have 1, 3, 1: variance 4/3 about 5/3; the others 1 always.
        assert!((e.variance.unwrap() * UNIT * UNIT - 2.0 / 3.0).abs() < 1e-12);
        let bias_squared = (25.0 / 9.0 - 4.0 / 9.0 + 1.0) / 2.0;
        let found = e.bias_squared.unwrap();
        assert!((found.value * UNIT * UNIT - bias_squared).abs() < 1e-12);
        // Three runs make one product: (1·3 + 1·1) / 2, and no interval.
        assert!((ensemble.products[0][0] * UNIT * UNIT - 2.0).abs() < 1e-12);
        assert_eq!((found.low, found.high), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(ensemble.z_scores(0).len(), 3 * (256 + 1));
        // Half of the pixels flicker.
        let t = e.temporal.unwrap();
        let flicker = (4.0_f64 / 3.0).sqrt() * 255.0;
        assert!(t.deviation_median == 0.0 && (t.deviation_p95 / flicker - 1.0).abs() < 1e-6);
        assert!((t.deviation_max / flicker - 1.0).abs() < 1e-6);
    }
}
