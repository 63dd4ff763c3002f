//! The contract between a design and everything that replays it.

use std::sync::Arc;

use fearless_simd::Level;
use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::param::{Param, Values};
use crate::rop::event::Probe;
use crate::rop::fast::{Count, Width};
use crate::rop::layout::Layout;
use crate::rop::over_opaque::{self, Opaque};
use crate::rop::port::Port;
use crate::rop::primitive_depths::PrimitiveDepths;
use crate::rop::promise::Promise;
use crate::rop::replay::Engine;
use crate::rop::samples::SampleContents;
use crate::tile::TileGrid;
use crate::trace::{ColourFormat, Fragment, Trace, Unorm32};

/// What a design knows of the frame it draws.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The frame's tiles and size.
    pub grid: TileGrid,
    /// Where each pixel's samples lie, in 1/16 pixel from its centre.
    pub positions: Arc<[[i8; 2]]>,
    /// Linear colour of a cleared sample.
    pub background: [f32; 3],
    /// The run's seed.
    pub seed: u32,
    /// Bits that a stored colour takes.
    pub colour_bits: u32,
    /// Whether opaque fragments (alpha 1) may come. Where none do, nothing is kept for them.
    pub opaque: bool,
    /// The primitives' mean depths, for a design that asks for them.
    pub primitive_depths: Option<Arc<PrimitiveDepths>>,
}

impl Frame {
    /// The frame of a replay of `trace` at `samples` samples; that there are opaque
    /// fragments is taken for granted, as is that nobody asks for the primitives' depths:
    /// [`crate::design::Configured::frame`] finds out.
    ///
    /// # Errors
    /// As [`crate::trace::SamplePattern::prefix`].
    pub fn of(trace: &Trace, samples: u32, seed: u32) -> Result<Self> {
        let header = trace.header();
        Ok(Frame {
            grid: TileGrid::new(header.width, header.height),
            positions: header.pattern.prefix(samples)?.into(),
            background: header.background,
            seed,
            colour_bits: match header.colour {
                ColourFormat::F16 => 48,
                ColourFormat::F32 => 96,
            },
            opaque: true,
            primitive_depths: None,
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

/// A design of a raster-operations unit, for pixels of a fixed number of samples.
///
/// The replay calls [`clear`](Design::clear) when a pixel's tile is touched for
/// the first time, then, pass by pass, [`draw`](Design::draw) for each fragment
/// in API order and [`end_pass`](Design::end_pass), then
/// [`resolve`](Design::resolve). Pixels are independent: a design must not keep
/// anything between calls outside the pixel's state, and all randomness must be
/// a pure function of the frame's seed, the site, the fragment and the pass
/// ([`crate::random`]). A fragment's coverage is never empty and names only the
/// frame's samples.
pub trait Design: Send + Sync {
    /// The state of one pixel: what this design needs and nothing else.
    type Pixel: Send + 'static;

    /// How many times the design reads the trace.
    fn passes(&self) -> u32 {
        1
    }

    /// What a pixel holds in hardware, bit for bit.
    fn layout(&self) -> Layout;

    /// A pixel's state before the first fragment.
    fn clear(&self, site: Site) -> Self::Pixel;

    /// Draws one fragment, telling `probe` what happens.
    fn draw<P: Probe>(
        &self,
        pass: u32,
        site: Site,
        pixel: &mut Self::Pixel,
        fragment: &Fragment,
        probe: &mut P,
    );

    /// Is called when all fragments of a pass have been drawn. `probe` is told what is
    /// compared; state that is read and written once a pixel, here and to resolve it, is
    /// not counted.
    fn end_pass<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        _pixel: &mut Self::Pixel,
        _probe: &mut P,
    ) {
    }

    /// The pixel's linear colour over the background.
    fn resolve(&self, site: Site, pixel: &Self::Pixel) -> [f64; 3];

    /// The pixel's state as `explain` shows it.
    fn contents(&self, pixel: &Self::Pixel) -> Contents;

    /// Bytes that the state grows by with each fragment, where it grows; the
    /// replay then works in groups of tiles that fit into its memory limit.
    fn bytes_per_fragment(&self) -> Option<usize> {
        None
    }
}

/// Bits of state per pixel, as hardware would hold them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct StateBits {
    /// The multisample buffer: depths and colours of all samples.
    pub samples: u32,
    /// What the design keeps beside it.
    pub extra: u32,
    /// Whether it grows with the fragments: the figures are then for none.
    pub unbounded: bool,
}

impl StateBits {
    /// All bits together.
    pub fn total(&self) -> u32 {
        self.samples + self.extra
    }
}

/// A pixel's state for people.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Contents {
    /// What its samples hold, where the design has samples.
    pub samples: Vec<SampleContents>,
    /// Names and values of what else it holds.
    pub fields: Vec<(&'static str, String)>,
}

/// What a design promises; the conformance suite holds it to each of these, and
/// shows that what is not promised does not hold. Promised is what holds for traces as
/// `TRACE_FORMAT.md` asks for them: no primitive covers a sample twice.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct Promises {
    /// Its expectation over seeds is the exact picture.
    pub unbiased: Promise,
    /// Its picture approaches the exact one as samples increase.
    pub consistent: Promise,
    /// What the order does in which fragments arrive, where those that share a depth at a
    /// sample stay in sequence: of them the last lies in front in the exact picture, too.
    pub order: OrderPromise,
    /// Where the picture of opaque fragments is the exact one.
    pub exact_opaque: OpaquePromise,
    /// The picture depends on the seed.
    pub seeded: bool,
}

impl Promises {
    /// Nothing is promised.
    pub const NONE: Promises = Promises {
        unbiased: Promise::Never,
        consistent: Promise::Never,
        order: OrderPromise::Dependent,
        exact_opaque: OpaquePromise::Never,
        seeded: false,
    };

