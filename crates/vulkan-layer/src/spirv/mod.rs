//! Shaders rewritten, word by word: what is not touched stays as it is, known to us or not.
//!
//! A program's entry point is not edited but called, by a new one that does what is ours to do
//! afterwards. So whatever the program's shader does, return early or discard, it is over by then;
//! and an invocation that ended within it has left no record.

#![warn(missing_docs)]

mod code;
mod colour;
mod declared;
mod editor;
mod entry;
mod fragment;
mod inputs;
mod locations;
mod module;
mod record;
mod spec;
mod vertex;
mod write;

pub use fragment::fragment;
pub use locations::{inputs, outputs};
pub use vertex::vertex;

/// Words of the header of the storage buffer.
///
/// | word | |
/// |---|---|
/// | 0 | records counted; runs on past the capacity, so that one knows how many there would be |
/// | 1 | capacity in records |
/// | 2 | 0: nothing is recorded |
/// | 4, 5 | where [`Options::address`] says so: the records' address, lower half first, a multiple of 16 |
///
/// Otherwise the records follow the header. The others are not read.
pub const HEADER_WORDS: u32 = 16;

/// How a fragment shader is rewritten.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Number of the layer's descriptor set: at binding 0 a uniform buffer `{uint slot}`, bound
    /// with a dynamic offset; at binding 1 the storage buffer.
    pub set: u32,
    /// Which colour output is recorded.
    pub location: u32,
    /// Record `gl_PrimitiveID`: needs the device's feature `geometryShader`.
    pub primitive_id: bool,
    /// Records lie where the header says: needs `bufferDeviceAddress`.
    pub address: bool,
    /// At which location the [`vertex`] shader hands down the instance's number.
    pub instance: Option<u32>,
}

/// What is to be known of a fragment shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// It asks for depth and stencil tests before it is run: what is hidden altogether leaves no
    /// record. The coverage is from before the tests nevertheless, unless the shader asks for what
    /// is left of it too.
    pub early_tests: bool,
    /// It is run for each sample, because of its inputs. (A pipeline can ask for that too.)
    pub per_sample: bool,
    /// It gives the depth.
    pub writes_depth: bool,
    /// It gives a mask of samples, which the coverage respects.
    pub writes_mask: bool,
    /// What it writes at the location asked for.
    pub output: Output,
}

/// What a fragment shader writes at a location.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// Nothing: recorded as black with alpha 1.
    None,
    /// So many components in 32 bits; those that lack are 0, alpha 1.
    Float(u32),
    /// The same in 16 bits each.
    Half(u32),
    /// Integers, which are not recorded: as nothing.
    Integer,
}
