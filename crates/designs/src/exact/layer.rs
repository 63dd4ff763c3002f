//! What the engine keeps of a fragment.

use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{BLOCK, Block, DepthPlane, SampleMask, Unorm32};

/// Turns unsigned depths into signed words of the same order, and back.
const SIGN: u32 = 1 << 31;

/// A fragment as it is composited: all that is multiplied is converted once, and lies in one
/// line of the cache.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub(super) colour: [f64; 3],
    pub(super) alpha: f64,
    /// 1 − α.
    pub(super) rest: f64,
    pub(super) coverage: SampleMask,
    /// The depth at the pixel's centre, its upper bit flipped.
    pub(super) z: i32,
    pub(super) dzdx: i32,
    pub(super) dzdy: i32,
    /// Its pixel's place in the tile.
    pub(super) within: u8,
    /// All ones where the plane may leave the depth range within the pixel, or is so steep that
    /// 32 bits do not hold its sums: its depths are found one by one.
    pub(super) rough: u8,
}

/// What is found out of a block's rows at once: without a branch, so that the compiler makes
/// vectors of it.
pub(super) struct Tags {
    within: [u8; BLOCK],
    rough: [u8; BLOCK],
}

impl Tags {
    #[inline(always)]
    pub(super) fn of(block: &Block) -> Self {
        let mut tags = Tags { within: [0; BLOCK], rough: [0; BLOCK] };
        // Whole vectors: what lies beyond the block's length is not looked at.
        for i in 0..block.rows().next_multiple_of(32).min(BLOCK) {
            let rough = is_rough(block.z[i], block.dzdx[i], block.dzdy[i]);
            tags.rough[i] = u8::from(rough).wrapping_neg();
            tags.within[i] = TileGrid::within(block.x[i], block.y[i]) as u8;
        }
        tags
    }
}

impl Layer {
    /// Row `i` of a block.
    #[inline(always)]
    pub(super) fn of(block: &Block, tags: &Tags, i: usize) -> Self {
        let alpha = f64::from(block.alpha[i]);
        Layer {
            colour: [block.r[i].into(), block.g[i].into(), block.b[i].into()],
            alpha,
            rest: 1.0 - alpha,
            coverage: SampleMask(block.coverage[i]),
            z: (block.z[i] ^ SIGN) as i32,
            dzdx: block.dzdx[i],
            dzdy: block.dzdy[i],
            within: tags.within[i],
            rough: tags.rough[i],
        }
    }

    /// Which of eight samples it covers, from `first` on.
    #[inline(always)]
    pub(super) fn covered(&self, first: usize) -> u8 {
        (self.coverage.0 >> first) as u8
    }

    /// The depth at a place in the pixel.
    #[inline(always)]
    pub(super) fn depth_at(&self, position: [i8; 2]) -> u32 {
        if self.rough == 0 {
            return self.about(position.map(i32::from));
        }
        let z = Unorm32(self.z as u32 ^ SIGN);
        DepthPlane { z, dzdx: self.dzdx, dzdy: self.dzdy }.at(position).0
    }

    /// The same where the plane is not rough; anything where it is.
    #[inline(always)]
    pub(super) fn about(&self, [x, y]: [i32; 2]) -> u32 {
        let slope = self.dzdx.wrapping_mul(x).wrapping_add(self.dzdy.wrapping_mul(y));
        self.z.wrapping_add(slope >> 4) as u32 ^ SIGN
    }
}

/// Whether a plane may leave the depth range or is very steep. Hardly any is.
#[inline(always)]
fn is_rough(z: u32, dzdx: i32, dzdy: i32) -> bool {
    // Each apart: their sum might wrap.
    const STEEP: u32 = 1 << 27;
    let (across, down) = (dzdx.unsigned_abs(), dzdy.unsigned_abs());
    // Samples lie at most half a pixel from the centre, along each axis.
    let reach = across.wrapping_add(down) / 2 + 3;
    (across >= STEEP) | (down >= STEEP) | (z < reach) | (z > u32::MAX - reach)
}
