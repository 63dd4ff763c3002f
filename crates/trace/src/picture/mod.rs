//! Pictures: colours of a frame's pixels, held tile by tile.

mod exr_file;
mod opened;
mod png_chunks;
mod read;
mod rgba;
mod space;
pub mod srgb;
mod write;

pub use opened::{AlphaDifference, Laid, Opened, Window, lay};
pub use png_chunks::necessary_chunks;
pub use read::can_hold;
pub use read::{layers, open, read};
pub use rgba::{Rgba, is_deep};
pub use space::Space;
pub use write::{Layer, PictureFile, write_exr, write_png};

use crate::tile::{TILE_PIXELS, TileGrid, TileId, TileMap};

/// The pixels of one tile.
pub type TilePixels = Box<[[f64; 3]; TILE_PIXELS]>;

/// A picture of RGB colours, linear where nothing else is said. Tiles that nothing touched show
/// the background and take no memory.
#[derive(Clone, Debug)]
pub struct Picture {
    space: Space,
    background: [f64; 3],
    tiles: TileMap<TilePixels>,
}

impl Picture {
    /// A picture that shows `background` everywhere.
    pub fn new(grid: TileGrid, background: [f64; 3]) -> Self {
        Picture { space: Space::Linear, background, tiles: TileMap::new(grid) }
    }

    /// A picture made of finished tiles.
    pub fn from_tiles(background: [f64; 3], tiles: TileMap<TilePixels>) -> Self {
        Picture { space: Space::Linear, background, tiles }
    }

    /// The same numbers, which stand for something else.
    pub fn in_space(mut self, space: Space) -> Self {
        self.space = space;
        self
    }

    /// What its numbers stand for.
    pub fn space(&self) -> Space {
        self.space
    }

    /// A picture whose pixel (x, y) has the colour that `pixel` gives.
    pub fn from_fn(grid: TileGrid, mut pixel: impl FnMut(u32, u32) -> [f64; 3]) -> Self {
        let mut picture = Picture::new(grid, [0.0; 3]);
        for id in (0..grid.count() as u32).map(TileId) {
            let tile = picture.tile_mut(id);
            for (within, colour) in tile.iter_mut().enumerate() {
                let (x, y) = grid.pixel(id, within);
                if grid.contains((x, y)) {
                    *colour = pixel(x, y);
                }
            }
        }
        picture
    }

    /// The tiles of its frame.
    pub fn grid(&self) -> TileGrid {
        self.tiles.grid()
    }

    /// Frame width in pixels.
    pub fn width(&self) -> u32 {
        self.grid().width()
    }

    /// Frame height in pixels.
    pub fn height(&self) -> u32 {
        self.grid().height()
    }

    /// The colour of pixel (`x`, `y`) of the frame.
    pub fn get(&self, x: u32, y: u32) -> [f64; 3] {
        let tile = self.grid().tile(x as u16, y as u16);
        self.tile(tile).map_or(self.background, |t| t[TileGrid::within(x as u16, y as u16)])
    }

    /// The colour of tiles that nothing touched.
    pub fn background(&self) -> [f64; 3] {
        self.background
    }

    /// The pixels of `tile`, if it is touched.
    pub fn tile(&self, tile: TileId) -> Option<&[[f64; 3]; TILE_PIXELS]> {
        self.tiles.get(tile).map(|t| &**t)
    }

    /// The pixels of `tile`, to change.
    pub fn tile_mut(&mut self, tile: TileId) -> &mut [[f64; 3]; TILE_PIXELS] {
        let background = self.background;
        self.tiles.get_or_insert_with(tile, || Box::new([background; TILE_PIXELS]))
    }

    /// The tiles that are touched in this picture or in `other`, in order.
    pub fn tiles_with(&self, other: &Picture) -> Vec<TileId> {
        let ids = |p: &Picture| p.tiles.touched().iter().map(|(id, _)| *id).collect::<Vec<_>>();
        let mut all = [ids(self), ids(other)].concat();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// A picture with `change` applied to each pixel of this one and its
    /// counterpart in `other`.
    ///
    /// # Panics
    /// Where the frames differ in size, or in what numbers stand for.
    pub fn zip(&self, other: &Picture, change: impl Fn([f64; 3], [f64; 3]) -> [f64; 3]) -> Picture {
        assert_eq!((self.grid(), self.space), (other.grid(), other.space));
        let mut result = Picture::new(self.grid(), change(self.background, other.background));
        result.space = self.space;
        for id in self.tiles_with(other) {
            let (a, b) = (self.tile(id), other.tile(id));
            for (within, pixel) in result.tile_mut(id).iter_mut().enumerate() {
                *pixel = change(
                    a.map_or(self.background, |t| t[within]),
                    b.map_or(other.background, |t| t[within]),
                );
            }
        }
        result
    }

    /// This picture minus `other`, in amounts of light.
    ///
    /// # Panics
    /// As [`Picture::zip`].
    pub fn minus(&self, other: &Picture) -> Picture {
        let light = |c: f64| self.space.to_linear(c);
        let minus = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| light(a[i]) - light(b[i]));
        self.zip(other, minus).in_space(Space::Linear)
    }

