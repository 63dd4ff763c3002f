//! What a port to another device needs to know of a design: its parameters as
//! constants, how a pixel's state lies in words, and the way back from those words to
//! the pixel of the plain text, which resolves and explains it.

use std::fmt;

use crate::param::{Kind, Param, Value, Values};
use crate::rop::design::{Design, Frame, Info, Site};
use crate::rop::dither::Ranks;
use crate::rop::replay::{Engine, TileState, sites};
use crate::tile::{TileGrid, TileId};

/// A constant of a shader.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Constant {
    /// A `bool`.
    Flag(bool),
    /// A `u32`.
    Whole(u32),
    /// An `f32`.
    Real(f32),
}

/// As it is declared in WGSL: `bool = true`.
impl fmt::Display for Constant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Constant::Flag(v) => write!(f, "bool = {v}"),
            Constant::Whole(v) => write!(f, "u32 = {v}u"),
            Constant::Real(v) => write!(f, "f32 = {v:?}f"),
        }
    }
}

/// A part of a pixel's state on a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Field {
    /// Its name; shaders find its first word in the constant `AT_NAME`.
    pub name: &'static str,
    /// The number of its first word.
    pub at: u32,
    /// How many words it takes.
    pub words: u32,
}

/// What a design declares for its port.
#[derive(Clone, Debug, Default)]
pub struct Declaration {
    constants: Vec<(String, Constant)>,
    fields: Vec<Field>,
    ranks: Option<&'static Ranks>,
    iterations: u32,
    ends_passes: bool,
    samples: u32,
}

impl Declaration {
    /// Samples per pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Loop iterations that a fragment takes, at most.
    pub fn iterations(&mut self, count: u32) {
        self.iterations += count;
    }

    /// There is something to do when all fragments of a pass have been drawn.
    pub fn ends_passes(&mut self) {
        self.ends_passes = true;
    }

    /// A constant beside those of the parameters.
    pub fn constant(&mut self, name: &str, value: Constant) {
        self.constants.push((name.to_string(), value));
    }

    /// `words` words of state of every pixel; none for a part that is not needed.
    pub fn field(&mut self, name: &'static str, words: u32) {
        self.fields.push(Field { name, at: self.words(), words });
    }

    /// A threshold matrix that shaders find behind the samples' places.
    pub fn ranks(&mut self, ranks: &'static Ranks) {
        self.ranks = Some(ranks);
    }

    fn words(&self) -> u32 {
        self.fields.last().map_or(0, |last| last.at + last.words)
    }
}

/// How a state `S` of a pixel lies on a device.
pub trait OnDevice<S> {
    /// Declares constants and state.
    fn declare(&self, to: &mut Declaration);
    /// The state that was declared so.
    fn read(&self, site: Site, from: &PixelWords<'_>) -> S;
}

/// The words of the pixels of a tile: word by word, of each all pixels'.
#[derive(Clone, Copy, Debug)]
pub struct TileWords<'a> {
    /// Words, those of the whole page of which the tile is a part.
    pub words: &'a [u32],
    /// How many words lie between a pixel's word and its next.
    pub stride: usize,
    /// Where the tile's first pixel lies.
    pub first: usize,
}

/// The words of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct PixelWords<'a> {
    tile: TileWords<'a>,
    within: usize,
    fields: &'a [Field],
}

impl PixelWords<'_> {
    /// The words of a field.
    ///
    /// # Panics
    /// Where it was not declared: a fault in the design's own code.
    pub fn field(&self, name: &str) -> impl ExactSizeIterator<Item = u32> {
        let field = self.fields.iter().find(|f| f.name == name);
        let field = field.unwrap_or_else(|| panic!("no field '{name}' was declared"));
        let TileWords { words, stride, first } = self.tile;
        let at = first + self.within;
        (field.at..field.at + field.words).map(move |word| words[word as usize * stride + at])
    }

    /// The words of a field of `N` words.
    ///
    /// # Panics
    /// Where it has fewer.
    pub fn array<const N: usize>(&self, name: &str) -> [u32; N] {
        let mut words = self.field(name);
        std::array::from_fn(|_| words.next().expect("the field has that many words"))
    }

    /// The only word of a field.
    pub fn word(&self, name: &str) -> u32 {
        self.array::<1>(name)[0]
    }

    /// A field of floating-point numbers.
    pub fn reals<const N: usize>(&self, name: &str) -> [f32; N] {
        self.array(name).map(f32::from_bits)
    }

    /// A field of one or two words as a mask.
    pub fn mask(&self, name: &str) -> u64 {
        self.field(name).enumerate().fold(0, |mask, (i, word)| mask | u64::from(word) << (32 * i))
    }

    /// A field of colours, three words each.
    pub fn colours<const N: usize>(&self, name: &str) -> [[f32; 3]; N] {
        let mut words = self.field(name).map(f32::from_bits);
        std::array::from_fn(|_| {
            std::array::from_fn(|_| words.next().expect("the field has that many colours"))
        })
    }
}

