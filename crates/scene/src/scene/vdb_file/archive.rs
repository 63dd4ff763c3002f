//! What stands in a VDB file before a grid's tree: which grids there are, how they
//! are stored, and how they lie in space.

use glam::{DAffine3, DMat3, DVec3};

use super::packed::Packing;
use crate::scene::bytes::Bytes;
use screendoor_trace::error::{Error, Result, one_line};

/// The versions of the file format that are read: from the one on that says for
/// each grid how it is packed (OpenVDB 3.0, 2014) to the newest known.
const VERSIONS: std::ops::RangeInclusive<u32> = 222..=224;
/// The types of grids that are read: real numbers, in OpenVDB's usual tree; of 4 bytes and of 8.
const REAL_GRIDS: [(&str, usize); 2] = [("Tree_float_5_4_3", 4), ("Tree_double_5_4_3", 8)];
/// What older files append to the type of a grid of half floats.
const HALF: &str = "_HalfFloat";
/// What OpenVDB calls a grid of densities.
const DENSITY: &str = "density";

/// A grid, without its tree.
pub(super) struct Grid {
    pub name: String,
    /// What it says of its values: `level set`, `fog volume`, or anything.
    pub class: String,
    pub packing: Packing,
    /// How many bytes a value has where it stands alone, ...
    pub wide: usize,
    /// ... and among others: less where they are stored as half floats.
    pub stored: usize,
    /// From voxels to the scene.
    pub place: DAffine3,
    /// Where its tree begins, and where its voxels' values begin and end.
    pub tree: u64,
    pub blocks: u64,
    pub end: u64,
}

impl Grid {
    /// Whether it says that it holds distances to a surface.
    pub(super) fn is_level_set(&self) -> bool {
        self.class == "level set"
    }
}

/// Where a grid is.
pub(super) struct Entry {
    pub name: String,
    pub kind: String,
    is_instance: bool,
    grid: u64,
    blocks: u64,
    end: u64,
}

impl Entry {
    /// How many bytes a number has, where it is a grid of real numbers.
    fn real(&self) -> Option<usize> {
        let kind = self.kind.trim_end_matches(HALF);
        let found = REAL_GRIDS.iter().find(|(name, _)| *name == kind && !self.is_instance);
        found.map(|(_, bytes)| *bytes)
    }
}

/// The grids that may be drawn, with their numbers among the entries; the first that holds
/// densities is to be. They are the one of the name `wanted`, or else all of real numbers: that
/// of the name `density`, those that call themselves fog volumes, the others.
///
/// # Errors
/// [`Error::Config`] where there is none of the name wanted, [`Error::Unsupported`] where
/// there is none of real numbers.
pub(super) fn candidates(
    bytes: &mut Bytes,
    entries: &[Entry],
    wanted: Option<&str>,
) -> Result<Vec<(usize, Result<Grid>)>> {
    let named = |e: &Entry| wanted.is_none_or(|wanted| e.name == wanted);
    if let Some(wanted) = wanted
        && !entries.iter().any(named)
    {
        return Err(Error::unknown("grid", wanted, entries.iter().map(|e| e.name.as_str())));
    }
    let numbered = entries.iter().enumerate();
    let mut found: Vec<(usize, Result<Grid>)> = numbered
        .filter(|(_, entry)| named(entry))
        .filter_map(|(i, entry)| Some((i, open(bytes, entry, entry.real()?))))
        .collect();
    if found.is_empty() {
        let all = entries.iter().filter(|e| named(e));
        let all: Vec<String> = all.map(|e| format!("'{}' of {}", e.name, e.kind)).collect();
        let kinds = REAL_GRIDS.map(|(name, _)| name).join(" or ");
        let what = format!("it has no grid of {kinds} (it has: {})", all.join(", "));
        return Err(bytes.unsupported(what, "save the density as a float grid"));
    }
    found.sort_by_key(|(i, grid)| match grid {
        _ if entries[*i].name == DENSITY => 0,
        Ok(grid) if grid.class == "fog volume" => 1,
        _ => 2,
    });
    Ok(found)
}

/// Reads what stands before a grid's tree.
fn open(bytes: &mut Bytes, entry: &Entry, wide: usize) -> Result<Grid> {
    bytes.seek(entry.grid)?;
    let flags = bytes.u32()?;
    let Some(packing) = Packing::from_flags(flags) else {
        return Err(bytes.bad(format_args!("its grid is packed in an unknown way ({flags})")));
    };
    let metadata = metadata(bytes)?;
    let entry_of = |name: &str| metadata.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
    let class = String::from_utf8_lossy(entry_of("class").unwrap_or(b"")).into_owned();
    let half = entry_of("is_saved_as_half_float").is_some_and(|v| v.iter().any(|b| *b != 0));
    Ok(Grid {
        name: entry.name.clone(),
        class,
        packing,
        wide,
        stored: if half { 2 } else { wide },
        place: place(bytes)?,
        tree: bytes.at() as u64,
        blocks: entry.blocks,
        end: entry.end,
    })
}

