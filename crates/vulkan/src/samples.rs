//! What the samples of an image hold: tile by tile, of which only the touched ones take memory.

use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId, TileMap};

/// A rectangle of pixels: left, upper, width, height.
pub(crate) type Area = [i32; 4];

/// Whether an area holds a whole frame of a size.
pub(crate) fn covers(area: Area, size: [u32; 2]) -> bool {
    let [left, upper, width, height] = area.map(i64::from);
    let [right, lower] = [left + width, upper + height];
    left <= 0 && upper <= 0 && right >= size[0].into() && lower >= size[1].into()
}

fn contains(area: Area, (x, y): (u32, u32)) -> bool {
    let [left, upper, width, height] = area.map(i64::from);
    let inside = |at: u32, low: i64, side: i64| (low..low + side).contains(&at.into());
    inside(x, left, width) && inside(y, upper, height)
}

/// What a pixel's samples held at first.
type Before<T> = Box<dyn Fn(u32, u32) -> T>;

/// A value for each sample of each pixel.
pub(crate) struct Samples<T> {
    count: usize,
    before: Before<T>,
    /// Parts that were cleared since, and to what.
    parts: Vec<(Area, T)>,
    tiles: TileMap<Tile<T>>,
}

struct Tile<T> {
    /// How many of the parts it has heard of.
    heard: usize,
    /// Of each pixel its samples.
    values: Box<[T]>,
}

impl<T: Copy + 'static> Samples<T> {
    /// Of `count` samples a pixel, which hold what `before` gives.
    pub(crate) fn new(size: [u32; 2], count: usize, before: Before<T>) -> Self {
        let tiles = TileMap::new(TileGrid::new(size[0], size[1]));
        Samples { count, before, parts: Vec::new(), tiles }
    }

    /// Width and height, in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        let grid = self.tiles.grid();
        [grid.width(), grid.height()]
    }

    /// How many samples a pixel has.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Clears an area; it costs nothing where nothing is drawn.
    pub(crate) fn clear(&mut self, area: Area, value: T) {
        let grid = self.tiles.grid();
        if covers(area, [grid.width(), grid.height()]) {
            self.parts.clear();
            self.before = Box::new(move |_, _| value);
            self.tiles = TileMap::new(grid);
        } else {
            self.parts.push((area, value));
        }
    }

    /// A pixel's samples, to change.
    pub(crate) fn at(&mut self, x: u16, y: u16) -> &mut [T] {
        let Samples { count, before, parts, tiles } = self;
        let (grid, count) = (tiles.grid(), *count);
        let id = grid.tile(x, y);
        let tile = tiles.get_or_insert_with(id, || Tile::new(grid, id, count, before));
        for (area, value) in &parts[tile.heard..] {
            for (within, values) in tile.values.chunks_exact_mut(count).enumerate() {
                if contains(*area, grid.pixel(id, within)) {
                    values.fill(*value);
                }
            }
        }
        tile.heard = parts.len();
        let from = TileGrid::within(x, y) * count;
        &mut tile.values[from..from + count]
    }

    /// A pixel's samples, to look at: nothing is kept of it.
    pub(crate) fn look(&self, x: u16, y: u16) -> impl Iterator<Item = T> {
        let (column, row) = (u32::from(x), u32::from(y));
        let tile = self.tiles.get(self.tiles.grid().tile(x, y));
        let heard = tile.map_or(0, |tile| tile.heard);
        let cleared = self.parts[heard..].iter().rev();
        let cleared = cleared.clone().find(|(area, _)| contains(*area, (column, row)));
        (0..self.count).map(move |s| match (cleared, tile) {
            (Some((_, value)), _) => *value,
            (None, Some(tile)) => tile.values[TileGrid::within(x, y) * self.count + s],
            (None, None) => (self.before)(column, row),
        })
    }
}

impl<T: Copy> Tile<T> {
    fn new(grid: TileGrid, id: TileId, count: usize, before: &Before<T>) -> Self {
        let pixel = |i: usize| {
            let (x, y) = grid.pixel(id, i / count);
            before(x, y)
        };
        Tile { heard: 0, values: (0..TILE_PIXELS * count).map(pixel).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_that_hold_a_frame() {
        assert!(covers([0, 0, 4, 5], [4, 5]) && covers([-1, 0, 9, 9], [4, 5]));
        assert!(!covers([1, 0, 9, 9], [4, 5]) && !covers([0, 0, 4, 4], [4, 5]));
        assert!(covers([0, 0, i32::MAX, i32::MAX], [65536, 65536]));
    }

    #[test]
    fn parts_that_are_cleared_cost_nothing_before_they_are_drawn_in() {
        let mut samples = Samples::new([65536, 65536], 2, Box::new(|x, _| x));
        let look = |samples: &Samples<u32>, x| samples.look(x, 0).collect::<Vec<_>>();
        samples.at(3, 0)[1] = 7;
        assert_eq!((look(&samples, 3), look(&samples, 4)), (vec![3, 7], vec![4, 4]));
        samples.clear([0, 0, 4, 65536], 9);
        assert_eq!((look(&samples, 3), look(&samples, 4)), (vec![9, 9], vec![4, 4]));
        assert_eq!(look(&samples, 40_000), [40_000; 2]);
        assert_eq!(samples.at(3, 0), [9, 9]);
        samples.at(3, 0)[0] = 1;
        samples.clear([4, 0, 1, 1], 8);
        assert_eq!((look(&samples, 3), look(&samples, 4)), (vec![1, 9], vec![8, 8]));
        assert_eq!(samples.tiles.touched().len(), 1);
        samples.clear([0, 0, 65536, 65536], 5);
        assert_eq!(look(&samples, 3), [5, 5]);
        assert!(samples.parts.is_empty() && samples.tiles.touched().is_empty());
    }
}