    /// Whether the picture is the same in any order, but for rounding.
    pub fn same_picture(&self) -> bool {
        self.order != OrderPromise::Dependent
    }

    /// Where the expectation over seeds is the same in any order: where each picture is, and
    /// where it is the exact picture. The noise about it may still differ: with
    /// `lk:track=covered` near to far has less than far to near.
    pub fn same_expectation(&self) -> Promise {
        if self.same_picture() { Promise::Always } else { self.unbiased }
    }

    /// What is promised, in words.
    pub fn words(&self) -> Vec<String> {
        let order = match self.order {
            OrderPromise::Independent => "the same picture in any order",
            OrderPromise::UpToRounding => "the same picture in any order up to rounding",
            OrderPromise::AmplifiedRounding => {
                "the same picture in any order up to amplified rounding"
            }
            OrderPromise::Dependent => "",
        };
        let expectation = match self.same_picture() {
            true => Promise::Never,
            false => self.same_expectation(),
        };
        let opaque = match self.exact_opaque {
            OpaquePromise::Always => "exact where opaque",
            OpaquePromise::WholePixels => "exact where opaque over whole pixels",
            OpaquePromise::Never => "",
        };
        let list = [
            (self.unbiased, "unbiased"),
            (self.consistent, "consistent"),
            (Promise::always_if(!order.is_empty()), order),
            (expectation, "the same expectation in any order"),
            (Promise::always_if(!opaque.is_empty()), opaque),
            (Promise::always_if(!self.seeded), "the same for every seed"),
        ];
        list.iter().filter_map(|(promise, what)| promise.words(what)).collect()
    }
}

/// What the order does in which fragments arrive ([`Promises::order`]).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderPromise {
    /// It changes no bit.
    Independent,
    /// It changes in which order sums are rounded and nothing else.
    UpToRounding,
    /// So does this; but what the design makes of its sums amplifies their rounding,
    /// where depths lie close together until it shows.
    AmplifiedRounding,
    /// It changes the picture.
    Dependent,
}

/// Where the picture of opaque fragments (alpha 1) is the exact one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OpaquePromise {
    /// However they share pixels.
    Always,
    /// Where each covers whole pixels.
    WholePixels,
    /// Not even there.
    Never,
}

impl OpaquePromise {
    /// The promise of a design that owes what is exact to the z-buffer of
    /// [`OverOpaque`](crate::rop::OverOpaque), and has `otherwise` without it.
    pub fn where_first(values: &Values, otherwise: OpaquePromise) -> Self {
        match over_opaque::of(values) {
            Opaque::First => OpaquePromise::Always,
            Opaque::Together => otherwise,
        }
    }
}

crate::options! {
    /// How designs are grouped in listings.
    pub enum Family {
        Reference = "reference": "the answer that others are measured against",
        Stochastic = "stochastic": "random coverage of samples, or random choice of layers",
        Layered = "layered": "a bounded number of layers per pixel, in the order of their depths",
        Blended = "blended": "sums over all fragments, or blending in the order in which they come",
    }
}

/// What a listing says about a design.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Info {
    /// Its name, as in `--design NAME`.
    pub name: &'static str,
    /// Its family.
    pub family: Family,
    /// What it does, in a line.
    pub summary: &'static str,
    /// Where it was published.
    pub citation: &'static str,
    /// Its parameters.
    pub params: &'static [Param],
    /// Settings, as `a=1,b=2`, that the conformance suite tries beside each parameter
    /// changed alone: where parameters work upon each other.
    pub combinations: &'static [&'static str],
}

/// A design with its parameters still open: what the registry holds.
pub trait Blueprint: 'static {
    /// What a listing says about it.
    const INFO: Info;

    /// Whether it asks for [`Frame::primitive_depths`]. That takes a pass over the trace
    /// before the design is built, which is counted nowhere: it stands for what an
    /// application knows of its own primitives.
    const PRIMITIVE_DEPTHS: bool = false;

    /// The design for pixels of `N` samples.
    type At<const N: usize>: Design;

    /// Builds the design.
    ///
    /// # Errors
    /// [`crate::error::Error::Config`] for values that contradict each other.
    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>>;

    /// A faster engine that gives the same bits with the instructions of `level`, where
    /// there is one for these parameters.
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    fn fast<const N: usize>(
        _values: &Values,
        _frame: &Frame,
        _level: Level,
    ) -> Result<Option<Box<dyn Engine>>>
    where
        Count<N>: Width,
    {
        Ok(None)
    }

    /// Whether it has a [`Blueprint::port`].
    const PORTED: bool = false;

    /// The design as another device runs it, where [`Blueprint::PORTED`].
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    fn port<const N: usize>(_values: &Values, _frame: &Frame) -> Result<Option<Port>> {
        Ok(None)
    }

    /// What it promises with these parameters.
    fn promises(values: &Values) -> Promises;
}
