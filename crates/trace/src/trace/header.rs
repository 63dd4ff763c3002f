//! What a trace says about itself: frame, samples, background, origin.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::error::{Error, Result};
use crate::param::Options;
use crate::picture::Space;
use crate::trace::column::{Scalar, ValueType};
use crate::trace::columns::ColumnId;
use crate::trace::fragment::MAX_SAMPLES;
use crate::trace::metadata::MetadataReader;
use crate::trace::view::View;

/// The newest version of the format that this crate writes, that of traces whose colours are
/// not linear; it reads every version with the same major number.
pub const FORMAT_VERSION: &str = "1.2";
/// The version of other traces with a view.
pub(super) const WITH_VIEW: &str = "1.1";
/// The version of traces without a view, which are as they were before there was any.
const WITHOUT_VIEW: &str = "1.0";

/// The standard patterns of Direct3D and Vulkan of 1, 2, 4, 8 and 16 samples.
const STANDARD: [&[[i8; 2]]; 5] = [
    &[[0, 0]],
    &[[4, 4], [-4, -4]],
    &[[-2, -6], [6, -2], [-6, 2], [2, 6]],
    &[[1, -3], [-1, 3], [5, 1], [-3, -5], [-5, 5], [-7, -1], [3, 7], [7, -7]],
    &[
        [1, 1],
        [-1, -3],
        [-3, 2],
        [4, -1],
        [-5, -2],
        [2, 5],
        [5, 3],
        [3, -5],
        [-2, 6],
        [0, -7],
        [-4, -6],
        [-6, 4],
        [-8, 0],
        [7, -4],
        [6, 7],
        [-7, -8],
    ],
];

/// The longest side of a frame, in pixels: coordinates are 16 bits.
pub const MAX_SIDE: u32 = 1 << 16;

/// Where a pixel's samples lie.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub struct SamplePattern {
    /// The pattern's name, for people.
    pub name: String,
    /// `[x, y]` offsets from the pixel's centre in 1/16 pixel, x to the right and
    /// y downwards, each in −8..=7; 1 to 64 of them, a power of two.
    pub positions: Vec<[i8; 2]>,
    /// Whether the first 2^k positions are a good pattern for every k, so that a
    /// trace taken with it serves every smaller sample count.
    pub nested: bool,
}

impl SamplePattern {
    /// How many samples a pixel has.
    pub fn samples(&self) -> u32 {
        self.positions.len() as u32
    }

    /// The standard pattern of Direct3D and Vulkan: of 1, 2, 4, 8 or 16 samples.
    pub fn standard(samples: u32) -> Option<Self> {
        let positions = STANDARD.into_iter().find(|p| p.len() == samples as usize)?.to_vec();
        Some(SamplePattern { name: format!("standard-{samples}"), positions, nested: false })
    }

    /// Whether `n` is a sample count that a pattern can have: 1, 2, 4, … 64.
    pub fn is_count(n: u32) -> bool {
        n.is_power_of_two() && n <= MAX_SAMPLES
    }

    /// The positions that a replay at `samples` samples uses: the first ones.
    ///
    /// # Errors
    /// [`Error::Config`] where the count is no power of two up to the pattern's
    /// own, or is smaller and the pattern is not nested.
    pub fn prefix(&self, samples: u32) -> Result<&[[i8; 2]]> {
        let own = self.samples();
        if !Self::is_count(samples) || samples > own {
            return Err(Error::config(
                format_args!("the trace cannot be replayed at {samples} samples"),
                format_args!(
                    "its pixels have {own}: ask for {} {own}",
                    if self.nested { "a power of two up to" } else { "just" }
                ),
            ));
        }
        if samples < own && !self.nested {
            return Err(Error::config(
                format_args!("the trace cannot be replayed at {samples} samples"),
                format_args!(
                    "its pattern '{}' serves {own} samples only: \
                     capture with --samples {samples}, or with --samples 64, which serves all",
                    self.name
                ),
            ));
        }
        Ok(&self.positions[..samples as usize])
    }
}

/// The precision in which a trace keeps colours.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ColourFormat {
    /// Half precision: 11 significant bits, values up to 65504.
    #[default]
    F16,
    /// Single precision.
    F32,
}

