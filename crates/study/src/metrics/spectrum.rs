//! How errors are spread over spatial frequencies: noise of high frequency ("blue") is
//! averaged away by the eye, and by filters, sooner than noise of low frequency.

use realfft::{RealFftPlanner, RealToComplex};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use crate::metrics::planes::error_planes;
use screendoor_trace::picture::Picture;

/// How many bins lie between 0 and half a cycle per pixel.
const BINS: usize = 32;
/// What counts as low frequency, in cycles per pixel.
const LOW: f64 = 0.125;
/// Variances up to this, in squared 8-bit units, are rounding.
const ROUNDING: f64 = 1e-18;
/// No spectrum is called bluer than this, in decibels: beyond it lies rounding, too.
const BLUEST: f64 = 100.0;

/// The radially averaged power spectrum of a picture's error (Ulichney 1988), averaged
/// over the three channels.
///
/// Densities are in squared 8-bit units: white noise of variance v in each channel has a
/// density of v at every frequency. The error's mean (frequency 0) is left out.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Spectrum {
    /// The middles of the bins, in cycles per pixel: 32 rings of equal width from 0 to
    /// 0.5, less those that hold no frequency of the frame (where it is small).
    pub frequency: Vec<f64>,
    /// The mean density in each bin.
    pub power: Vec<f64>,
    /// How many of the frame's frequencies lie in each bin.
    pub cells: Vec<u64>,
    /// The mean density over all frequencies but 0, those of the corners beyond 0.5 cycles
    /// per pixel, which are in no bin, included: the error's sample variance (Parseval).
    pub variance: f64,
}

impl Spectrum {
    /// The spectrum of `picture` minus `reference`. One pixel has an empty one.
    ///
    /// # Panics
    /// Where the frames differ in size.
    pub fn of(picture: &Picture, reference: &Picture) -> Self {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let mut sums = PowerSums { power: [0.0; BINS], cells: [0; BINS], all: 0.0 };
        let pixels = width * height;
        if pixels > 1 {
            let mut transform = Transform::new(width, height);
            for mut plane in error_planes(picture, reference) {
                // Less rounding than to leave the mean for the transform to find.
                let mean = plane.iter().sum::<f64>() / pixels as f64;
                plane.iter_mut().for_each(|v| *v -= mean);
                transform.add(&mut plane, &mut sums);
            }
        }
        let scale = 1.0 / (3 * pixels.max(1)) as f64;
        let held = || (0..BINS).filter(|bin| sums.cells[*bin] > 0);
        // All three channels' cells were counted.
        let cells = |bin: usize| sums.cells[bin] / 3;
        Spectrum {
            frequency: held().map(|b| (b as f64 + 0.5) * 0.5 / BINS as f64).collect(),
            power: held().map(|b| sums.power[b] * scale / cells(b) as f64).collect(),
            cells: held().map(cells).collect(),
            variance: sums.all * scale / pixels.saturating_sub(1).max(1) as f64,
        }
    }

    /// The mean of the spectra of several seeds; `None` for none, or where they are of
    /// frames of different sizes.
    pub fn mean(spectra: &[Spectrum]) -> Option<Spectrum> {
        let mut mean = spectra.first()?.clone();
        if spectra.iter().any(|s| s.frequency != mean.frequency || s.cells != mean.cells) {
            return None;
        }
        let n = spectra.len() as f64;
        for (bin, power) in mean.power.iter_mut().enumerate() {
            *power = spectra.iter().filter_map(|s| s.power.get(bin)).sum::<f64>() / n;
        }
        mean.variance = spectra.iter().map(|s| s.variance).sum::<f64>() / n;
        Some(mean)
    }

    /// How blue the error is, in decibels: 10 log10 of its mean density over all
    /// frequencies by that below 1/8 cycle per pixel. 0 for white noise, positive where
    /// low frequencies are weaker (at most 100), negative where they are stronger, as in
    /// errors with structure.
    ///
    /// White noise that is stronger in some places than in others stays white, so an error
    /// only where fragments are needs no mask. `None` where there is no error (but for its
    /// mean), or no frequency below 1/8.
    pub fn blueness(&self) -> Option<f64> {
        let low = || {
            self.frequency.iter().zip(&self.power).zip(&self.cells).filter(|((f, _), _)| **f < LOW)
        };
        let cells: u64 = low().map(|(_, cells)| cells).sum();
        let sum: f64 = low().map(|((_, power), cells)| power * *cells as f64).sum();
        if cells == 0 || !self.variance.is_finite() || self.variance <= ROUNDING {
            return None;
        }
        let ratio = self.variance * cells as f64 / sum;
        Some((10.0 * libm::log10(ratio)).min(BLUEST))
    }
}

