//! Memory for rows: slabs that hold all their columns, one column after the other.

use std::alloc::{Layout, handle_alloc_error};

use memmap2::MmapMut;

/// What a large page holds. Memory of the system in such pages costs a fraction of what it
/// costs in small ones to touch for the first time.
pub(super) const LARGE_PAGE: usize = 2 << 20;

/// The binary logarithm of a slab's rows, at most.
const SHIFT: u32 = 17;

/// Slabs, each with room for as many rows.
#[derive(Debug)]
pub struct Slabs {
    maps: Vec<MmapMut>,
    /// Rows of a slab.
    rows: usize,
}

/// A row's number: its slab in the upper bits, its place there in the lower ones.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct RowNumber(pub u32);

impl RowNumber {
    #[inline(always)]
    pub(super) fn new(slab: usize, place: usize) -> Self {
        RowNumber((slab << SHIFT | place) as u32)
    }

    #[inline(always)]
    pub(super) fn slab(self) -> usize {
        (self.0 >> SHIFT) as usize
    }

    #[inline(always)]
    pub(super) fn place(self) -> usize {
        self.0 as usize & ((1 << SHIFT) - 1)
    }
}

impl Slabs {
    /// Rows of a slab, at most.
    pub(super) const MOST_ROWS: usize = 1 << SHIFT;
    /// As many as can be numbered.
    pub(super) const MOST: usize = 1 << (32 - SHIFT);

    pub(super) fn new(rows: usize) -> Self {
        assert!(rows <= Self::MOST_ROWS);
        Slabs { maps: Vec::new(), rows }
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.maps.len()
    }

    /// Rows of each.
    #[inline(always)]
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Adds one whose rows take so many bytes. Nothing is touched before rows arrive.
    pub(super) fn add(&mut self, bytes_per_row: usize) {
        let bytes = self.rows * bytes_per_row;
        // A mapping of large pages begins at one.
        let is_large = bytes > LARGE_PAGE / 2;
        let length = if is_large { bytes.next_multiple_of(LARGE_PAGE) } else { bytes };
        let Ok(map) = MmapMut::map_anon(length) else {
            // As for any other memory.
            handle_alloc_error(
                Layout::from_size_align(length, 1).expect("it is no more than a few pages"),
            )
        };
        #[cfg(target_os = "linux")]
        if is_large {
            // Where there are none, small pages do.
            let _ = map.advise(memmap2::Advice::HugePage);
        }
        self.maps.push(map);
    }

    /// A slab's bytes.
    #[inline(always)]
    pub(super) fn bytes(&self, slab: usize) -> &[u8] {
        &self.maps[slab]
    }

    /// A slab's bytes, to change.
    #[inline(always)]
    pub(super) fn bytes_mut(&mut self, slab: usize) -> &mut [u8] {
        &mut self.maps[slab]
    }
}