/// What a trace says about itself.
///
/// Where one is written down, `..Header::default()` at its end keeps the text good when fields
/// are added; a default alone has no pixels and passes no [`Header::check`].
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Header {
    /// Frame width in pixels, 1 to 65536.
    pub width: u32,
    /// Frame height in pixels, 1 to 65536.
    pub height: u32,
    /// Where each pixel's samples lie.
    pub pattern: SamplePattern,
    /// Colour behind everything, in the same space as all colours.
    pub background: [f32; 3],
    /// What the numbers of colours stand for, in which designs blend them.
    pub space: Space,
    /// Precision of the colour columns; in a file it follows from their types.
    pub colour: ColourFormat,
    /// What was captured: a file's name, a built-in scene and its parameters.
    pub source: String,
    /// From where it was seen, in words.
    pub camera: String,
    /// The same in numbers, where they are known. No part of the content hash.
    pub view: Option<View>,
    /// Columns that have one value in all rows; they have no column in the file.
    #[serde(skip)]
    pub constants: BTreeMap<ColumnId, Scalar>,
    /// Optional columns that the trace has, stored or constant; in a file it follows from
    /// these.
    #[serde(skip)]
    pub optional: BTreeSet<ColumnId>,
}

/// The key of the space of colours.
pub(super) const SPACE: &str = key::SPACE;

const DEPTH_CONVENTION: &str = "unorm32 near=0 far=4294967295 less-equal";

/// The metadata keys of the format, all under one prefix.
mod key {
    pub(super) const VERSION: &str = "screendoor.version";
    pub(super) const WIDTH: &str = "screendoor.width";
    pub(super) const HEIGHT: &str = "screendoor.height";
    pub(super) const SAMPLES: &str = "screendoor.samples";
    pub(super) const POSITIONS: &str = "screendoor.positions";
    pub(super) const PATTERN: &str = "screendoor.pattern";
    pub(super) const NESTED: &str = "screendoor.nested";
    pub(super) const BACKGROUND: &str = "screendoor.background";
    pub(super) const DEPTH: &str = "screendoor.depth";
    pub(super) const SOURCE: &str = "screendoor.source";
    pub(super) const CAMERA: &str = "screendoor.camera";
    pub(super) const SPACE: &str = "screendoor.space";
    pub(super) const CONSTANT: &str = "screendoor.constant.";
}

impl Header {
    /// The type of `column`'s values in a file with this header.
    pub fn value_type(&self, column: ColumnId) -> ValueType {
        let samples = self.pattern.samples();
        match self.colour {
            ColourFormat::F32 if column.accepts(ValueType::F16, samples) => ValueType::F32,
            _ => column.narrowest(samples),
        }
    }

    /// Whether a trace with this header has `column`, stored or constant.
    pub fn has(&self, column: ColumnId) -> bool {
        !column.is_optional() || self.optional.contains(&column)
    }

    /// Whether it stores `column`, a value for each row.
    pub fn stores(&self, column: ColumnId) -> bool {
        self.has(column) && !self.constants.contains_key(&column)
    }

    /// How many bytes one fragment takes in an uncompressed file.
    pub fn row_bytes(&self) -> usize {
        ColumnId::ALL.iter().filter(|c| self.stores(**c)).map(|c| self.value_type(*c).bytes()).sum()
    }

    /// Checks the rules that its fields' types do not enforce.
    ///
    /// # Errors
    /// [`Error::Config`] with the first rule broken.
    pub fn check(&self) -> Result<()> {
        let side = |name, value| {
            if (1..=MAX_SIDE).contains(&value) {
                return Ok(());
            }
            Err(Error::config(
                format_args!("a frame {} pixels {name} cannot be", value),
                format_args!("each side is 1 to {MAX_SIDE} pixels"),
            ))
        };
        side("wide", self.width)?;
        side("high", self.height)?;
        if !SamplePattern::is_count(self.pattern.samples()) {
            return Err(Error::config(
                format_args!("a pixel cannot have {} samples", self.pattern.samples()),
                "samples are 1, 2, 4, 8, 16, 32 or 64",
            ));
        }
        if self.pattern.positions.iter().flatten().any(|o| !(-8..=7).contains(o)) {
            return Err(Error::config(
                "a sample lies outside its pixel",
                "offsets are -8 to 7 sixteenths of a pixel",
            ));
        }
        let unnamed = |id: &&ColumnId| !self.has(**id);
        if let Some(id) = self.constants.keys().find(unnamed) {
            return Err(Error::config(
                format_args!("'{}' is constant and not among the optional columns", id.name()),
                "name it in the header's optional columns",
            ));
        }
        if !ColumnId::ALL.iter().any(|id| self.stores(*id)) {
            return Err(Error::config(
                "all columns are constant, so that rows cannot be counted",
                "store one of them",
            ));
        }
        if !self.background.iter().all(|c| c.is_finite()) {
            return Err(Error::config("the background is not finite", "give three finite numbers"));
        }
        self.view.as_ref().map_or(Ok(()), View::check)
    }

