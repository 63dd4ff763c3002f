//! What stands in a VDB file before a grid's tree: which grids there are, how they
//! are stored, and how they lie in space.

use glam::{DAffine3, DMat3, DVec3};

use super::packed::Packing;
use crate::error::{Result, one_line};
use crate::scene::bytes::Bytes;

/// The versions of the file format that are read: from the one on that says for
/// each grid how it is packed (OpenVDB 3.0, 2014) to the newest known.
const VERSIONS: std::ops::RangeInclusive<u32> = 222..=224;
/// The only type of grid that is read: floats, in OpenVDB's usual tree.
const FLOAT_GRID: &str = "Tree_float_5_4_3";
/// What older files append to the type of a grid of half floats.
const HALF: &str = "_HalfFloat";
/// What OpenVDB calls a grid of densities.
const DENSITY: &str = "density";

/// A grid, without its tree.
pub(super) struct Grid {
    pub name: String,
    pub packing: Packing,
    /// Whether values are stored as half floats.
    pub half: bool,
    /// From voxels to the scene.
    pub place: DAffine3,
    /// Where the voxels' values begin and end.
    pub blocks: u64,
    pub end: u64,
}

/// Where a grid is.
struct Entry {
    name: String,
    kind: String,
    is_instance: bool,
    grid: u64,
    blocks: u64,
    end: u64,
}

/// Finds the grid to draw: that of the name `density`, else the first of floats.
/// After it `bytes` stand at its tree. The second value tells what is left out.
pub(super) fn find(bytes: &mut Bytes) -> Result<(Grid, Option<String>)> {
    let entries = entries(bytes)?;
    let is_float = |e: &&Entry| e.kind.trim_end_matches(HALF) == FLOAT_GRID && !e.is_instance;
    let of_floats = || entries.iter().filter(is_float);
    let Some(entry) = of_floats().find(|e| e.name == DENSITY).or_else(|| of_floats().next()) else {
        let found: Vec<String> =
            entries.iter().map(|e| format!("'{}' of {}", e.name, e.kind)).collect();
        let what = format!("it has no grid of {FLOAT_GRID} (it has: {})", found.join(", "));
        return Err(bytes.unsupported(what, "save the density as a float grid"));
    };
    let left_out = (entries.len() > 1)
        .then(|| format!("of its {} grids only '{}' is drawn", entries.len(), entry.name));

    bytes.seek(entry.grid)?;
    let flags = bytes.u32()?;
    let Some(packing) = Packing::from_flags(flags) else {
        return Err(bytes.bad(format_args!("its grid is packed in an unknown way ({flags})")));
    };
    let metadata = metadata(bytes)?;
    let entry_of = |name: &str| metadata.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
    if entry_of("class") == Some(b"level set") {
        let what = format_args!("its grid '{}' is a level set, not a density", entry.name);
        return Err(bytes.unsupported(what, "convert it to a fog volume"));
    }
    let grid = Grid {
        name: entry.name.clone(),
        packing,
        half: entry_of("is_saved_as_half_float").is_some_and(|v| v.iter().any(|b| *b != 0)),
        place: place(bytes)?,
        blocks: entry.blocks,
        end: entry.end,
    };
    Ok((grid, left_out))
}

/// Reads the head of the file.
fn entries(bytes: &mut Bytes) -> Result<Vec<Entry>> {
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
