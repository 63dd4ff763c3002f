//! A picture as its file has it: where it lies, its alpha, its layer.

use crate::picture::Picture;
use crate::tile::{TILE_PIXELS, TileGrid, TileMap};

/// A rectangle of pixels: the column and row of its first one, width and height.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize)]
pub struct Window {
    /// Column and row of the top left pixel.
    pub origin: [i32; 2],
    /// Width and height in pixels.
    pub size: [u32; 2],
}

impl Window {
    /// The smallest that holds both: its origin, and its size, which may be more than a
    /// picture's.
    fn around(self, other: Window) -> ([i64; 2], [u64; 2]) {
        let end = |w: Window, i: usize| i64::from(w.origin[i]) + i64::from(w.size[i]);
        let origin = [0, 1].map(|i| i64::from(self.origin[i].min(other.origin[i])));
        let size = [0, 1].map(|i| (end(self, i).max(end(other, i)) - origin[i]) as u64);
        (origin, size)
    }
}

impl std::fmt::Display for Window {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([x, y], [w, h]) = (self.origin, self.size);
        write!(f, "{w}x{h} at {x},{y}")
    }
}

/// A picture with what its file says of it.
#[derive(Clone, Debug)]
pub struct Opened {
    /// The colours, of the data window alone.
    pub picture: Picture,
    /// Where these pixels lie in the file's plane.
    pub data: Window,
    /// What the file is to show of that plane.
    pub display: Window,
    /// The name of the layer that was read; empty where it has none.
    pub layer: String,
    /// The file's other layers and parts, for people.
    pub others: Vec<String>,
    /// Alpha, where the layer has it; 1 in tiles that are not there.
    alpha: Option<TileMap<Box<[f32; TILE_PIXELS]>>>,
}

/// How the alpha of two pictures differs.
#[derive(Clone, Copy, PartialEq, Debug, serde::Serialize)]
pub struct AlphaDifference {
    /// Pixels where it does.
    pub pixels: u64,
    /// By how much at most; NaN where an alpha is.
    pub max: f64,
}

impl Opened {
    pub(super) fn new(grid: TileGrid, data: Window, display: Window, has_alpha: bool) -> Self {
        Opened {
            picture: Picture::new(grid, [0.0; 3]),
            data,
            display,
            layer: String::new(),
            others: Vec::new(),
            alpha: has_alpha.then(|| TileMap::new(grid)),
        }
    }

    /// A picture that fills its file's plane, as those of formats without windows do.
    pub(super) fn plain(picture: Picture, has_alpha: bool) -> Self {
        let window = Window { origin: [0; 2], size: [picture.width(), picture.height()] };
        let mut opened = Opened::new(picture.grid(), window, window, has_alpha);
        opened.picture = picture;
        opened
    }

    /// Whether the layer has alpha.
    pub fn has_alpha(&self) -> bool {
        self.alpha.is_some()
    }

    /// Puts down one channel of pixels from (`x`, `y`) on to the right.
    pub(super) fn put_row(&mut self, x: u32, y: u32, channel: usize, values: &[f32]) {
        let grid = self.picture.grid();
        for (x, value) in (x..).zip(values) {
            // All is 0 from the start; a tile of nothing else takes no memory.
            if value.to_bits() != 0 {
                let tile = self.picture.tile_mut(grid.tile(x as u16, y as u16));
                tile[TileGrid::within(x as u16, y as u16)][channel] = f64::from(*value);
            }
        }
    }

    /// Puts down the alpha of pixels from (`x`, `y`) on to the right.
    pub(super) fn put_alpha(&mut self, x: u32, y: u32, values: &[f32]) {
        let grid = self.picture.grid();
        let Some(alpha) = &mut self.alpha else { return };
        for (x, value) in (x..).zip(values) {
            let tile = grid.tile(x as u16, y as u16);
            if *value != 1.0 || alpha.get(tile).is_some() {
                let pixels = alpha.get_or_insert_with(tile, || Box::new([1.0; TILE_PIXELS]));
                pixels[TileGrid::within(x as u16, y as u16)] = *value;
            }
        }
    }

    /// The alpha of pixel (`x`, `y`) of the data window; 1 where the layer has none.
    pub fn alpha(&self, x: u32, y: u32) -> f32 {
        let (x, y) = (x as u16, y as u16);
        let tiles = self.alpha.as_ref();
        let tile = tiles.and_then(|tiles| tiles.get(self.picture.grid().tile(x, y)));
        tile.map_or(1.0, |tile| tile[TileGrid::within(x, y)])
    }

    /// The pixel of the plane, as a place in the data window where it lies in there.
    fn place(&self, x: i64, y: i64) -> Option<(u32, u32)> {
        let within = |v: i64, i: usize| {
            let v = v - i64::from(self.data.origin[i]);
            (0..i64::from(self.data.size[i])).contains(&v).then_some(v as u32)
        };
        Some((within(x, 0)?, within(y, 1)?))
    }
}

/// Two pictures laid over one another in their files' plane, so that they can be compared.
#[derive(Debug)]
pub struct Laid {
    /// Both, on one frame: black where a picture has no pixels.
    pub pictures: [Picture; 2],
    /// What is different of their alpha, where either has any; none, where a picture has no
    /// pixels.
    pub alpha: Option<AlphaDifference>,
}

/// The most pixels of a frame that two windows are laid on.
const MOST: u64 = 1 << 28;

/// Lays two pictures over one another. Those of equal data windows stay as they are. Where the
/// windows are of one size (one was moved) or the files show one part of the plane (one was
/// cropped), the frame holds both. `None` where the pictures are of different sizes, or their
/// windows lie so far apart that no picture could hold both.
pub fn lay(a: Opened, b: Opened) -> Option<Laid> {
    let equal = a.data == b.data;
    if !equal && a.data.size != b.data.size && a.display != b.display {
        return None;
    }
    let (origin, size) = a.data.around(b.data);
    if size.iter().any(|s| *s > 1 << 16) || size[0] * size[1] > MOST {
        return None;
    }
    let grid = TileGrid::new(size[0] as u32, size[1] as u32);
    let spread = |opened: &Opened| {
        Picture::from_fn(grid, |x, y| {
            let place = opened.place(origin[0] + i64::from(x), origin[1] + i64::from(y));
            place.map_or([0.0; 3], |(x, y)| opened.picture.get(x, y))
        })
    };
    let alpha = (a.has_alpha() || b.has_alpha()).then(|| {
        let mut difference = AlphaDifference { pixels: 0, max: 0.0 };
        let pixels = |y| (0..grid.width()).map(move |x| (i64::from(x), i64::from(y)));
        for (x, y) in (0..grid.height()).flat_map(pixels) {
            let at = |opened: &Opened| {
                let place = opened.place(origin[0] + x, origin[1] + y);
                place.map_or(0.0, |(x, y)| f64::from(opened.alpha(x, y)))
            };
            let (a, b) = (at(&a), at(&b));
            if a.to_bits() != b.to_bits() {
                difference.pixels += 1;
                // NaN stays.
                let by = (a - b).abs();
                difference.max =
                    if by > difference.max || by.is_nan() { by } else { difference.max };
            }
        }
        difference
    });
    let pictures = match equal {
        true => [a.picture, b.picture],
        false => [spread(&a), spread(&b)],
    };
    Some(Laid { pictures, alpha })
}
