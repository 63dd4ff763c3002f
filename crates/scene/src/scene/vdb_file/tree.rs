//! A grid's tree: a root, nodes of 32³ and of 16³ children, leaves of 8³ voxels.
//!
//! First stands the tree's shape, then the leaves' values in the same order. The
//! format: OpenVDB 11, `openvdb/tree/{RootNode,InternalNode,LeafNode}.h` and
//! `openvdb/io/Compression.h`.

use glam::IVec3;
use half::f16;

use super::archive::Grid;
use crate::scene::bytes::Bytes;
use screendoor_trace::error::{Error, Result};

/// Voxels, children, along a node's side, as powers of 2.
const LEAF: u32 = 3;
const LOWER: u32 = 4;
const UPPER: u32 = 5;

/// The most voxels that are read: tiles of any size take a few bytes in the file.
const MAX_VOXELS: usize = 1 << 24;

/// A voxel that is active and of more than nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Voxel {
    /// Its middle, counted in voxels.
    pub at: IVec3,
    pub density: f32,
}

/// What a grid's tree holds.
pub(super) struct Values {
    /// The active voxels of more than nothing.
    pub voxels: Vec<Voxel>,
    /// How many active ones are below nothing.
    pub negative: u64,
    /// Whether all active values look like distances to a surface: of both signs, and not
    /// beyond what is everywhere else, which is not 0.
    pub are_distances: bool,
}

/// Reads a grid's values.
pub(super) fn read(bytes: &mut Bytes, grid: &Grid) -> Result<Values> {
    bytes.seek(grid.tree)?;
    let mut reader = Reader {
        bytes,
        grid,
        voxels: Vec::new(),
        leaves: Vec::new(),
        background: 0.0,
        range: [f32::INFINITY, f32::NEG_INFINITY],
        negative: 0,
    };
    reader.root()?;
    if reader.bytes.at() as u64 != grid.blocks {
        let (at, claimed) = (reader.bytes.at(), grid.blocks);
        let what = format_args!("its tree ends at byte {at}, and {claimed} was announced");
        return Err(reader.bytes.bad(what));
    }
    for leaf in std::mem::take(&mut reader.leaves) {
        reader.leaf(leaf)?;
    }
    if reader.bytes.at() as u64 != grid.end {
        let (at, claimed) = (reader.bytes.at(), grid.end);
        let what = format_args!("its voxels end at byte {at}, and {claimed} was announced");
        return Err(reader.bytes.bad(what));
    }
    let [least, most] = reader.range;
    // A little more, for what rounding does to a half float.
    let beyond = reader.background * 1.001;
    let are_distances =
        reader.background > 0.0 && least < 0.0 && most > 0.0 && most <= beyond && -least <= beyond;
    Ok(Values { voxels: reader.voxels, negative: reader.negative, are_distances })
}

/// A corner of a node, in voxels. Nodes of the file's own making may lie anywhere,
/// so that sums of 32 bits could overflow.
type Corner = [i64; 3];

struct Reader<'r, 'a> {
    bytes: &'r mut Bytes<'a>,
    grid: &'r Grid,
    voxels: Vec<Voxel>,
    leaves: Vec<Corner>,
    /// The value of all that is not stored.
    background: f32,
    /// The least and the greatest active value.
    range: [f32; 2],
    negative: u64,
}

