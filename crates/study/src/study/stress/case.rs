//! A hard case: a few pixels' fragments, and the trace that they make.

use serde::Serialize;

use screendoor_scene::capture::{PatternKind, pattern};
use screendoor_trace::error::Result;
use screendoor_trace::trace::{
    ColourFormat, DepthPlane, Fragment, Header, SampleMask, Trace, TraceWriter, Unorm32,
    WriteOptions,
};

screendoor_trace::options! {
    /// What is hard about a case.
    pub enum Group {
        Opacity = "opacity": "alphas at the ends of their range and of a pixel's samples",
        Layers = "layers": "one layer to a hundred thousand, and transmittances below any float",
        Depth = "depth": "equal, nearly equal and crossing depths, planes beyond the depth range",
        Colour = "colour": "colours of 1e-8 to the largest float beside each other, and negative ones",
        Frame = "frame": "large numbers: objects, pixels times samples, surfaces; few samples",
        Order = "order": "orders that mislead the tracking of surfaces (LK section 2)",
    }
}

/// A hard case. Its pixels come in kinds: all pixels of a kind hold the same fragments, so
/// that a design's mean over them is a mean over independent draws.
#[derive(Clone, Debug)]
pub struct Case {
    /// What is hard about it.
    pub group: Group,
    /// Its name.
    pub name: String,
    /// What it is, in a line.
    pub what: String,
    /// Samples per pixel.
    pub samples: u32,
    /// How colours are stored.
    pub colour: ColourFormat,
    /// The least that errors are shares of, where the truth itself may be next to nothing.
    pub floor: f64,
    /// Behind all fragments.
    pub background: [f32; 3],
    /// The fragments of each kind of pixel in API order, at pixel (0, 0).
    pub kinds: Vec<Vec<Fragment>>,
    /// Pixels of a kind: a square of so many on a side.
    pub side: u32,
    /// The frame's side, where it is larger than the kinds; they lie in its last pixels.
    pub frame: Option<u32>,
    /// The case of the same group whose noise this one's is held against.
    pub against: Option<&'static str>,
}

/// Most fragments of a case for which everything is tried: every instruction set, all seeds.
const LIGHT: u64 = 1 << 17;

impl Case {
    /// A case at 8 samples, single-precision colours over a background that differs from 0
    /// in all channels.
    pub fn new(group: Group, name: impl Into<String>, what: impl Into<String>) -> Self {
        Case {
            group,
            name: name.into(),
            what: what.into(),
            samples: 8,
            colour: ColourFormat::F32,
            floor: f64::from(f32::MIN_POSITIVE),
            background: [0.25, 0.5, 1.0],
            kinds: Vec::new(),
            side: 16,
            frame: None,
            against: None,
        }
    }

    /// The same with one more kind of pixel.
    pub fn kind(mut self, fragments: impl IntoIterator<Item = Fragment>) -> Self {
        self.kinds.push(fragments.into_iter().collect());
        self
    }

    /// The frame's size in pixels.
    pub fn size(&self) -> [u32; 2] {
        match self.frame {
            Some(side) => [side, side],
            None => [self.side * self.kinds.len() as u32, self.side],
        }
    }

    /// The pixels of a kind.
    pub fn pixels(&self, kind: usize) -> impl Iterator<Item = (u32, u32)> + use<> {
        let [width, height] = self.size();
        let (side, kinds) = (self.side, self.kinds.len() as u32);
        let (left, top) = (width - side * (kinds - kind as u32), height - side);
        (0..side * side).map(move |i| (left + i % side, top + i / side))
    }

    /// The fragments of a kind as the trace has them.
    pub fn stored(&self, kind: usize) -> Vec<Fragment> {
        let channel = |c: f32| match self.colour {
            ColourFormat::F16 => half::f16::from_f32(c).to_f32(),
            ColourFormat::F32 => c,
        };
        self.kinds[kind].iter().map(|f| Fragment { colour: f.colour.map(channel), ..*f }).collect()
    }

    /// How many fragments it has.
    pub fn fragments(&self) -> u64 {
        let of_kinds: usize = self.kinds.iter().map(Vec::len).sum();
        of_kinds as u64 * u64::from(self.side * self.side)
    }

