//! Reading EXR files: of their parts and layers the one that is asked for, block by block.

use std::io::Cursor;
use std::path::Path;

use exr::block::reader::ChunksReader;
use exr::meta::MetaData;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use half::f16;

use crate::error::{Error, Result};
use crate::picture::opened::{Opened, Window};
use crate::picture::read::{check_frame, overclaimed};
use crate::picture::write::exr_error;
use crate::tile::TileGrid;

/// How many bytes of pixels a byte of a file can stand for, more than any packing of EXR does.
const MOST_PACKED: u64 = 1 << 14;

/// Channels of one part that share what stands before their last dot.
struct Group {
    /// The part's place in the file.
    part: usize,
    /// Its name; empty where it has none.
    part_name: String,
    /// What stands before the last dot of the channels' names; empty where there is none.
    prefix: String,
    /// The channels' own names, and their places in the part.
    channels: Vec<(String, usize)>,
}

impl Group {
    /// The name by which it is asked for: the part's, the layer's, or both.
    fn name(&self) -> String {
        match (&*self.part_name, &*self.prefix) {
            (part, "") => part.to_string(),
            ("", prefix) => prefix.to_string(),
            (part, prefix) if part == prefix => part.to_string(),
            (part, prefix) => format!("{part}.{prefix}"),
        }
    }

    fn channel(&self, wanted: &str) -> Option<usize> {
        let same = |(name, _): &&(String, usize)| name.eq_ignore_ascii_case(wanted);
        self.channels.iter().find(same).map(|(_, place)| *place)
    }

    /// The places of red, green and blue; of the luminance three times where that is all.
    fn colours(&self) -> Option<[usize; 3]> {
        let chroma = self.channel("RY").or(self.channel("BY"));
        match (self.channel("R"), self.channel("G"), self.channel("B"), self.channel("Y")) {
            (Some(r), Some(g), Some(b), _) => Some([r, g, b]),
            (None, None, None, Some(y)) if chroma.is_none() => Some([y; 3]),
            _ => None,
        }
    }

    /// It for people: its name and, where no picture can be made of them, its channels.
    fn told(&self) -> String {
        let name = match self.name() {
            name if name.is_empty() => "(no name)".to_string(),
            name => name,
        };
        let channels: Vec<&str> = self.channels.iter().map(|(name, _)| &**name).collect();
        match self.colours() {
            Some(_) => name,
            None => format!("{name} (channels {})", channels.join(", ")),
        }
    }
}

fn groups(meta: &MetaData) -> Vec<Group> {
    let mut all: Vec<Group> = Vec::new();
    for (part, header) in meta.headers.iter().enumerate() {
        let part_name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
        let part_name = part_name.unwrap_or_default();
        let first = all.len();
        for (place, channel) in header.channels.list.iter().enumerate() {
            let name = channel.name.to_string();
            let (prefix, own) = name.rsplit_once('.').unwrap_or(("", &name));
            let group = match all[first..].iter_mut().position(|g| g.prefix == prefix) {
                Some(at) => &mut all[first + at],
                None => {
                    let (part_name, prefix) = (part_name.clone(), prefix.to_string());
                    all.push(Group { part, part_name, prefix, channels: Vec::new() });
                    all.last_mut().expect("just pushed")
                }
            };
            group.channels.push((own.to_string(), place));
        }
    }
    all
}

/// The group of that name: its whole name, or its layer's or its part's alone where that is
/// a picture's. Without a name the first that is a picture.
fn chosen<'a>(path: &Path, groups: &'a [Group], layer: Option<&str>) -> Result<&'a Group> {
    let told = || groups.iter().map(Group::told).collect::<Vec<_>>().join("; ");
    let Some(wanted) = layer else {
        return groups.iter().find(|g| g.colours().is_some()).ok_or_else(|| {
            Error::invalid(
                path.display(),
                format_args!("none of its layers has the channels R, G and B; it has {}", told()),
                "give an EXR file with these channels",
            )
        });
    };
    let pictures = || groups.iter().filter(|g| g.colours().is_some());
    let found = groups.iter().find(|g| g.name() == wanted);
    let found = found.filter(|g| g.colours().is_some());
    let found = found.or_else(|| pictures().find(|g| g.prefix == wanted));
    if let Some(found) = found.or_else(|| pictures().find(|g| g.part_name == wanted)) {
        return Ok(found);
    }
    if let Some(other) = groups.iter().find(|g| g.name() == wanted) {
        return Err(Error::invalid(
            path.display(),
            format_args!("its layer {} is no picture", other.told()),
            format_args!("name one with the channels R, G and B; it has {}", told()),
        ));
    }
    let names: Vec<String> = groups.iter().map(Group::name).filter(|n| !n.is_empty()).collect();
    if names.is_empty() {
        return Err(Error::config(
            format_args!("{} has no layer '{wanted}'; its layers have no names", path.display()),
            "leave --layer out",
        ));
    }
    let kind = format!("layer of {}:", path.display());
    Err(Error::unknown(&kind, wanted, names.iter().map(String::as_str)))
}

