//! Errors as they are left once the eye, or a filter after it, has averaged.

use crate::metrics::Region;
use crate::metrics::planes::error_planes;
use screendoor_trace::picture::Picture;
use screendoor_trace::tile::TileGrid;

/// Standard deviations beyond which the Gaussian is cut off.
const REACH: f64 = 4.0;

/// Root mean square error over the pixels and channels of `region`, in 8-bit units on
/// the pictures' own values, after the error of the whole frame was filtered with a Gaussian of
/// standard deviation `sigma` pixels.
///
/// The Gaussian is cut off at four deviations; what of it lies outside the frame is left
/// out and the rest has weight 1. A `sigma` of 0, or that is no positive number, filters
/// nothing. 0 for an empty region.
///
/// # Panics
/// Where the frames differ in size.
pub fn filtered_rmse(picture: &Picture, reference: &Picture, sigma: f64, region: &Region) -> f64 {
    let planes = error_planes(picture, reference);
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let (across, down) = (Gaussian::new(sigma, width), Gaussian::new(sigma, height));
    let mut sum = 0.0;
    for plane in planes {
        let filtered = down.columns(&across.rows(&plane, width), width);
        for (y, row) in filtered.chunks(width.max(1)).enumerate() {
            for (x, value) in row.iter().enumerate() {
                let (x, y) = (x as u16, y as u16);
                if region.holds(picture.grid().tile(x, y), TileGrid::within(x, y)) {
                    sum += value * value;
                }
            }
        }
    }
    (sum / (3 * region.pixels()).max(1) as f64).sqrt()
}

/// The filter along a line of so many pixels.
struct Gaussian {
    /// The middle tap and those to one side.
    taps: Vec<f64>,
    /// For each place on the line what the taps that lie on it add up to, inverted.
    scales: Vec<f64>,
}

impl Gaussian {
    fn new(sigma: f64, length: usize) -> Self {
        // No tap farther off than the line is long can meet it.
        let reach =
            if sigma > 0.0 { (REACH * sigma).ceil().min(length as f64) as usize } else { 0 };
        let taps: Vec<f64> = (0..=reach)
            .map(
                |k| if k == 0 { 1.0 } else { libm::exp(-((k * k) as f64) / (2.0 * sigma * sigma)) },
            )
            .collect();
        let scales = (0..length).map(|at| {
            let on_line = |k: usize| usize::from(at >= k) + usize::from(at + k < length);
            let sides: f64 = (1..=reach).map(|k| taps[k] * on_line(k) as f64).sum();
            1.0 / (taps[0] + sides)
        });
        Gaussian { scales: scales.collect(), taps }
    }

    fn rows(&self, plane: &[f64], width: usize) -> Vec<f64> {
        let mut result = vec![0.0; plane.len()];
        let rows = result.chunks_mut(width.max(1)).zip(plane.chunks(width.max(1)));
        for (to, from) in rows {
            for (k, tap) in self.taps.iter().enumerate() {
                add(&mut to[k.min(width)..], from, *tap);
                if k > 0 {
                    add(to, &from[k.min(width)..], *tap);
                }
            }
            for (value, scale) in to.iter_mut().zip(&self.scales) {
                *value *= scale;
            }
        }
        result
    }

    fn columns(&self, plane: &[f64], width: usize) -> Vec<f64> {
        let mut result = vec![0.0; plane.len()];
        let height = self.scales.len();
        let row = |y: usize| &plane[y * width..(y + 1) * width];
        for (y, to) in result.chunks_mut(width.max(1)).enumerate() {
            for (k, tap) in self.taps.iter().enumerate() {
                if y >= k {
                    add(to, row(y - k), *tap);
                }
                if k > 0 && y + k < height {
                    add(to, row(y + k), *tap);
                }
            }
            for value in to {
                *value *= self.scales[y];
            }
        }
        result
    }
}

/// Adds `from` times `tap` to `to`, as far as both go.
fn add(to: &mut [f64], from: &[f64], tap: f64) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += tap * from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::errors;
    use screendoor_trace::random::hash;

    fn frame(width: u32, height: u32) -> (Picture, Region) {
        let grid = TileGrid::new(width, height);
        (Picture::new(grid, [0.0; 3]), Region::frame(grid))
    }

    #[test]
    fn a_constant_error_stays() {
        let (reference, region) = frame(21, 13);
        let picture = Picture::new(reference.grid(), [0.1, -0.1, 0.1]);
        // Also where the filter is larger than the frame.
        for sigma in [0.0, 0.3, 1.0, 4.0, 100.0, 1e300, f64::NAN, -1.0] {
            let found = filtered_rmse(&picture, &reference, sigma, &region);
            assert!((found - 25.5).abs() < 1e-9, "{sigma}: {found}");
        }
    }

    #[test]
    fn no_filter_gives_the_plain_error() {
        let (reference, region) = frame(40, 30);
        let picture = Picture::from_fn(reference.grid(), |x, y| [f64::from(hash([x, y]) >> 28); 3]);
        let plain = errors(&picture, &reference, &region).rmse;
        assert!((filtered_rmse(&picture, &reference, 0.0, &region) / plain - 1.0).abs() < 1e-12);
    }

    #[test]
    fn an_impulse_becomes_the_gaussian() {
        let (reference, region) = frame(41, 41);
        let mut picture = reference.clone();
        let tile = reference.grid().tile(20, 20);
        picture.tile_mut(tile)[TileGrid::within(20, 20)] = [1.0; 3];
        let sigma = 1.5;
        let taps: Vec<f64> =
            (-6..=6).map(|k| (-f64::from(k * k) / (2.0 * sigma * sigma)).exp()).collect();
        let sum: f64 = taps.iter().sum();
        let square: f64 = taps.iter().map(|t| t * t / (sum * sum)).sum();
        let expected = 255.0 * square / 41.0;
        let found = filtered_rmse(&picture, &reference, sigma, &region);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    }

    #[test]
    fn white_noise_falls_by_the_known_factor() {
        let (reference, region) = frame(256, 192);
        let unit = |x, y, c| f64::from(hash([x, y, c])) / 2_f64.powi(32) - 0.5;
        let picture = Picture::from_fn(reference.grid(), |x, y| [0, 1, 2].map(|c| unit(x, y, c)));
        let plain = filtered_rmse(&picture, &reference, 0.0, &region);
        for sigma in [0.7, 1.0, 2.0] {
            let taps = |f: fn(f64) -> f64| -> f64 {
                (-20..=20).map(|k| f((-f64::from(k * k) / (2.0 * sigma * sigma)).exp())).sum()
            };
            // √Σw² in two dimensions; edges, where fewer pixels are averaged, add little.
            let factor = taps(|t| t * t) / taps(|t| t).powi(2);
            let found = filtered_rmse(&picture, &reference, sigma, &region) / plain;
            assert!((found / factor - 1.0).abs() < 0.03, "{sigma}: {found}, not {factor}");
        }
    }
}
