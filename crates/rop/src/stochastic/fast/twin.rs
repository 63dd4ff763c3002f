//! A stochastic design beside its twin in lanes: what the loops over fragments need of both.

use crate::contract::design::Design;
use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::lanes::{Count, Lanes, Width};
use crate::stochastic::fast::sampler::{FastSampler, Loaded};
use crate::stochastic::fast::state::{FastTile, PlainPixel};
use crate::stochastic::methods::Stochastic;
use fearless_simd::{Level, Simd};
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{Fragment, SampleMask};

/// Words that every fragment of a replay needs.
pub(super) struct Constants<W: Width> {
    offsets: [W::Row; 2],
    reversed: W::Row,
    lanes: W::Row,
    pairs: W::Row,
}

impl<W: Width> Constants<W> {
    fn of(frame: &Frame) -> Self {
        let offset =
            |axis: usize| W::row(|s| frame.positions.get(s).map_or(0, |p| i32::from(p[axis])));
        Constants {
            offsets: [offset(0), offset(1)],
            reversed: W::row(|n| (n as u32).reverse_bits() as i32),
            lanes: W::row(|n| n as i32),
            pairs: W::row(|n| 31 - n as i32 / 2),
        }
    }

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S) -> Loaded<W::Lanes<S>> {
        let load = |row: &W::Row| <W::Lanes<S> as Lanes<S>>::load(simd, row.as_ref());
        Loaded {
            offsets: [load(&self.offsets[0]), load(&self.offsets[1])],
            reversed: load(&self.reversed),
            lanes: load(&self.lanes),
            pairs: load(&self.pairs),
        }
    }
}

/// A stochastic design in lanes.
pub struct FastEngine<F: FastSampler<N>, const N: usize>
where
    Count<N>: Width,
{
    pub(super) plain: Stochastic<F::Plain, N>,
    pub(super) sampler: F,
    pub(super) constants: Constants<Count<N>>,
    pub(super) level: Level,
    #[cfg(test)]
    pub(super) flaw: Option<Flaw>,
}

/// A defect of one bit in one lane, for the test that finds it.
#[cfg(test)]
#[derive(Clone, Copy, Debug)]
pub enum Flaw {
    /// In the depth that is stored.
    Depth(usize),
    /// In the choice of the samples that are written.
    Choice(usize),
}

impl<F: FastSampler<N>, const N: usize> FastEngine<F, N>
where
    Count<N>: Width,
{
    /// The engine of the design `plain`, whose sampler `sampler` is the twin of, with
    /// the instructions of `level`.
    pub fn new(plain: Stochastic<F::Plain, N>, sampler: F, level: Level) -> Self {
        let constants = Constants::of(&plain.inner.frame);
        FastEngine {
            plain,
            sampler,
            constants,
            level,
            #[cfg(test)]
            flaw: None,
        }
    }

    /// The same with a defect.
    #[cfg(test)]
    pub fn with_flaw(self, flaw: Flaw) -> Self {
        FastEngine { flaw: Some(flaw), ..self }
    }

    /// Draws a fragment as the plain text does.
    #[cold]
    #[inline(never)]
    pub(super) fn draw_plainly<P: Probe>(
        &self,
        pass: u32,
        tile: &mut FastTile<F, N>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let site = Site { x: fragment.x, y: fragment.y };
        self.change(tile, TileGrid::within(site.x, site.y), |pixel| {
            Design::draw(&self.plain, pass, site, pixel, fragment, probe);
        });
    }

    /// Changes a pixel as the plain text holds it.
    pub(super) fn change(
        &self,
        tile: &mut FastTile<F, N>,
        within: usize,
        change: impl FnOnce(&mut PlainPixel<F, N>),
    ) {
        let mut pixel = tile.plain(&self.sampler, within);
        change(&mut pixel);
        tile.set(&self.sampler, within, pixel);
    }

    /// The samples of a fragment that lie before opaque ones drawn earlier.
    #[inline(always)]
    pub(super) fn cull<P: Probe>(
        &self,
        pass: u32,
        tile: &mut FastTile<F, N>,
        fragment: &Fragment,
        probe: &mut P,
    ) -> Option<SampleMask> {
        if tile.opaque.is_empty() {
            return Some(fragment.coverage);
        }
        let within = TileGrid::within(fragment.x, fragment.y);
        self.plain.cull(pass, &mut tile.opaque[within], fragment, probe)
    }
}