/// Sums of squared transforms over the bins, and over all frequencies but 0.
struct PowerSums {
    power: [f64; BINS],
    cells: [u64; BINS],
    all: f64,
}

/// The transform of a frame in two dimensions, by real transforms alone.
struct Transform {
    width: usize,
    height: usize,
    along_rows: Arc<dyn RealToComplex<f64>>,
    along_columns: Arc<dyn RealToComplex<f64>>,
}

impl Transform {
    fn new(width: usize, height: usize) -> Self {
        let mut planner = RealFftPlanner::new();
        Transform {
            width,
            height,
            along_rows: planner.plan_fft_forward(width),
            along_columns: planner.plan_fft_forward(height),
        }
    }

    /// Adds the power of `plane` at each frequency; the plane is lost.
    ///
    /// A row's transform at one frequency gives a column of complex numbers r + i·s, and
    /// the transforms R and S of both parts that of the column: R + i·S at a frequency f,
    /// and the conjugate of R − i·S at −f. The two lie in one ring, and their squares add up
    /// to 2|R|² + 2|S|². At 0 and at the highest frequency of an even size, where R and S
    /// are real, the one square is |R|² + |S|².
    fn add(&mut self, plane: &mut [f64], sums: &mut PowerSums) {
        let (width, height) = (self.width, self.height);
        let half = width / 2 + 1;
        let mut row = self.along_rows.make_output_vec();
        // Column by column, real parts before imaginary ones.
        let mut columns = vec![0.0; half * 2 * height];
        for (y, line) in plane.chunks_exact_mut(width).enumerate() {
            // Fails only on lengths other than the plan's.
            if self.along_rows.process(line, &mut row).is_err() {
                return;
            }
            for (kx, value) in row.iter().enumerate() {
                columns[kx * 2 * height + y] = value.re;
                columns[(kx * 2 + 1) * height + y] = value.im;
            }
        }
        let mut column = self.along_columns.make_output_vec();
        let mut power = vec![0.0; column.len()];
        // Frequencies other than 0 and the highest stand for two of opposite sign.
        let times = |k: usize, size: usize| if k == 0 || 2 * k == size { 1 } else { 2 };
        for (kx, parts) in columns.chunks_exact_mut(2 * height).enumerate() {
            power.fill(0.0);
            for part in parts.chunks_exact_mut(height) {
                if self.along_columns.process(part, &mut column).is_err() {
                    return;
                }
                for (power, value) in power.iter_mut().zip(&column) {
                    *power += value.norm_sqr();
                }
            }
            for (ky, power) in power.iter().enumerate() {
                if (kx, ky) == (0, 0) {
                    continue;
                }
                let cells = times(kx, width) * times(ky, height);
                sums.all += power * cells as f64;
                let (fx, fy) = (kx as f64 / width as f64, ky as f64 / height as f64);
                let frequency = libm::sqrt(fx * fx + fy * fy);
                if frequency <= 0.5 {
                    let bin = ((frequency * 2.0 * BINS as f64) as usize).min(BINS - 1);
                    sums.power[bin] += power * cells as f64;
                    sums.cells[bin] += cells;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::random::hash;
    use screendoor_trace::tile::TileGrid;

    /// Uniform noise in [−1/2, 1/2) of one seed.
    fn noise(x: u32, y: u32, seed: u32) -> f64 {
        f64::from(hash([x, y, seed])) / 2_f64.powi(32) - 0.5
    }

    fn spectrum(width: u32, height: u32, error: impl Fn(u32, u32) -> f64) -> Spectrum {
        let grid = TileGrid::new(width, height);
        let picture = Picture::from_fn(grid, |x, y| [0.3 + error(x, y), 0.3, 0.3 - error(x, y)]);
        Spectrum::of(&picture, &Picture::new(grid, [0.3; 3]))
    }

    /// The variance of uniform noise in two of three channels, in squared 8-bit units.
    const WHITE: f64 = 255.0 * 255.0 / 12.0 * 2.0 / 3.0;

    #[test]
    fn white_noise_is_flat() {
        let s = spectrum(256, 256, |x, y| noise(x, y, 1));
        assert_eq!((s.frequency.len(), s.power.len()), (32, 32));
        assert!((s.frequency[0] - 1.0 / 128.0).abs() < 1e-12);
        assert!((s.variance / WHITE - 1.0).abs() < 0.02, "{}", s.variance);
        for (power, cells) in s.power.iter().zip(&s.cells) {
            // Opposite frequencies are equal: half as many independent exponentials. Both
            // channels have the same noise. 4.5 deviations each.
            let deviation = (2.0 / *cells as f64).sqrt();
            assert!((power / WHITE - 1.0).abs() < 4.5 * deviation, "{power} of {WHITE}");
        }
        // 3215 frequencies lie below 1/8: a deviation of 0.11 dB.
        assert!(s.blueness().unwrap().abs() < 0.4, "{:?}", s.blueness());
    }

    #[test]
    fn an_envelope_keeps_white_noise_white() {
        let inside = |x: u32, y: u32| x.abs_diff(120).pow(2) + y.abs_diff(90).pow(2) < 60 * 60;
        let spectra: Vec<Spectrum> = (0..4)
            .map(|seed| {
                spectrum(256, 200, |x, y| if inside(x, y) { noise(x, y, seed) } else { 0.0 })
            })
            .collect();
        let blueness = Spectrum::mean(&spectra).unwrap().blueness().unwrap();
        assert!(blueness.abs() < 0.4, "{blueness}");
    }

    #[test]
    fn blue_is_positive_and_blurred_negative() {
        // A difference of neighbours has no low frequencies, a sum few high ones.
        let neighbours = |sign: f64| {
            spectrum(128, 96, |x, y| {
                let at = |dx, dy| noise(x + dx, y + dy, 3);
                at(0, 0) + sign * (at(1, 0) + at(0, 1)) + at(1, 1)
            })
        };
        let (blue, red) =
            (neighbours(-1.0).blueness().unwrap(), neighbours(1.0).blueness().unwrap());
        assert!(blue > 6.0 && red < -4.0, "{blue} {red}");
        // Stripes of two pixels have a single frequency, a checkerboard one beyond all bins.
        for parity in [|x: u32, _: u32| x % 2, |x: u32, y: u32| (x + y) % 2] {
            let s = spectrum(64, 64, |x, y| f64::from(parity(x, y)));
            assert!(s.blueness().unwrap() >= 80.0, "{:?}", s.blueness());
        }
    }

    /// Σ density over all frequencies is the variance; the bins and the corners hold all.
    #[test]
    fn densities_add_up_to_the_variance() {
        for (width, height) in [(16, 16), (15, 9), (8, 31), (64, 1), (1, 10), (2, 2)] {
            let s = spectrum(width, height, |x, y| noise(x, y, 9));
            let values: Vec<f64> =
                (0..width * height).map(|i| 255.0 * noise(i % width, i / width, 9)).collect();
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
            assert!((s.variance / (variance * 2.0 / 3.0) - 1.0).abs() < 1e-9, "{width}×{height}");
            assert!(s.cells.iter().sum::<u64>() < u64::from(width * height));
        }
        // In one dimension there are no corners: the bins alone make up the variance.
        let s = spectrum(64, 1, |x, y| noise(x, y, 9));
        assert_eq!(s.cells.iter().sum::<u64>(), 63);
        let sum: f64 = s.power.iter().zip(&s.cells).map(|(p, c)| p * *c as f64).sum();
        assert!((sum / 63.0 / s.variance - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_wave_lies_in_its_bin() {
        use std::f64::consts::TAU;
        // 5/60 and 6/72 cycles per pixel: a frequency of 0.1179, in the eighth bin.
        let s = spectrum(60, 72, |x, y| {
            (TAU * (f64::from(x) * 5.0 / 60.0 - f64::from(y) * 6.0 / 72.0)).cos()
        });
        let most = s.power.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
        assert!((s.frequency[most] - 7.5 / 64.0).abs() < 1e-12);
        let rest: f64 = s.power.iter().sum::<f64>() - s.power[most];
        assert!(rest < 1e-9 * s.power[most]);
    }

    #[test]
    fn no_error_has_no_colour() {
        assert_eq!(spectrum(32, 32, |_, _| 0.0).blueness(), None);
        assert_eq!(spectrum(32, 32, |_, _| 0.1).blueness(), None);
        let one = spectrum(1, 1, |_, _| 0.5);
        assert_eq!((one.blueness(), one.power.len(), one.variance), (None, 0, 0.0));
        // No frequency below 1/8.
        assert_eq!(spectrum(4, 4, |x, y| noise(x, y, 1)).blueness(), None);
        assert_eq!(spectrum(32, 32, |_, y| if y == 3 { f64::NAN } else { 0.0 }).blueness(), None);
        assert_eq!(Spectrum::mean(&[]), None);
        assert_eq!(Spectrum::mean(&[one, spectrum(9, 9, noise_of_one)]), None);
    }

    fn noise_of_one(x: u32, y: u32) -> f64 {
        noise(x, y, 1)
    }
}