    /// The version of the format that a file with this header has.
    fn version(&self) -> &'static str {
        match (self.space, self.view) {
            (Space::Encoded, _) => FORMAT_VERSION,
            (Space::Linear, Some(_)) => WITH_VIEW,
            (Space::Linear, None) => WITHOUT_VIEW,
        }
    }

    /// The header as the metadata of the Arrow schema.
    pub(crate) fn to_metadata(&self) -> BTreeMap<String, String> {
        let join = |items: Vec<String>| items.join(" ");
        let positions = self.pattern.positions.iter().map(|[x, y]| format!("{x},{y}")).collect();
        let mut map: BTreeMap<String, String> = [
            (key::VERSION, self.version().to_string()),
            (key::WIDTH, self.width.to_string()),
            (key::HEIGHT, self.height.to_string()),
            (key::SAMPLES, self.pattern.samples().to_string()),
            (key::POSITIONS, join(positions)),
            (key::PATTERN, self.pattern.name.clone()),
            (key::NESTED, self.pattern.nested.to_string()),
            (key::BACKGROUND, join(self.background.iter().map(f32::to_string).collect())),
            (key::DEPTH, DEPTH_CONVENTION.to_string()),
            (key::SOURCE, self.source.clone()),
            (key::CAMERA, self.camera.clone()),
        ]
        .into_iter()
        .chain(self.view.into_iter().flat_map(View::to_metadata))
        .map(|(k, v)| (k.to_string(), v))
        .collect();
        // What is meant where nothing is said, in all older traces.
        if self.space != Space::default() {
            map.insert(key::SPACE.to_string(), self.space.name().to_string());
        }
        for (column, value) in &self.constants {
            map.insert(format!("{}{}", key::CONSTANT, column.name()), value.to_string());
        }
        map
    }

    /// Reads the header back from the metadata of the file at `place`. The
    /// colour format is the caller's to fill in.
    pub(crate) fn from_metadata(map: &BTreeMap<String, String>, place: &str) -> Result<Self> {
        let reader = MetadataReader { map, place };
        let version = reader.text(key::VERSION)?;
        let major = |v: &str| v.split('.').next().and_then(|m| m.parse::<u32>().ok());
        match major(version) {
            Some(m) if Some(m) == major(FORMAT_VERSION) => {}
            Some(_) => {
                return Err(Error::unsupported(
                    place,
                    format_args!("the trace has format version {version}"),
                    format_args!("this program reads {FORMAT_VERSION}: use a program of its age"),
                ));
            }
            None => return Err(reader.bad(key::VERSION, "a version such as 1.0")),
        }
        let depth = reader.text(key::DEPTH)?;
        if depth != DEPTH_CONVENTION {
            return Err(Error::unsupported(
                format_args!("{place}, metadata {}", key::DEPTH),
                format_args!("the depth convention '{depth}' is unknown"),
                format_args!("convert the trace to '{DEPTH_CONVENTION}'"),
            ));
        }
        let positions = reader.list(key::POSITIONS, "offsets such as '1,-3 -1,3'", |text| {
            let (x, y) = text.split_once(',')?;
            Some([x.parse().ok()?, y.parse().ok()?])
        })?;
        let background: Vec<f32> =
            reader.list(key::BACKGROUND, "three numbers", |text| text.parse().ok())?;
        let samples: u32 = reader.parse(key::SAMPLES, "a whole number")?;
        if samples as usize != positions.len() {
            return Err(reader.bad(key::POSITIONS, &format!("{samples} positions")));
        }
        let space = match map.get(key::SPACE) {
            None => Space::default(),
            Some(name) => {
                let known = Space::ALL.iter().find(|space| space.name() == name);
                let names: Vec<&str> = Space::CHOICES.iter().map(|choice| choice.name).collect();
                *known.ok_or_else(|| reader.bad(key::SPACE, &names.join(" or ")))?
            }
        };
        let mut constants = BTreeMap::new();
        for column in ColumnId::ALL {
            let name = format!("{}{}", key::CONSTANT, column.name());
            if let Some(text) = map.get(&name) {
                let value = column.parse(text);
                let value = value.ok_or_else(|| reader.bad(&name, "a value of the column"))?;
                constants.insert(column, value);
            }
        }
        let header = Header {
            width: reader.parse(key::WIDTH, "a whole number")?,
            height: reader.parse(key::HEIGHT, "a whole number")?,
            pattern: SamplePattern {
                name: reader.text(key::PATTERN)?.to_string(),
                positions,
                nested: reader.parse(key::NESTED, "true or false")?,
            },
            background: background
                .try_into()
                .map_err(|_| reader.bad(key::BACKGROUND, "three numbers"))?,
            space,
            colour: ColourFormat::default(),
            source: reader.text(key::SOURCE)?.to_string(),
            camera: reader.text(key::CAMERA)?.to_string(),
            view: View::from_metadata(&reader)?,
            optional: constants.keys().copied().filter(|id| id.is_optional()).collect(),
            constants,
        };
        header.check().map_err(|e| match e {
            Error::Config { what, hint } => {
                Error::invalid(format_args!("{place}, metadata"), what, hint)
            }
            other => other,
        })?;
        Ok(header)
    }
}

