//! A tile's fragments as engines are given them.

use crate::contract::frame::Frame;
use crate::contract::tiled::Blocks;
use screendoor_trace::tile::TileId;
use screendoor_trace::trace::{Bins, Block, SampleMask, TileRows, Wanted};

/// Blocks made of a tile's rows, one after the other in the same memory. None is empty.
pub(super) struct TileBlocks<'a> {
    rows: TileRows<'a>,
    block: &'a mut Block,
    /// Whether the block has been made and not been given yet.
    ready: bool,
}

impl<'a> TileBlocks<'a> {
    /// The blocks of `tile`, made in `block`.
    pub(super) fn of(bins: &'a Bins, tile: TileId, frame: &Frame, block: &'a mut Block) -> Self {
        let samples = SampleMask::first(frame.samples());
        let wanted = Wanted { samples, columns: frame.columns };
        TileBlocks { rows: bins.rows(tile, wanted), block, ready: false }
    }

    /// Whether there is another block. Rows need not cover a sample that is replayed: a tile
    /// that has no other is touched by nothing.
    pub(super) fn any(&mut self) -> bool {
        while !self.ready && self.rows.left() > 0 {
            self.rows.read(self.block);
            self.ready = !self.block.is_empty();
        }
        self.ready
    }
}

impl Blocks for TileBlocks<'_> {
    fn rows(&self) -> usize {
        let ready = if self.ready { self.block.rows() } else { 0 };
        ready + self.rows.left() as usize
    }

    fn next(&mut self) -> Option<&Block> {
        let any = self.any();
        self.ready = false;
        any.then_some(&*self.block)
    }
}
