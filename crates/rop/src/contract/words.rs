//! A pixel's state in the words of another device: what a design declares of them, and the
//! way back.

use std::fmt;

use crate::contract::frame::Site;

/// The side of a threshold matrix, in pixels.
pub const TILE: usize = 64;

/// A threshold matrix: each rank from 0 to 4095 once.
pub type Ranks = [u16; TILE * TILE];

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
    pub(super) constants: Vec<(String, Constant)>,
    pub(super) fields: Vec<Field>,
    pub(super) ranks: Option<&'static Ranks>,
    pub(super) iterations: u32,
    pub(super) ends_passes: bool,
    pub(super) samples: u32,
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
    pub(super) tile: TileWords<'a>,
    pub(super) within: usize,
    pub(super) fields: &'a [Field],
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
