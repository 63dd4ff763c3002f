//! What a port to another device needs to know of a design: its parameters as
//! constants, how a pixel's state lies in words, and the way back from those words to
//! the pixel of the plain text, which resolves and explains it.

use std::fmt;

use crate::contract::design::Design;
use crate::contract::frame::Frame;
use crate::contract::info::Info;
use crate::contract::shader::Shader;
use crate::contract::tiled::{TileState, TiledDesign, sites};
use crate::contract::words::{
    Constant, Declaration, Field, OnDevice, PixelWords, Ranks, TileWords,
};
use screendoor_trace::param::{Kind, Param, Value, Values};
use screendoor_trace::tile::{TileGrid, TileId};

type Restore = dyn Fn(TileGrid, TileId, TileWords<'_>, &[Field]) -> TileState + Send + Sync;

/// A design as another device runs it.
pub struct Port {
    /// The shader that begins the program.
    pub program: Shader,
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
    pub plain: Box<dyn TiledDesign>,
    restore: Box<Restore>,
}

impl Port {
    /// The port of `design`, with the parameters that `info` declares.
    pub fn of<D>(program: Shader, info: &Info, values: &Values, frame: &Frame, design: D) -> Self
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
        write!(f, "Port({}, {:?})", self.program.name, self.constants)
    }
}

/// Parameters as constants: `SORT` of a flag, `SURFACES_BITMASK` and others of which one
/// is true of a choice, `LAYERS` of a number.
pub(crate) fn of_parameters(params: &[Param], values: &Values) -> Vec<(String, Constant)> {
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