impl<'a> Reader<'_, 'a> {
    fn root(&mut self) -> Result<()> {
        let buffers = self.bytes.u32()?;
        if buffers != 1 {
            let what = format_args!("its tree has {buffers} buffers, and 1 is read");
            return Err(self.bytes.unsupported(what, "save the grid alone"));
        }
        self.background = self.number()?;
        let (tiles, children) = (self.bytes.u32()?, self.bytes.u32()?);
        for _ in 0..tiles {
            let corner = self.corner()?;
            let density = self.number()?;
            if self.bytes.u8()? != 0 {
                self.tile(corner, UPPER + LOWER + LEAF, density)?;
            }
        }
        for _ in 0..children {
            let corner = self.corner()?;
            self.upper(corner)?;
        }
        Ok(())
    }

    /// A value that stands alone, as the nearest of single precision.
    fn number(&mut self) -> Result<f32> {
        match self.grid.wide {
            8 => Ok(self.bytes.f64()? as f32),
            _ => self.bytes.f32(),
        }
    }

    fn corner(&mut self) -> Result<Corner> {
        Ok([self.bytes.i32()?, self.bytes.i32()?, self.bytes.i32()?].map(i64::from))
    }

    fn upper(&mut self, corner: Corner) -> Result<()> {
        for child in self.inner(corner, UPPER, LOWER + LEAF)? {
            for leaf in self.inner(child, LOWER, LEAF)? {
                // Told again, with the values.
                Mask::read(self.bytes, LEAF)?;
                self.leaves.push(leaf);
            }
        }
        Ok(())
    }

    /// Reads a node whose children have sides of 2^`size` voxels: its tiles become
    /// voxels; the children's corners.
    fn inner(&mut self, corner: Corner, dimension: u32, size: u32) -> Result<Vec<Corner>> {
        let children = Mask::read(self.bytes, dimension)?;
        let active = Mask::read(self.bytes, dimension)?;
        let tiles = self.values(dimension, &active)?;
        let mut corners = Vec::new();
        for (i, density) in tiles {
            let at = offset(corner, i, dimension, size);
            // What has a child is none of its own.
            if !children.holds(i) {
                self.tile(at, size, density)?;
            }
        }
        for i in children.iter() {
            corners.push(offset(corner, i, dimension, size));
        }
        Ok(corners)
    }

    fn leaf(&mut self, corner: Corner) -> Result<()> {
        let active = Mask::read(self.bytes, LEAF)?;
        for (i, density) in self.values(LEAF, &active)? {
            self.voxel(offset(corner, i, LEAF, 0), density)?;
        }
        Ok(())
    }

    /// A cube of voxels of one density, with sides of 2^`size`.
    fn tile(&mut self, corner: Corner, size: u32, density: f32) -> Result<()> {
        if density <= 0.0 {
            return self.nothing(density, 1 << (3 * size));
        }
        let count = 1_usize << (3 * size);
        if self.voxels.len() + count > MAX_VOXELS {
            return Err(self.too_many());
        }
        (0..count).try_for_each(|i| self.voxel(offset(corner, i, size, 0), density))
    }

    fn voxel(&mut self, at: Corner, density: f32) -> Result<()> {
        if !density.is_finite() {
            return Err(self.bytes.bad(format_args!("its voxel {at:?} has the density {density}")));
        }
        if density <= 0.0 {
            return self.nothing(density, 1);
        }
        self.range = [self.range[0].min(density), self.range[1].max(density)];
        if self.voxels.len() == MAX_VOXELS {
            return Err(self.too_many());
        }
        let [Ok(x), Ok(y), Ok(z)] = at.map(i32::try_from) else {
            return Err(self.bytes.bad(format_args!("its voxel {at:?} lies too far away")));
        };
        self.voxels.push(Voxel { at: IVec3::new(x, y, z), density });
        Ok(())
    }

    /// Active voxels that draw nothing.
    fn nothing(&mut self, density: f32, count: u64) -> Result<()> {
        self.range = [self.range[0].min(density), self.range[1].max(density)];
        if density < 0.0 {
            self.negative = self.negative.saturating_add(count);
        }
        Ok(())
    }

    fn too_many(&self) -> Error {
        let what = format_args!("it has more than {MAX_VOXELS} active voxels");
        self.bytes.unsupported(what, "resample it to larger voxels")
    }

    /// The values of a node's active entries, each with its number.
    fn values(&mut self, dimension: u32, active: &Mask<'a>) -> Result<Vec<(usize, f32)>> {
        // What stands in for inactive values, which are of no use here: 2 and 4 have
        // one value, 5 has two, and 3 to 5 a mask of which is where. 6 stores all.
        let inactive = self.bytes.u8()?;
        let values = match inactive {
            0 | 1 | 3 | 6 => 0,
            2 | 4 => 1,
            5 => 2,
            other => {
                let what = format_args!("a node's inactive values are stored as {other}");
                return Err(self.bytes.bad(what));
            }
        };
        self.bytes.take(self.grid.wide * values)?;
        if (3..=5).contains(&inactive) {
            Mask::read(self.bytes, dimension)?;
        }
        let packed = self.grid.packing.active_only() && inactive != 6;
        let count = if packed { active.count() } else { 1 << (3 * dimension) };
        let size = self.grid.stored;
        // Of half floats an empty block is not even announced.
        let block = match count {
            0 if size == 2 => Vec::new(),
            _ => self.grid.packing.read(self.bytes, size * count)?,
        };
        let value = |i: usize| match block[size * i..][..size] {
            [a, b] => f16::from_le_bytes([a, b]).to_f32(),
            [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]) as f32,
            _ => unreachable!("values have 2, 4 or 8 bytes"),
        };
        let places = active.iter().enumerate();
        Ok(places.map(|(k, i)| (i, value(if packed { k } else { i }))).collect())
    }
}

/// Where entry `i` of a node with 2^`dimension` entries on a side begins, each
/// having a side of 2^`size` voxels: x runs slowest, z fastest.
fn offset(corner: Corner, i: usize, dimension: u32, size: u32) -> Corner {
    let along = |axis: u32| ((i >> ((2 - axis) * dimension)) & ((1 << dimension) - 1)) << size;
    [0, 1, 2].map(|axis| corner[axis as usize] + along(axis) as i64)
}

/// A bit for each entry of a node.
struct Mask<'a>(&'a [u8]);

impl<'a> Mask<'a> {
    fn read(bytes: &mut Bytes<'a>, dimension: u32) -> Result<Self> {
        bytes.take(1 << (3 * dimension - 3)).map(Mask)
    }

    fn holds(&self, i: usize) -> bool {
        self.0[i / 8] >> (i % 8) & 1 != 0
    }

    fn count(&self) -> usize {
        self.0.iter().map(|b| b.count_ones() as usize).sum()
    }

    fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        (0..8 * self.0.len()).filter(|i| self.holds(*i))
    }
}
