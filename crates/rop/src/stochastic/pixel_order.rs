//! Numbering the pixels of a frame.

use crate::contract::frame::Site;
use screendoor_trace::tile::{TILE_PIXELS, TILE_SIDE, TileGrid, TileId};

screendoor_trace::options! {
    /// The curve along which pixels are numbered.
    pub enum PixelOrder {
        Hilbert = "hilbert": "along a Hilbert curve: near numbers are near pixels",
        Morton = "morton": "along a Z curve: even and odd rows get different expectations (LK section 3.1)",
        Scanline = "scanline": "row by row",
    }
}

/// A pixel's number along a curve over the smallest power-of-two square that
/// holds the frame: below 2^32, as a frame's sides are at most 2^16.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct PixelIndex(pub u32);

impl PixelOrder {
    /// The number of a pixel of a frame.
    pub fn index(self, site: Site, frame: TileGrid) -> PixelIndex {
        let bits = frame.width().max(frame.height()).next_power_of_two().trailing_zeros();
        let (x, y) = (u32::from(site.x), u32::from(site.y));
        PixelIndex(match self {
            PixelOrder::Hilbert => hilbert(x, y, bits),
            PixelOrder::Morton => spread(x) | spread(y) << 1,
            PixelOrder::Scanline => (y << bits.min(16)).wrapping_add(x),
        })
    }

    /// The numbers of a tile's pixels.
    pub fn tile(self, tile: TileId, frame: TileGrid) -> [PixelIndex; TILE_PIXELS] {
        let bits = frame.width().max(frame.height()).next_power_of_two().trailing_zeros();
        let (x, y) = frame.pixel(tile, 0);
        const LEVELS: u32 = TILE_SIDE.trailing_zeros();
        if self != PixelOrder::Hilbert || bits < LEVELS {
            return std::array::from_fn(|within| {
                let (x, y) = frame.pixel(tile, within);
                self.index(Site { x: x as u16, y: y as u16 }, frame)
            });
        }
        // All pixels of a tile lie in the same quadrants down to the tile's level; below
        // it, the curve may be mirrored.
        let (mut left, mut top, mut distance) = (x, y, 0);
        for bit in (LEVELS..bits).rev() {
            distance = distance << 2 | quadrant(&mut left, &mut top, bit);
        }
        // What became of the corner's lower bits, all clear, and of its neighbours'.
        let (mut right, mut below) = (x | 1, y);
        for bit in (LEVELS..bits).rev() {
            quadrant(&mut right, &mut below, bit);
        }
        let swapped = (left ^ right) & 1 == 0;
        let inverted = left & 1 == 1;
        std::array::from_fn(|within| {
            let side = TILE_SIDE as u32;
            let (mut x, mut y) = (within as u32 % side, within as u32 / side);
            if swapped {
                (x, y) = (y, x);
            }
            if inverted {
                (x, y) = (!x, !y);
            }
            PixelIndex(distance << (2 * LEVELS) | hilbert(x, y, LEVELS))
        })
    }
}

/// The distance along the Hilbert curve of order `bits` that starts at (0, 0) and
/// ends at the right end of row 0.
fn hilbert(mut x: u32, mut y: u32, bits: u32) -> u32 {
    let mut distance = 0;
    for bit in (0..bits).rev() {
        distance = distance << 2 | quadrant(&mut x, &mut y, bit);
    }
    distance
}

/// Which quadrant at level `bit` holds (`x`, `y`), in the curve's order: 0 (left, up),
/// 1 (left, down), 2 (right, down), 3 (right, up). The coordinates' lower bits become
/// those along the part of the curve that it holds.
fn quadrant(x: &mut u32, y: &mut u32, bit: u32) -> u32 {
    let (right, down) = (*x >> bit & 1, *y >> bit & 1);
    // The first and the last quadrant hold the curve mirrored.
    if down == 0 {
        if right == 1 {
            (*x, *y) = (!*x, !*y);
        }
        std::mem::swap(x, y);
    }
    (3 * right) ^ down
}

/// Puts a zero before each of the lower 16 bits.
fn spread(v: u32) -> u32 {
    let v = (v | v << 8) & 0x00ff_00ff;
    let v = (v | v << 4) & 0x0f0f_0f0f;
    let v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    fn site(x: u32, y: u32) -> Site {
        Site { x: x as u16, y: y as u16 }
    }

    const ORDERS: [PixelOrder; 3] = [PixelOrder::Hilbert, PixelOrder::Morton, PixelOrder::Scanline];

    #[test]
    fn every_order_numbers_a_square_through() {
        for side in [1_u32, 2, 8, 64] {
            for order in ORDERS {
                let mut seen = vec![false; (side * side) as usize];
                for y in 0..side {
                    for x in 0..side {
                        let PixelIndex(i) = order.index(site(x, y), TileGrid::new(side, side));
                        assert!(!std::mem::replace(&mut seen[i as usize], true));
                    }
                }
                assert!(seen.iter().all(|s| *s));
            }
        }
    }

    #[test]
    fn neighbours_on_the_hilbert_curve_are_neighbours_in_the_frame() {
        let side = 64;
        let mut place = vec![(0, 0); side * side];
        for y in 0..side {
            for x in 0..side {
                place[hilbert(x as u32, y as u32, 6) as usize] = (x as i32, y as i32);
            }
        }
        assert_eq!((place[0], place[side * side - 1]), ((0, 0), (63, 0)));
        for pair in place.windows(2) {
            let ((ax, ay), (bx, by)) = (pair[0], pair[1]);
            assert_eq!((ax - bx).abs() + (ay - by).abs(), 1);
        }
    }

    #[test]
    fn the_largest_frame_fits() {
        for order in ORDERS {
            let frame = TileGrid::new(1 << 16, 1 << 16);
            let corner = |x, y| order.index(site(x, y), frame).0;
            let mut corners =
                [(0, 0), (0, 65535), (65535, 0), (65535, 65535)].map(|(x, y)| corner(x, y));
            corners.sort_unstable();
            assert!(corners.windows(2).all(|w| w[0] < w[1]));
            assert_eq!((corners[0], corners[3] == u32::MAX), (0, true));
        }
    }

    #[test]
    fn a_tile_at_once_is_its_pixels_one_by_one() {
        for side in [1, 8, 16, 40, 128, 200] {
            let frame = TileGrid::new(side, side / 2 + 1);
            for tile in (0..frame.count() as u32).map(TileId) {
                for order in ORDERS {
                    for (within, index) in order.tile(tile, frame).into_iter().enumerate() {
                        let (x, y) = frame.pixel(tile, within);
                        if frame.contains((x, y)) {
                            assert_eq!(index, order.index(site(x, y), frame), "{order:?} {x},{y}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn morton_interleaves() {
        assert_eq!(
            PixelOrder::Morton.index(site(0b101, 0b011), TileGrid::new(8, 8)),
            PixelIndex(0b01_10_11)
        );
    }
}
