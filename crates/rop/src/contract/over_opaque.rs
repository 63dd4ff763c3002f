//! Opaque geometry first, transparent geometry over it: what every technique does
//! that blends, sums or keeps layers.
//!
//! Enderton et al. 2011, section 3.5: opaque fragments go to a multisampled
//! z-buffer of their own, transparent ones are culled behind it, and the opaque
//! picture is dimmed sample by sample.

use crate::contract::colour::ColourStore;
use crate::contract::contents::Contents;
use crate::contract::design::Design;
use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::contract::layout::Layout;
use crate::contract::promises::OpaquePromise;
use crate::contract::samples::Samples;
use crate::contract::words::{Constant, Declaration, OnDevice, PixelWords};
use crate::resolve::box_filter;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

screendoor_trace::options! {
    /// How opaque fragments (alpha 1) are drawn by designs for transparent ones.
    pub enum Opaque {
        First = "first": "in a pass of their own into a z-buffer that culls the others",
        Together = "together": "like all others, without a z-buffer",
    }
}

/// The parameter's declaration.
pub const PARAM: Typed<Opaque> =
    Typed::choice("opaque", "first", "how opaque fragments (alpha 1) are drawn");

/// The parameter's value.
pub fn of(values: &Values) -> Opaque {
    values.get(PARAM)
}

/// Where the picture of opaque fragments is exact under a design that owes it to the
/// z-buffer, and has `otherwise` without it.
pub fn exactness(values: &Values, otherwise: OpaquePromise) -> OpaquePromise {
    match of(values) {
        Opaque::First => OpaquePromise::Always,
        Opaque::Together => otherwise,
    }
}

/// How opaque fragments are drawn on this frame: where none come, as all others. No
/// bit of the picture depends on that, only what it costs.
pub fn on(values: &Values, frame: &Frame) -> Opaque {
    needed(of(values), frame)
}

fn needed(opaque: Opaque, frame: &Frame) -> Opaque {
    if frame.opaque { opaque } else { Opaque::Together }
}

/// How a design draws transparent fragments over what lies behind them.
///
/// The methods are those of [`Design`] but for what is said here.
pub trait Transparent<const N: usize>: Send + Sync {
    /// The state of one pixel beside the opaque z-buffer.
    type Pixel: Send + Sync + 'static;

    /// How many times it reads the trace.
    fn passes(&self) -> u32 {
        1
    }

    /// What a pixel holds beside the opaque z-buffer.
    fn layout(&self) -> Layout;

    /// As [`Design::clear`].
    fn clear(&self, site: Site) -> Self::Pixel;

    /// Is called before anything is drawn, with the opaque picture's samples, for what is
    /// blended into these themselves.
    fn over(&self, _pixel: &mut Self::Pixel, _behind: &[[f32; 3]; N]) {}

    /// As [`Design::draw`]; the fragment's coverage is what lies before the opaque
    /// geometry, and never empty.
    fn draw<P: Probe>(
        &self,
        pass: u32,
        site: Site,
        pixel: &mut Self::Pixel,
        fragment: &Fragment,
        probe: &mut P,
    );

    /// As [`Design::end_pass`].
    fn end_pass<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        _pixel: &mut Self::Pixel,
        _probe: &mut P,
    ) {
    }

    /// The pixel's colour over the opaque picture's samples `behind`.
    fn resolve(&self, site: Site, pixel: &Self::Pixel, behind: &[[f32; 3]; N]) -> [f64; 3];

    /// As [`Design::contents`].
    fn contents(&self, pixel: &Self::Pixel) -> Contents;

    /// As [`Design::visibility`], through what this design draws alone; `None` where its state
    /// does not say.
    fn visibility(&self, _pixel: &Self::Pixel, _at: &[Unorm32; N]) -> Option<[f64; N]> {
        None
    }

    /// As [`Design::bytes_per_fragment`].
    fn bytes_per_fragment(&self) -> Option<usize> {
        None
    }
}

/// A design of two parts: a z-buffer for opaque fragments, and `T` over it.
#[derive(Clone, Debug)]
pub struct OverOpaque<T, const N: usize> {
    frame: Frame,
    opaque: Opaque,
    colour: ColourStore,
    pub(crate) inner: T,
}

