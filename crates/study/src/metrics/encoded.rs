//! What many pictures are held against, its values encoded once.

use crate::metrics::region::TileBits;
use crate::metrics::{Errors, Region, UNIT, root};
use screendoor_trace::picture::{Picture, Space, TilePixels};
use screendoor_trace::tile::{TILE_PIXELS, TileMap};

/// A reference's sRGB-encoded values. To encode takes a power, which costs more than all else
/// of an error: so it is done once for the reference, and once for each value of a picture that
/// differs from it, however many regions have the pixel.
#[derive(Clone, Debug)]
pub struct Encoded {
    background: [f64; 3],
    tiles: TileMap<TilePixels>,
}

impl Encoded {
    /// Encodes a reference.
    pub fn of(reference: &Picture) -> Self {
        let space = reference.space();
        let mut tiles = TileMap::new(reference.grid());
        for tile in reference.tiles_with(reference) {
            let pixels = reference.tile(tile).expect("it is one of its tiles");
            tiles.get_or_insert_with(tile, || Box::new(pixels.map(|p| encode(space, p))));
        }
        Encoded { background: encode(space, reference.background()), tiles }
    }

    /// The errors of `picture` against the reference over each of `regions`.
    pub(super) fn errors(
        &self,
        picture: &Picture,
        reference: &Picture,
        regions: &[&Region],
    ) -> Vec<Errors> {
        assert_eq!((picture.grid(), picture.space()), (reference.grid(), reference.space()));
        let mut sums: Vec<Sums> = regions.iter().map(|_| Sums::default()).collect();
        for tile in picture.tiles_with(reference) {
            let within: Vec<TileBits> = regions.iter().map(|region| region.of_tile(tile)).collect();
            let of_any = within.iter().fold(TileBits::default(), |all, bits| all | bits);
            let (a, b) = (picture.tile(tile), reference.tile(tile));
            let encoded = self.tiles.get(tile);
            let mut found = [Difference::default(); TILE_PIXELS];
            for at in of_any.iter_ones() {
                found[at] = Difference::of(
                    picture.space(),
                    a.map_or(picture.background(), |t| t[at]),
                    b.map_or(reference.background(), |t| t[at]),
                    encoded.map_or(self.background, |t| t[at]),
                );
            }
            for (sums, bits) in sums.iter_mut().zip(&within) {
                bits.iter_ones().for_each(|at| sums.add(&found[at], 1));
            }
        }
        // The rest of a region shows both backgrounds.
        let (space, background) = (picture.space(), picture.background());
        let rest = Difference::of(space, background, reference.background(), self.background);
        let each = sums.iter_mut().zip(regions).map(|(sums, region)| {
            sums.add(&rest, region.pixels() - sums.visited);
            sums.finish()
        });
        each.collect()
    }
}

fn encode(space: Space, pixel: [f64; 3]) -> [f64; 3] {
    pixel.map(|value| space.to_encoded(value))
}

/// How far a pixel is from the reference's, and how far once both are encoded.
#[derive(Clone, Copy, Default)]
struct Difference {
    plain: [f64; 3],
    encoded: [f64; 3],
}

impl Difference {
    fn of(space: Space, a: [f64; 3], b: [f64; 3], encoded: [f64; 3]) -> Self {
        let plain: [f64; 3] = std::array::from_fn(|i| a[i] - b[i]);
        let of_encoded = |i: usize| match plain[i] == 0.0 {
            true => 0.0,
            false => space.to_encoded(a[i]) - encoded[i],
        };
        Difference { plain, encoded: std::array::from_fn(of_encoded) }
    }
}

/// Sums over the pixels of a region.
#[derive(Default)]
struct Sums {
    visited: u64,
    square: f64,
    square_srgb: f64,
    signed: f64,
    max: f64,
}

impl Sums {
    fn add(&mut self, difference: &Difference, times: u64) {
        // Nothing times what is infinite would not be nothing.
        if times == 0 {
            return;
        }
        self.visited += times;
        for (plain, encoded) in difference.plain.into_iter().zip(difference.encoded) {
            self.square += plain * plain * times as f64;
            self.square_srgb += encoded * encoded * times as f64;
            self.signed += plain * times as f64;
            self.max = self.max.max(plain.abs());
        }
    }

    /// Of all pixels of the region.
    fn finish(&self) -> Errors {
        let pixels = self.visited;
        let count = (3 * pixels).max(1) as f64;
        Errors {
            pixels,
            rmse: root(self.square, pixels),
            rmse_srgb: root(self.square_srgb, pixels),
            mean: self.signed / count / UNIT,
            max: self.max / UNIT,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::random::hash;
    use screendoor_trace::tile::TileGrid;

    #[test]
    fn a_region_has_the_same_errors_alone_and_among_others() {
        let grid = TileGrid::new(40, 24);
        let unit = |words| f64::from(hash::<3>(words)) / 2_f64.powi(32);
        let picture = |which: u32| {
            // Some pixels of the two are equal.
            Picture::from_fn(grid, |x, y| [unit([if x % 3 == 0 { 0 } else { which }, x, y]); 3])
        };
        let (a, b) = (picture(1), picture(2));
        let small = Region::of_pixels(grid, |x, y| (x + y) % 2 == 0 && x > 20);
        let regions = [&Region::frame(grid), &small];
        let encoded = Encoded::of(&b);
        let together = encoded.errors(&a, &b, &regions);
        for (found, region) in together.iter().zip(regions) {
            assert_eq!(*found, encoded.errors(&a, &b, &[region])[0]);
            assert_eq!(found.pixels, region.pixels());
        }
        // As plain sums have it.
        let (mut square, mut srgb) = (0.0, 0.0);
        for (x, y) in (0..24).flat_map(|y| (0..40).map(move |x| (x, y))) {
            let encode = |p: &Picture| p.space().to_encoded(p.get(x, y)[0]);
            square += (a.get(x, y)[0] - b.get(x, y)[0]).powi(2);
            srgb += (encode(&a) - encode(&b)).powi(2);
        }
        let rmse = |sum: f64| (sum / (24.0 * 40.0)).sqrt() * 255.0;
        assert!((together[0].rmse - rmse(square)).abs() < 1e-9);
        assert!((together[0].rmse_srgb - rmse(srgb)).abs() < 1e-9);
    }
}