type Restore = dyn Fn(TileGrid, TileId, TileWords<'_>, &[Field]) -> TileState + Send + Sync;

/// A design as another device runs it.
pub struct Port {
    /// The shader file that begins the program.
    pub program: &'static str,
    /// Its constants: parameters, and what was declared.
    pub constants: Vec<(String, Constant)>,
    /// A pixel's state.
    pub fields: Vec<Field>,
    /// A threshold matrix.
    pub ranks: Option<&'static Ranks>,
    /// Loop iterations that a fragment takes, at most.
    pub iterations: u32,
    /// Whether there is something to do when all fragments of a pass have been drawn.
    pub ends_passes: bool,
    /// Whether threads may be given samples in place of pixels.
    pub by_sample: bool,
    /// Whether the device's own resolve gives the plain text's bits: a box filter in
    /// single precision.
    pub resolves: bool,
    /// The plain text.
    pub plain: Box<dyn Engine>,
    restore: Box<Restore>,
}

impl Port {
    /// The port of `design`, with the parameters that `info` declares.
    pub fn of<D>(
        program: &'static str,
        info: &Info,
        values: &Values,
        frame: &Frame,
        design: D,
    ) -> Self
    where
        D: Design + OnDevice<D::Pixel> + Clone + 'static,
    {
        let mut declared = Declaration { samples: frame.samples(), ..Declaration::default() };
        design.declare(&mut declared);
        let mut constants = of_parameters(info.params, values);
        constants.push(("SAMPLES".to_string(), Constant::Whole(frame.samples())));
        constants.append(&mut declared.constants);
        let plain = design.clone();
        Port {
            program,
            constants,
            fields: declared.fields,
            ranks: declared.ranks,
            iterations: declared.iterations,
            ends_passes: declared.ends_passes,
            by_sample: false,
            resolves: false,
            plain: Box::new(plain),
            restore: Box::new(move |grid, tile, tile_words, fields| {
                let pixel = |(within, site)| {
                    design.read(site, &PixelWords { tile: tile_words, within, fields })
                };
                let pixels: Vec<D::Pixel> = sites(grid, tile).enumerate().map(pixel).collect();
                Box::new(pixels)
            }),
        }
    }

    /// Words of state of a pixel.
    pub fn words(&self) -> u32 {
        self.fields.last().map_or(0, |last| last.at + last.words)
    }

    /// The constants that say where each field begins.
    pub fn places(&self) -> impl Iterator<Item = (String, Constant)> {
        self.fields.iter().map(|field| (format!("AT_{}", field.name), Constant::Whole(field.at)))
    }

    /// A tile's state as the plain text holds it.
    pub fn restore(&self, grid: TileGrid, tile: TileId, words: TileWords<'_>) -> TileState {
        (self.restore)(grid, tile, words, &self.fields)
    }
}

impl fmt::Debug for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Port({}, {:?})", self.program, self.constants)
    }
}

/// Parameters as constants: `SORT` of a flag, `SURFACES_BITMASK` and others of which one
/// is true of a choice, `LAYERS` of a number.
fn of_parameters(params: &[Param], values: &Values) -> Vec<(String, Constant)> {
    let name = |text: &str| text.replace('-', "_").to_uppercase();
    let mut list = Vec::new();
    for (param, value) in values.iter() {
        let kind = params.iter().find(|p| p.name == param).map(|p| p.kind);
        match (value, kind) {
            (Value::Choice { name: chosen, .. }, Some(Kind::Choice { options })) => {
                list.extend(options.iter().map(|option| {
                    let constant = format!("{}_{}", name(param), name(option.name));
                    (constant, Constant::Flag(option.name == chosen))
                }));
            }
            (Value::Flag(v), _) => list.push((name(param), Constant::Flag(v))),
            (Value::Integer(v), _) => list.push((name(param), Constant::Whole(v as u32))),
            (Value::Real(v), _) => list.push((name(param), Constant::Real(v as f32))),
            (Value::Choice { .. }, _) => unreachable!("values are of their parameters' kinds"),
        }
    }
    list
}