impl<T: Transparent<N>, const N: usize> OverOpaque<T, N> {
    /// `inner` over opaque fragments that are drawn as `opaque` says, if any come, into a
    /// buffer of colours as `values` have it.
    pub fn new(values: &Values, frame: &Frame, opaque: Opaque, inner: T) -> Self {
        let colour = ColourStore::of(values, frame);
        OverOpaque { frame: frame.clone(), opaque: needed(opaque, frame), colour, inner }
    }

    /// Whether fragments' colours are stored as they are, as a fast engine stores them.
    pub fn keeps_colours(&self) -> bool {
        self.colour.keeps()
    }

    /// Passes over the trace before those of `inner`.
    pub(crate) fn own_passes(&self) -> u32 {
        u32::from(self.opaque == Opaque::First)
    }

    fn sample_bits(&self) -> u32 {
        32 + self.colour.colour_bits()
    }

    /// The colour behind all that is drawn.
    pub(crate) fn background(&self) -> [f32; 3] {
        self.frame.background
    }

    /// [`Design::draw`], to the two parts of a pixel.
    #[inline]
    pub(crate) fn draw_parts<P: Probe>(
        &self,
        pass: u32,
        site: Site,
        (opaque, inner): (&mut Option<Box<Samples<N>>>, &mut T::Pixel),
        fragment: &Fragment,
        probe: &mut P,
    ) {
        if self.opaque == Opaque::Together {
            return self.inner.draw(pass, site, inner, fragment, probe);
        }
        if let Some(coverage) = self.cull(pass, opaque, fragment, probe) {
            let fragment = Fragment { coverage, ..*fragment };
            self.inner.draw(pass - 1, site, inner, &fragment, probe);
        }
    }

    /// [`Design::end_pass`], of the two parts of a pixel.
    pub(crate) fn end_parts<P: Probe>(
        &self,
        pass: u32,
        site: Site,
        (opaque, inner): (&Option<Box<Samples<N>>>, &mut T::Pixel),
        probe: &mut P,
    ) {
        if let Some(pass) = pass.checked_sub(self.own_passes()) {
            self.inner.end_pass(pass, site, inner, probe);
        } else if let Some(samples) = opaque {
            self.inner.over(inner, &samples.colour);
        }
    }

    /// Where opaque fragments come first: the samples of a fragment that `inner` is to
    /// draw in this pass, if there are any. An opaque fragment is drawn here.
    #[inline]
    pub(crate) fn cull<P: Probe>(
        &self,
        pass: u32,
        opaque: &mut Option<Box<Samples<N>>>,
        fragment: &Fragment,
        probe: &mut P,
    ) -> Option<SampleMask> {
        let is_opaque = fragment.alpha >= 1.0;
        if is_opaque != (pass == 0) {
            return None;
        }
        let z: [Unorm32; N] = self.frame.depths(fragment, 32);
        let passed = match opaque {
            Some(samples) => samples.depth_test(fragment.coverage, &z),
            None => fragment.coverage,
        };
        probe.depth_test(fragment.coverage, passed);
        probe.state(32 * fragment.coverage.count(), 0);
        if passed.is_empty() {
            return None;
        }
        if !is_opaque {
            return Some(passed);
        }
        let samples =
            opaque.get_or_insert_with(|| Box::new(Samples::cleared(self.frame.background)));
        let colour = self.colour.colour(fragment.colour);
        for s in passed.iter() {
            samples.write(s, z[s], colour);
        }
        probe.written(passed);
        probe.state(0, self.sample_bits() * passed.count());
        None
    }

    /// [`Design::visibility`], of the two parts of a pixel: opaque geometry hides what lies behind
    /// it, sample by sample.
    pub(crate) fn visibility_of(
        &self,
        (opaque, inner): (&Option<Box<Samples<N>>>, &T::Pixel),
        at: &[Unorm32],
        to: &mut [f64],
    ) -> bool {
        let at: &[Unorm32; N] = at.try_into().expect("a depth for each sample");
        let Some(passes) = self.inner.visibility(inner, at) else { return false };
        to.copy_from_slice(&passes);
        if let Some(samples) = opaque {
            for s in (0..N).filter(|s| samples.depth[*s] < at[*s]) {
                to[s] = 0.0;
            }
        }
        true
    }

