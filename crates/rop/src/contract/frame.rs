//! The frame that a design draws, and a pixel of it.

use std::sync::Arc;

use crate::contract::primitive_depths::PrimitiveDepths;
use screendoor_trace::error::Result;
use screendoor_trace::picture::Space;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{ColourFormat, ColumnSet, Fragment, Trace, Unorm32, View};

/// What a design knows of the frame it draws.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The frame's tiles and size.
    pub grid: TileGrid,
    /// Where each pixel's samples lie, in 1/16 pixel from its centre.
    pub positions: Arc<[[i8; 2]]>,
    /// Colour of a cleared sample.
    pub background: [f32; 3],
    /// What the numbers of colours stand for. Designs blend them as they are.
    pub space: Space,
    /// The run's seed.
    pub seed: u32,
    /// Bits that a stored colour takes.
    pub colour_bits: u32,
    /// The view that the trace was taken in, where it says so.
    pub view: Option<View>,
    /// Whether opaque fragments (alpha 1) may come. Where none do, nothing is kept for them.
    pub opaque: bool,
    /// The primitives' mean depths, for a design that asks for them.
    pub primitive_depths: Option<Arc<PrimitiveDepths>>,
    /// The optional columns that the design reads.
    pub columns: ColumnSet,
}

impl Frame {
    /// The frame of a replay of `trace` at `samples` samples; that there are opaque
    /// fragments is taken for granted, as is that nobody asks for the primitives' depths
    /// or for optional columns:
    /// `Configured::frame` of the designs finds out.
    ///
    /// # Errors
    /// As [`screendoor_trace::trace::SamplePattern::prefix`].
    pub fn of(trace: &Trace, samples: u32, seed: u32) -> Result<Self> {
        let header = trace.header();
        Ok(Frame {
            grid: TileGrid::new(header.width, header.height),
            positions: header.pattern.prefix(samples)?.into(),
            background: header.background,
            space: header.space,
            seed,
            colour_bits: match header.colour {
                ColourFormat::F16 => 48,
                ColourFormat::F32 => 96,
            },
            view: header.view,
            opaque: true,
            primitive_depths: None,
            columns: ColumnSet::NONE,
        })
    }

    /// Samples per pixel.
    pub fn samples(&self) -> u32 {
        self.positions.len() as u32
    }

    /// A fragment's depth at each of its pixel's samples, kept to `bits` bits.
    ///
    /// # Panics
    /// Where `N` is not the frame's sample count.
    // Inlined, it is unrolled into every design at every sample count: faster, and
    // slower to compile, which development does without.
    #[cfg_attr(debug_assertions, inline(never))]
    #[cfg_attr(not(debug_assertions), inline)]
    pub fn depths<const N: usize>(&self, f: &Fragment, bits: u32) -> [Unorm32; N] {
        std::array::from_fn(|s| f.depth.at(self.positions[s]).narrowed(bits))
    }
}

/// A pixel of the frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Site {
    /// Column, from the left.
    pub x: u16,
    /// Row, from the top.
    pub y: u16,
}