/// Reads the head of the file: which grids there are.
pub(super) fn entries(bytes: &mut Bytes) -> Result<Vec<Entry>> {
    const MAGIC: &[u8] = b" BDV\0\0\0\0";
    /// The length of the file's own identifier.
    const UUID: usize = 36;
    if bytes.left() < MAGIC.len() || bytes.take(MAGIC.len())? != MAGIC {
        return Err(bytes.bad("it does not begin as an OpenVDB file does"));
    }
    let version = bytes.u32()?;
    if !VERSIONS.contains(&version) {
        let (first, last) = (VERSIONS.start(), VERSIONS.end());
        let what = format_args!("it is of format {version}, and {first} to {last} are read");
        return Err(bytes.unsupported(what, "save it with another version of OpenVDB"));
    }
    let (_major, _minor) = (bytes.u32()?, bytes.u32()?);
    if bytes.u8()? == 0 {
        let what = "it does not say where its grids are";
        return Err(bytes.unsupported(what, "write it to a file, not to a stream"));
    }
    bytes.take(UUID)?;
    metadata(bytes)?;
    let count = bytes.u32()?;
    let mut entries = Vec::new();
    for _ in 0..count {
        let name = text(bytes)?;
        // Grids of one name are told apart by what follows this character.
        let name = name.split('\x1e').next().unwrap_or("");
        let entry = Entry {
            name: one_line(name),
            kind: one_line(&text(bytes)?),
            is_instance: !text(bytes)?.is_empty(),
            grid: bytes.u64()?,
            blocks: bytes.u64()?,
            end: bytes.u64()?,
        };
        // Forwards only: otherwise this might never end.
        if entry.end < bytes.at() as u64 {
            return Err(bytes.bad(format_args!("its grid '{}' ends before it begins", entry.name)));
        }
        bytes.seek(entry.end)?;
        entries.push(entry);
    }
    Ok(entries)
}

fn text(bytes: &mut Bytes) -> Result<String> {
    let length = bytes.u32()?;
    Ok(String::from_utf8_lossy(bytes.take(length as usize)?).into_owned())
}

/// Named values, whatever their type.
fn metadata<'a>(bytes: &mut Bytes<'a>) -> Result<Vec<(String, &'a [u8])>> {
    let count = bytes.u32()?;
    let mut values = Vec::new();
    for _ in 0..count {
        let (name, _type) = (text(bytes)?, text(bytes)?);
        let length = bytes.u32()?;
        values.push((name, bytes.take(length as usize)?));
    }
    Ok(values)
}

/// The transformation from voxels to the scene.
fn place(bytes: &mut Bytes) -> Result<DAffine3> {
    let name = text(bytes)?;
    // Behind a scale stand the voxels' size and what follows from it.
    let (place, derived) = match name.as_str() {
        "UniformScaleMap" | "ScaleMap" => (DAffine3::from_scale(vector(bytes)?), 4),
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let (move_by, scale) = (vector(bytes)?, vector(bytes)?);
            (DAffine3::from_translation(move_by) * DAffine3::from_scale(scale), 4)
        }
        "TranslationMap" => (DAffine3::from_translation(vector(bytes)?), 0),
        "AffineMap" | "UnitaryMap" => {
            // Four rows of four, to be multiplied by row vectors from the left.
            let mut row = || {
                let row = vector(bytes)?;
                bytes.f64().map(|_| row)
            };
            let turn = DMat3::from_cols(row()?, row()?, row()?);
            (DAffine3::from_mat3_translation(turn, row()?), 0)
        }
        other => {
            let what = format!("its grid lies in space by '{}'", one_line(other));
            return Err(bytes.unsupported(what, "resample it to a linear transformation"));
        }
    };
    for _ in 0..derived {
        vector(bytes)?;
    }
    let volume = place.matrix3.determinant().abs();
    if !place.is_finite() || !volume.is_normal() {
        return Err(bytes.bad("its voxels have no finite size"));
    }
    Ok(place)
}

fn vector(bytes: &mut Bytes) -> Result<DVec3> {
    Ok(DVec3::new(bytes.f64()?, bytes.f64()?, bytes.f64()?))
}