/// The entries of a schema's metadata as they are where a trace has no view: a trace's
/// content is the same with and without.
pub(super) fn without_view(
    metadata: &BTreeMap<String, String>,
) -> impl Iterator<Item = (&str, &str)> {
    let entries = metadata.iter().map(|(key, value)| (key.as_str(), value.as_str()));
    entries.filter(|(key, _)| !View::has_key(key)).map(|(key, value)| match (key, value) {
        (key::VERSION, WITH_VIEW) => (key, WITHOUT_VIEW),
        entry => entry,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Header {
        Header {
            width: 640,
            height: 480,
            pattern: SamplePattern {
                name: "standard-2".into(),
                positions: vec![[4, 4], [-4, -4]],
                nested: false,
            },
            background: [0.25, 1e-7, 3.5],
            colour: ColourFormat::F16,
            source: "builtin:test".into(),
            camera: "front".into(),
            constants: [
                (ColumnId::Alpha, Scalar::Real(0.3)),
                (ColumnId::Dzdx, Scalar::Signed(-7)),
                (ColumnId::Object, Scalar::Unsigned(9)),
            ]
            .into(),
            ..Header::default()
        }
    }

    #[test]
    fn metadata_round_trip() {
        let header = header();
        assert_eq!(Header::from_metadata(&header.to_metadata(), "t").unwrap(), header);
    }

    #[test]
    fn every_missing_or_mangled_key_is_an_error_that_names_it() {
        let good = header().to_metadata();
        for key in good.keys().filter(|k| !k.starts_with(key::CONSTANT)) {
            let mut map = good.clone();
            map.remove(key);
            let error = Header::from_metadata(&map, "t.arrow").unwrap_err().to_string();
            assert!(error.contains(key.as_str()) && error.starts_with("t.arrow"), "{error}");
        }
        for key in
            good.keys().filter(|k| ![key::PATTERN, key::SOURCE, key::CAMERA].contains(&k.as_str()))
        {
            let mut map = good.clone();
            map.insert(key.clone(), "bad!".into());
            let error = Header::from_metadata(&map, "t.arrow").unwrap_err().to_string();
            assert!(error.contains(key.as_str()) || error.contains("version"), "{error}");
        }
    }

    #[test]
    fn a_newer_major_version_is_refused() {
        let mut map = header().to_metadata();
        map.insert(key::VERSION.into(), "1.9".into());
        assert!(Header::from_metadata(&map, "t").is_ok());
        map.insert(key::VERSION.into(), "2.0".into());
        let error = Header::from_metadata(&map, "t").unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    }

    #[test]
    fn prefixes_follow_the_pattern() {
        let mut pattern = header().pattern;
        assert_eq!(pattern.prefix(2).unwrap().len(), 2);
        assert!(pattern.prefix(1).unwrap_err().to_string().contains("--samples 64"));
        pattern.nested = true;
        assert_eq!(pattern.prefix(1).unwrap(), [[4, 4]]);
        assert!(pattern.prefix(3).is_err() && pattern.prefix(4).is_err());
    }
}