    /// Whether it is small enough for everything to be tried.
    pub(crate) fn is_light(&self) -> bool {
        self.fragments() <= LIGHT
    }

    /// What is known of it, for people and programs; how many fragments share a depth is
    /// [`tied_fragments`](screendoor_trace::trace::tied_fragments) of its trace.
    pub fn facts(&self, tied_fragments: u64) -> Facts {
        Facts {
            group: self.group,
            name: self.name.clone(),
            what: self.what.clone(),
            samples: self.samples,
            size: self.size(),
            layers: self.kinds.iter().map(Vec::len).max().unwrap_or(0),
            fragments: self.fragments(),
            tied_fragments,
            against: self.against,
        }
    }

    /// Where its samples lie.
    ///
    /// # Errors
    /// As [`pattern`].
    pub fn positions(&self) -> Result<Vec<[i8; 2]>> {
        Ok(pattern(PatternKind::Nested, self.samples)?.positions)
    }

    /// Its trace.
    ///
    /// # Errors
    /// As [`TraceWriter::new`].
    pub fn trace(&self) -> Result<Trace> {
        let [width, height] = self.size();
        let header = Header {
            width,
            height,
            pattern: pattern(PatternKind::Nested, self.samples)?,
            background: self.background,
            colour: self.colour,
            source: format!("hard case: {}", self.name),
            camera: "none".to_string(),
            ..Header::default()
        };
        let options = WriteOptions::default();
        let mut writer = TraceWriter::new(Vec::new(), "memory", header, options)?;
        for (i, kind) in self.kinds.iter().enumerate() {
            for layer in kind {
                for (x, y) in self.pixels(i) {
                    writer.push(&Fragment { x: x as u16, y: y as u16, ..*layer })?;
                }
            }
        }
        Trace::from_bytes(writer.finish()?.0, "memory")
    }
}

/// A case without its fragments.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Facts {
    /// What is hard about it.
    #[serde(serialize_with = "group_name")]
    pub group: Group,
    /// Its name.
    pub name: String,
    /// What it is, in a line.
    pub what: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Frame width and height in pixels.
    pub size: [u32; 2],
    /// Most fragments of a pixel.
    pub layers: usize,
    /// Fragments of the trace.
    pub fragments: u64,
    /// Those of them that share a depth with another one at a sample.
    pub tied_fragments: u64,
    /// The case whose noise its own is held against.
    pub against: Option<&'static str>,
}

fn group_name<S: serde::Serializer>(group: &Group, serializer: S) -> Result<S::Ok, S::Error> {
    use screendoor_trace::param::Options;
    serializer.serialize_str(Group::CHOICES[*group as usize].name)
}

/// A flat layer over the whole pixel, the `i`-th primitive and object, at `i + 1` steps of
/// 2^-9 of the depth range.
pub(super) fn layer(i: u32, colour: [f32; 3], alpha: f32) -> Fragment {
    Fragment {
        x: 0,
        y: 0,
        coverage: SampleMask::first(8),
        depth: DepthPlane { z: Unorm32((i + 1) << 23), dzdx: 0, dzdy: 0 },
        colour,
        alpha,
        primitive: i,
        object: i,
        ..Fragment::default()
    }
}

/// The same at a depth of its own.
pub(super) fn at_depth(z: u32, f: Fragment) -> Fragment {
    Fragment { depth: DepthPlane { z: Unorm32(z), ..f.depth }, ..f }
}

/// The same with slopes.
pub(super) fn sloped(dzdx: i32, dzdy: i32, f: Fragment) -> Fragment {
    Fragment { depth: DepthPlane { dzdx, dzdy, ..f.depth }, ..f }
}

/// The same over some samples.
pub(super) fn over(mask: u64, f: Fragment) -> Fragment {
    Fragment { coverage: SampleMask(mask), ..f }
}

/// The `i`-th of four colours that differ in every channel.
pub(super) fn hue(i: u32) -> [f32; 3] {
    [[1.0, 0.25, 0.5], [0.125, 1.0, 0.25], [0.5, 0.125, 1.0], [0.75, 0.75, 0.0]][i as usize % 4]
}