fn meta(path: &Path, bytes: &[u8]) -> Result<MetaData> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), true);
    meta.map_err(|e| exr_error(path, "read", e))
}

/// The names of the layers and parts that are pictures, in their order; an empty one for
/// what has no name.
pub(super) fn layers(path: &Path, bytes: &[u8]) -> Result<Vec<String>> {
    let groups = groups(&meta(path, bytes)?);
    Ok(groups.iter().filter(|g| g.colours().is_some()).map(Group::name).collect())
}

/// Nothing is allocated for a size that a file merely claims.
fn check(path: &Path, header: &Header, group: &Group, length: usize) -> Result<()> {
    let (width, height) = (header.layer_size.0, header.layer_size.1);
    check_frame(path, width, height)?;
    let claimed = (width * height) as u64 * header.channels.bytes_per_pixel as u64;
    if claimed / MOST_PACKED > length as u64 {
        return Err(overclaimed(path, format_args!("{claimed} bytes of pixels"), length));
    }
    let refuse = |what: &str, hint: &str| {
        Err(Error::unsupported(
            path.display(),
            format_args!("layer {}: {what}", group.told()),
            hint,
        ))
    };
    if header.deep {
        return refuse("it holds deep data", "flatten it first");
    }
    let colours = group.colours().into_iter().flatten();
    for place in colours.chain(group.channel("A")) {
        let sampling = header.channels.list[place].sampling;
        if (sampling.0, sampling.1) != (1, 1) {
            return refuse("it is subsampled", "write it with a value for each pixel");
        }
    }
    Ok(())
}

/// Reads the layer `layer` of an EXR file, or its first picture.
///
/// # Errors
/// As [`crate::picture::open`].
pub(super) fn read(path: &Path, bytes: &[u8], layer: Option<&str>) -> Result<Opened> {
    let meta = meta(path, bytes)?;
    let groups = groups(&meta);
    let group = chosen(path, &groups, layer)?;
    let header = &meta.headers[group.part];
    check(path, header, group, bytes.len())?;
    let colours = group.colours().expect("it was chosen for that");
    let alpha = group.channel("A");

    let (width, height) = (header.layer_size.0 as u32, header.layer_size.1 as u32);
    let position = header.own_attributes.layer_position;
    let display = header.shared_attributes.display_window;
    let mut opened = Opened::new(
        TileGrid::new(width, height),
        Window { origin: [position.0, position.1], size: [width, height] },
        Window {
            origin: [display.position.0, display.position.1],
            size: [display.size.0 as u32, display.size.1 as u32],
        },
        alpha.is_some(),
    );
    opened.layer = group.name();
    opened.others = groups.iter().filter(|g| !std::ptr::eq(*g, group)).map(Group::told).collect();

    let fail = |e| exr_error(path, "read", e);
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(fail)?;
    let part = group.part;
    let chunks = reader.filter_chunks(false, |_, _, block| {
        block.layer == part && (block.level.0, block.level.1) == (0, 0)
    });
    let mut row: Vec<f32> = Vec::new();
    let types: Vec<SampleType> = header.channels.list.iter().map(|c| c.sample_type).collect();
    let take = |_: &MetaData, block: exr::block::UncompressedBlock| {
        for line in block.lines(&header.channels) {
            let place = line.location.channel;
            if !colours.contains(&place) && alpha != Some(place) {
                continue;
            }
            row.clear();
            match types[place] {
                SampleType::F16 => {
                    for value in line.read_samples::<f16>() {
                        row.push(value?.to_f32());
                    }
                }
                SampleType::F32 => {
                    for value in line.read_samples::<f32>() {
                        row.push(value?);
                    }
                }
                SampleType::U32 => {
                    for value in line.read_samples::<u32>() {
                        row.push(value? as f32);
                    }
                }
            }
            let (x, y) = (line.location.position.0 as u32, line.location.position.1 as u32);
            for (channel, _) in colours.iter().enumerate().filter(|(_, p)| **p == place) {
                opened.put_row(x, y, channel, &row);
            }
            if alpha == Some(place) {
                opened.put_alpha(x, y, &row);
            }
        }
        Ok(())
    };
    chunks.and_then(|chunks| chunks.decompress_sequential(false, take)).map_err(fail)?;
    Ok(opened)
}