    /// [`Design::contents`], of the two parts of a pixel.
    pub(crate) fn contents_of(
        &self,
        (opaque, inner): (&Option<Box<Samples<N>>>, &T::Pixel),
    ) -> Contents {
        let mut contents = self.inner.contents(inner);
        if let Some(samples) = opaque {
            let colour = box_filter(&samples.colour).map(|c| format!("{c:.3}")).join(" ");
            contents.fields.insert(0, ("opaque", colour));
        }
        contents
    }
}

/// A pixel: opaque samples once there are any, and what lies over them.
#[derive(Clone, Debug)]
pub struct OverOpaquePixel<X, const N: usize> {
    pub(crate) opaque: Option<Box<Samples<N>>>,
    pub(crate) inner: X,
}

impl<T: Transparent<N>, const N: usize> Design for OverOpaque<T, N> {
    type Pixel = OverOpaquePixel<T::Pixel, N>;

    fn passes(&self) -> u32 {
        self.own_passes() + self.inner.passes()
    }

    fn layout(&self) -> Layout {
        let buffer = [(32, "opaque depth"), (self.colour.colour_bits(), "opaque colour")];
        let first = self.own_passes() * N as u32;
        Layout::samples(first, &buffer).joined(self.inner.layout())
    }

    fn clear(&self, site: Site) -> Self::Pixel {
        let mut inner = self.inner.clear(site);
        self.inner.over(&mut inner, &[self.frame.background; N]);
        OverOpaquePixel { opaque: None, inner }
    }

    #[inline]
    fn draw<P: Probe>(
        &self,
        pass: u32,
        site: Site,
        pixel: &mut Self::Pixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let parts = (&mut pixel.opaque, &mut pixel.inner);
        self.draw_parts(pass, site, parts, fragment, probe);
    }

    fn end_pass<P: Probe>(&self, pass: u32, site: Site, pixel: &mut Self::Pixel, probe: &mut P) {
        self.end_parts(pass, site, (&pixel.opaque, &mut pixel.inner), probe);
    }

    fn resolve(&self, site: Site, pixel: &Self::Pixel) -> [f64; 3] {
        match &pixel.opaque {
            Some(samples) => self.inner.resolve(site, &pixel.inner, &samples.colour),
            None => self.inner.resolve(site, &pixel.inner, &[self.frame.background; N]),
        }
    }

    fn contents(&self, pixel: &Self::Pixel) -> Contents {
        self.contents_of((&pixel.opaque, &pixel.inner))
    }

    fn visibility(&self, pixel: &Self::Pixel, at: &[Unorm32], to: &mut [f64]) -> bool {
        self.visibility_of((&pixel.opaque, &pixel.inner), at, to)
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        self.inner.bytes_per_fragment()
    }
}

impl<T, const N: usize> OnDevice<OverOpaquePixel<T::Pixel, N>> for OverOpaque<T, N>
where
    T: Transparent<N> + OnDevice<T::Pixel>,
{
    fn declare(&self, to: &mut Declaration) {
        let first = self.opaque == Opaque::First;
        to.constant("OPAQUE_FIRST_HERE", Constant::Flag(first));
        to.constant("CHANNEL_BITS", Constant::Whole(self.colour.channel_bits()));
        let samples = if first { N as u32 } else { 0 };
        to.field("HAS_OPAQUE", u32::from(first));
        to.field("OPAQUE_DEPTH", samples);
        to.field("OPAQUE_COLOUR", 3 * samples);
        to.iterations(2 * samples);
        self.inner.declare(to);
    }

    fn read(&self, site: Site, from: &PixelWords<'_>) -> OverOpaquePixel<T::Pixel, N> {
        let opaque = self.opaque == Opaque::First && from.word("HAS_OPAQUE") == 1;
        OverOpaquePixel {
            opaque: opaque.then(|| Box::new(Samples::read(from, "OPAQUE_DEPTH", "OPAQUE_COLOUR"))),
            inner: self.inner.read(site, from),
        }
    }
}