    /// How many of its pixels have a channel that is NaN or infinite.
    pub fn not_finite(&self) -> u64 {
        let grid = self.grid();
        let broken = |colour: &[f64; 3]| !colour.iter().all(|c| c.is_finite());
        let touched = self.tiles.touched().iter().flat_map(|(id, tile)| {
            let pixels = tile.iter().enumerate();
            pixels.filter(|(within, _)| grid.contains(grid.pixel(*id, *within))).map(|(_, c)| c)
        });
        let (mut count, mut seen) = (0, 0);
        for colour in touched {
            count += u64::from(broken(colour));
            seen += 1;
        }
        let all = u64::from(self.width()) * u64::from(self.height());
        count + if broken(&self.background) { all - seen } else { 0 }
    }

    /// The BLAKE3 of all pixels' bits, row by row: equal for pictures that are
    /// equal bit for bit. Of a frame that no picture file could hold (more than 2^28 pixels)
    /// it is that of the background and of the tiles that show something else, so that it
    /// takes as long as there are such tiles.
    pub fn hash(&self) -> String {
        if u64::from(self.width()) * u64::from(self.height()) > write::MAX_PIXELS {
            return self.hash_of_tiles();
        }
        let mut hasher = blake3::Hasher::new();
        for size in [self.width(), self.height()] {
            hasher.update(&size.to_le_bytes());
        }
        let mut row = Vec::with_capacity(self.width() as usize * 24);
        for y in 0..self.height() {
            row.clear();
            for x in 0..self.width() {
                row.extend(self.get(x, y).iter().flat_map(|c| c.to_bits().to_le_bytes()));
            }
            hasher.update(&row);
        }
        hasher.finalize().to_hex().to_string()
    }
}

impl Picture {
    fn hash_of_tiles(&self) -> String {
        let grid = self.grid();
        let bytes = |colour: &[f64; 3]| colour.map(|c| c.to_bits().to_le_bytes()).concat();
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"tiles");
        for size in [self.width(), self.height()] {
            hasher.update(&size.to_le_bytes());
        }
        let background = bytes(&self.background);
        hasher.update(&background);
        let mut touched: Vec<_> = self.tiles.touched().iter().collect();
        touched.sort_unstable_by_key(|(id, _)| *id);
        for (id, pixels) in touched {
            // What lies beyond the frame is nobody's.
            let pixel = |(within, colour)| match grid.contains(grid.pixel(*id, within)) {
                true => bytes(colour),
                false => background.clone(),
            };
            let tile: Vec<u8> = pixels.iter().enumerate().flat_map(pixel).collect();
            if tile != background.repeat(TILE_PIXELS) {
                hasher.update(&id.0.to_le_bytes());
                hasher.update(&tile);
            }
        }
        hasher.finalize().to_hex().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vast_frame_is_hashed_by_what_it_shows() {
        let grid = TileGrid::new(65536, 65535);
        let mut picture = Picture::new(grid, [0.5; 3]);
        let empty = picture.hash();
        picture.tile_mut(grid.tile(9, 9))[TileGrid::within(9, 9)] = [0.5, 0.5, 0.25];
        let one = picture.hash();
        assert_ne!(one, empty);
        // A tile that shows the background is as good as none; so is what lies beyond.
        let last = grid.tile(65535, 65534);
        let beyond = (0..TILE_PIXELS).find(|i| !grid.contains(grid.pixel(last, *i))).unwrap();
        picture.tile_mut(last)[beyond] = [7.0; 3];
        assert_eq!(picture.hash(), one);
        picture.tile_mut(last)[TileGrid::within(65535, 65534)] = [0.5, 0.5, 0.25];
        assert_ne!(picture.hash(), one);
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted() {
        let grid = TileGrid::new(20, 10);
        let mut picture = Picture::new(grid, [0.5; 3]);
        assert_eq!(picture.not_finite(), 0);
        // The tile reaches beyond the frame; what lies there is nobody's.
        let tile = grid.tile(19, 9);
        picture.tile_mut(tile).fill([0.0, f64::NAN, 0.0]);
        let expected = Picture::from_fn(grid, |x, y| picture.get(x, y)).not_finite();
        let within = (0..TILE_PIXELS).filter(|i| grid.contains(grid.pixel(tile, *i))).count();
        assert_eq!((picture.not_finite(), expected), (within as u64, within as u64));
        assert!(within < TILE_PIXELS);
        let infinite = Picture::new(grid, [f64::INFINITY, 0.0, 0.0]);
        assert_eq!(infinite.not_finite(), 200);
    }

    #[test]
    fn untouched_tiles_show_the_background() {
        let grid = TileGrid::new(40, 20);
        let mut picture = Picture::new(grid, [0.5; 3]);
        picture.tile_mut(grid.tile(17, 3))[TileGrid::within(17, 3)] = [1.0, 2.0, 3.0];
        assert_eq!(picture.get(17, 3), [1.0, 2.0, 3.0]);
        assert_eq!(picture.get(18, 3), [0.5; 3]);
        assert_eq!(picture.get(0, 0), [0.5; 3]);
        let full = Picture::from_fn(grid, |x, y| picture.get(x, y));
        assert_eq!(full.hash(), picture.hash());
        let difference = picture.zip(&full, |a, b| std::array::from_fn(|i| a[i] - b[i]));
        assert_eq!(difference.get(17, 3), [0.0; 3]);
        assert_eq!(difference.background(), [0.5; 3]);
    }
}
