//! Frames cut into square tiles, of which only the touched ones take memory.

/// A tile's side in pixels.
pub const TILE_SIDE: usize = 16;
/// How many pixels a tile holds.
pub const TILE_PIXELS: usize = TILE_SIDE * TILE_SIDE;

/// A tile's number: row by row from the top left.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct TileId(pub u32);

/// The tiles of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TileGrid {
    width: u32,
    height: u32,
    columns: u32,
}

impl TileGrid {
    /// The grid of a frame of `width` × `height` pixels, each at most 65536.
    pub fn new(width: u32, height: u32) -> Self {
        TileGrid { width, height, columns: width.div_ceil(TILE_SIDE as u32) }
    }

    /// Frame width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Frame height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// How many tiles there are.
    pub fn count(&self) -> usize {
        self.columns as usize * self.height.div_ceil(TILE_SIDE as u32) as usize
    }

    /// The tile that holds pixel (`x`, `y`).
    #[inline]
    pub fn tile(&self, x: u16, y: u16) -> TileId {
        let side = TILE_SIDE as u32;
        TileId(u32::from(y) / side * self.columns + u32::from(x) / side)
    }

    /// The pixel's place within its tile: row by row from the tile's top left.
    #[inline]
    pub fn within(x: u16, y: u16) -> usize {
        usize::from(y) % TILE_SIDE * TILE_SIDE + usize::from(x) % TILE_SIDE
    }

    /// The frame's pixel at place `within` of `tile`; it may lie beyond the
    /// frame's right or lower edge.
    #[inline]
    pub fn pixel(&self, tile: TileId, within: usize) -> (u32, u32) {
        let side = TILE_SIDE as u32;
        let (column, row) = (tile.0 % self.columns, tile.0 / self.columns);
        (column * side + within as u32 % side, row * side + within as u32 / side)
    }

    /// Whether a pixel lies in the frame.
    #[inline]
    pub fn contains(&self, (x, y): (u32, u32)) -> bool {
        x < self.width && y < self.height
    }
}

/// A value for each touched tile. Untouched tiles cost four bytes of address
/// space, which the operating system backs only where it is written.
#[derive(Clone, Debug)]
pub struct TileMap<T> {
    grid: TileGrid,
    /// Place in `tiles` plus one; 0 for an untouched tile.
    slots: Vec<u32>,
    tiles: Vec<(TileId, T)>,
}

impl<T> TileMap<T> {
    /// A map of `grid` with every tile untouched.
    pub fn new(grid: TileGrid) -> Self {
        TileMap { grid, slots: vec![0; grid.count()], tiles: Vec::new() }
    }

    /// The grid it maps.
    pub fn grid(&self) -> TileGrid {
        self.grid
    }

    /// The value of `tile`, if it is touched.
    #[inline]
    pub fn get(&self, tile: TileId) -> Option<&T> {
        Some(&self.tiles[self.slot(tile)?].1)
    }

    /// The place of `tile` among the touched ones, touching it with `make()`
    /// where it is new.
    #[inline]
    pub fn touch(&mut self, tile: TileId, make: impl FnOnce() -> T) -> usize {
        let slot = &mut self.slots[tile.0 as usize];
        if *slot == 0 {
            self.tiles.push((tile, make()));
            *slot = self.tiles.len() as u32;
        }
        *slot as usize - 1
    }

    /// The place of `tile` among the touched ones, if it is touched.
    #[inline]
    pub fn slot(&self, tile: TileId) -> Option<usize> {
        self.slots[tile.0 as usize].checked_sub(1).map(|slot| slot as usize)
    }

    /// Makes all tiles untouched.
    pub fn clear(&mut self) {
        for (tile, _) in self.tiles.drain(..) {
            self.slots[tile.0 as usize] = 0;
        }
    }

    /// The value of `tile`, touching it with `make()` where it is new.
    #[inline]
    pub fn get_or_insert_with(&mut self, tile: TileId, make: impl FnOnce() -> T) -> &mut T {
        let slot = self.touch(tile, make);
        &mut self.tiles[slot].1
    }

    /// The touched tiles, in the order in which they were first touched.
    pub fn touched(&self) -> &[(TileId, T)] {
        &self.tiles
    }

    /// The touched tiles' values, to change.
    pub fn touched_mut(&mut self) -> &mut [(TileId, T)] {
        &mut self.tiles
    }

    /// The touched tiles by value, in the order in which they were first touched.
    pub fn into_touched(self) -> Vec<(TileId, T)> {
        self.tiles
    }

    /// The same tiles, or some of them, with other values.
    pub fn filter_map<U>(
        mut self,
        change: impl FnOnce(Vec<(TileId, T)>) -> Vec<(TileId, U)>,
    ) -> TileMap<U> {
        for (tile, _) in &self.tiles {
            self.slots[tile.0 as usize] = 0;
        }
        let tiles = change(self.tiles);
        for (i, (tile, _)) in tiles.iter().enumerate() {
            self.slots[tile.0 as usize] = i as u32 + 1;
        }
        TileMap { grid: self.grid, slots: self.slots, tiles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_and_tiles_agree() {
        let grid = TileGrid::new(37, 20);
        assert_eq!(grid.count(), 6);
        for y in 0..20 {
            for x in 0..37 {
                let tile = grid.tile(x, y);
                assert!((tile.0 as usize) < grid.count());
                let pixel = grid.pixel(tile, TileGrid::within(x, y));
                assert_eq!(pixel, (x.into(), y.into()));
                assert!(grid.contains(pixel));
            }
        }
        assert!(!grid.contains((37, 0)) && !grid.contains((0, 20)));
    }

    #[test]
    fn only_touched_tiles_are_there() {
        let mut map = TileMap::new(TileGrid::new(64, 64));
        assert!(map.get(TileId(5)).is_none());
        *map.get_or_insert_with(TileId(5), || 1) += 1;
        *map.get_or_insert_with(TileId(2), || 7) += 1;
        *map.get_or_insert_with(TileId(5), || 100) += 1;
        assert_eq!(map.get(TileId(5)), Some(&3));
        assert_eq!(map.touched(), [(TileId(5), 3), (TileId(2), 8)]);
    }
}
