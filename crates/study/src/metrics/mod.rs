//! How far a picture is from the exact one.
//!
//! Errors are in 8-bit units: 1 is 1/255 of the range from black to white. They are taken of
//! the pictures' own values: where those are linear, as they are unless a trace says
//! otherwise, they are errors of the light itself; on sRGB-encoded ones, those of the numbers
//! that an 8-bit display would be sent.
//!
//! Beside them stand what a viewer would see of an error ([`Flip`]), how it is spread over
//! spatial frequencies ([`Spectrum`]), what a filter leaves of it ([`filtered_rmse`]), how
//! it changes from frame to frame ([`Temporal`]) and how it falls with the number of
//! samples ([`Convergence`]).

mod convergence;
mod encoded;
mod ensemble;
mod estimate;
mod filtered;
mod flip;
mod planes;
mod region;
mod spectrum;
mod temporal;

use serde::{Deserialize, Serialize};

pub use convergence::Convergence;
pub use encoded::Encoded;
pub use ensemble::{Ensemble, EnsembleErrors};
pub use estimate::{Estimate, student_t};
pub use filtered::filtered_rmse;
pub use flip::{BRIGHTEST, Flip, FlipFigures, FlipMap, PIXELS_PER_DEGREE};
pub use region::{PixelClasses, Region};
pub use spectrum::Spectrum;
pub use temporal::Temporal;

use screendoor_trace::picture::Picture;

/// What one unit of an error is of the range from black to white.
pub(crate) const UNIT: f64 = 1.0 / 255.0;

/// An error of this size, in 8-bit units, is one of rounding: of sums in single precision, or of
/// what is kept in 2^-20ths. Beyond it a mean error may be told from chance.
pub const ROUNDING: f64 = 1e-3;

/// The error of one picture over a region, in 8-bit units.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Errors {
    /// How many pixels it is over.
    pub pixels: u64,
    /// Root mean square over pixels and channels, on the pictures' own values.
    pub rmse: f64,
    /// The same on sRGB-encoded values, clamped to their range.
    pub rmse_srgb: f64,
    /// Mean of picture minus reference, on the same.
    pub mean: f64,
    /// Largest absolute difference of a channel, on the same.
    pub max: f64,
}

/// The errors of `picture` against `reference` over `region`.
///
/// # Panics
/// Where the frames differ in size.
pub fn errors(picture: &Picture, reference: &Picture, region: &Region) -> Errors {
    Encoded::of(reference).errors(picture, reference, &[region]).swap_remove(0)
}

/// [`Errors::rmse`] alone, which takes no encoding.
///
/// # Panics
/// Where the frames differ in size.
pub fn rmse(picture: &Picture, reference: &Picture, region: &Region) -> f64 {
    assert_eq!((picture.grid(), picture.space()), (reference.grid(), reference.space()));
    let (mut square, mut visited) = (0.0, 0);
    let mut add = |a: [f64; 3], b: [f64; 3], times: u64| {
        for (a, b) in a.into_iter().zip(b) {
            square += (a - b) * (a - b) * times as f64;
        }
    };
    for tile in picture.tiles_with(reference) {
        let (a, b) = (picture.tile(tile), reference.tile(tile));
        for within in region.of_tile(tile).iter_ones() {
            visited += 1;
            add(
                a.map_or(picture.background(), |t| t[within]),
                b.map_or(reference.background(), |t| t[within]),
                1,
            );
        }
    }
    // The rest of the region shows both backgrounds.
    if region.pixels() > visited {
        add(picture.background(), reference.background(), region.pixels() - visited);
    }
    root(square, region.pixels())
}

/// The root of a mean over a region's pixels and channels, in 8-bit units.
fn root(square: f64, pixels: u64) -> f64 {
    (square / (3 * pixels).max(1) as f64).sqrt() / UNIT
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::tile::TileGrid;

    #[test]
    fn errors_of_known_differences() {
        let grid = TileGrid::new(20, 10);
        let reference = Picture::from_fn(grid, |_, _| [0.5; 3]);
        // One of 200 pixels is off by 0.3 in one channel, another by −0.1 in all.
        let picture = Picture::from_fn(grid, |x, y| match (x, y) {
            (3, 3) => [0.8, 0.5, 0.5],
            (17, 0) => [0.4; 3],
            _ => [0.5; 3],
        });
        let e = errors(&picture, &reference, &Region::frame(grid));
        assert_eq!(e.pixels, 200);
        let square: f64 = 0.3 * 0.3 + 3.0 * 0.1 * 0.1;
        assert!((e.rmse - (square / 600.0).sqrt() * 255.0).abs() < 1e-9);
        assert!(e.mean.abs() < 1e-9);
        assert!((e.max - 0.3 * 255.0).abs() < 1e-9);
        assert_eq!(rmse(&picture, &reference, &Region::frame(grid)), e.rmse);
    }

    #[test]
    fn untouched_tiles_count_with_their_backgrounds() {
        let grid = TileGrid::new(100, 100);
        let black = Picture::new(grid, [0.0; 3]);
        let white = Picture::new(grid, [1.0; 3]);
        let e = errors(&white, &black, &Region::frame(grid));
        assert_eq!((e.rmse, e.mean, e.max), (255.0, 255.0, 255.0));
        assert_eq!(rmse(&white, &black, &Region::frame(grid)), 255.0);
        assert!((e.rmse_srgb - 255.0).abs() < 1e-9);
        let none = errors(&black, &black, &Region::frame(grid));
        assert_eq!((none.rmse, none.max), (0.0, 0.0));
    }
}
