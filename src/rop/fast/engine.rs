//! The fast engine of a stochastic design.

use fearless_simd::{Level, Simd};

use crate::picture::TilePixels;
use crate::resolve::box_filter;
use crate::rop::design::{Contents, Design, Frame, Site};
use crate::rop::event::{NoProbe, Probe, Sum};
use crate::rop::fast::kernel;
use crate::rop::fast::lanes::{Count, Lanes, Width};
use crate::rop::fast::references::Limit;
use crate::rop::fast::state::{FastTile, PlainPixel, boxed};
use crate::rop::fast::tally::Tally;
use crate::rop::layout::Layout;
use crate::rop::over_opaque::Transparent;
use crate::rop::replay::{Engine, Listener, TileState, Told, sites};
use crate::rop::stochastic::{Pass, Round, Sampler, Stochastic};
use crate::tile::{TILE_PIXELS, TileGrid, TileId};
use crate::trace::{Block, Fragment, SampleMask};

/// A fragment in its block.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    pub(super) block: &'a Block,
    pub(super) i: usize,
}

impl Row<'_> {
    /// Its pixel.
    #[inline(always)]
    pub fn site(&self) -> Site {
        Site { x: self.block.x[self.i], y: self.block.y[self.i] }
    }

    /// Its primitive.
    #[inline(always)]
    pub fn primitive(&self) -> u32 {
        self.block.primitive[self.i]
    }

    /// Its object.
    #[inline(always)]
    pub fn object(&self) -> u32 {
        self.block.object[self.i]
    }

    /// All of it; its coverage may hold samples behind opaque ones.
    #[inline(always)]
    pub fn whole(&self) -> Fragment {
        self.block.fragment(self.i)
    }
}

/// A fragment as a [`FastSampler`] meets it.
#[derive(Clone, Copy)]
pub struct Offered<'a, L> {
    /// The round.
    pub round: &'a Round,
    /// Stored depths, their upper bit flipped: signed words of the same order.
    pub stored: L,
    /// The same in memory.
    pub words: &'a [i32],
    /// The samples that passed the depth test, one bit each.
    pub passed: u64,
    /// The samples that were put to it.
    pub coverage: u64,
    /// The fragment's threshold.
    pub limit: Limit,
    /// The fragment.
    pub fragment: Row<'a>,
}

/// [`Sampler`] in lanes.
pub trait FastSampler<const N: usize>: Send + Sync + 'static {
    /// The plain text.
    type Plain: Sampler<N>;
    /// What it keeps of a pixel beside the multisample buffer.
    type State: Copy + Send + 'static;

    /// The states of a tile's pixels before the first fragment.
    fn clear(&self, grid: TileGrid, tile: TileId) -> Vec<Self::State>;
    /// A state as the plain text has it.
    fn to_plain(&self, state: Self::State) -> <Self::Plain as Sampler<N>>::State;
    /// The other way; `state` is what the pixel's was.
    fn of_plain(&self, plain: &<Self::Plain as Sampler<N>>::State, state: &mut Self::State);
    /// Starts a round: works out what a pixel's fragments have in common in it.
    fn enter(&self, round: &Round, states: &mut [Self::State; TILE_PIXELS]);
    /// Bits of a stored depth.
    fn depth_bits(&self) -> u32;
    /// Whether a fragment does nothing unless a sample of it passes the depth test.
    fn needs_survivors(&self) -> bool;

    /// As [`Sampler::choose`].
    fn choose<S: Simd, L: Lanes<S>, P: Probe>(
        &self,
        simd: S,
        loaded: &Loaded<L>,
        state: &mut Self::State,
        offered: Offered<'_, L>,
        tally: &mut Tally<'_, P>,
    ) -> L::Mask;
}

/// Words that every fragment of a replay needs.
pub struct Constants<W: Width> {
    offsets: [W::Row; 2],
    reversed: W::Row,
    lanes: W::Row,
}

/// The same in vectors.
#[derive(Clone, Copy)]
pub struct Loaded<L> {
    /// Where the samples lie, in 1/16 pixel from the centre: to the right, downwards.
    pub offsets: [L; 2],
    /// The bits of each lane's number in reverse.
    pub reversed: L,
    /// Each lane's number.
    pub lanes: L,
}

impl<W: Width> Constants<W> {
    fn of(frame: &Frame) -> Self {
        let offset =
            |axis: usize| W::row(|s| frame.positions.get(s).map_or(0, |p| i32::from(p[axis])));
        Constants {
            offsets: [offset(0), offset(1)],
            reversed: W::row(|n| (n as u32).reverse_bits() as i32),
            lanes: W::row(|n| n as i32),
        }
    }

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S) -> Loaded<W::Lanes<S>> {
        let load = |row: &W::Row| <W::Lanes<S> as Lanes<S>>::load(simd, row.as_ref());
        Loaded {
            offsets: [load(&self.offsets[0]), load(&self.offsets[1])],
            reversed: load(&self.reversed),
            lanes: load(&self.lanes),
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
    level: Level,
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
    fn change(
        &self,
        tile: &mut FastTile<F, N>,
        within: usize,
        change: impl FnOnce(&mut PlainPixel<F, N>),
    ) {
        let mut pixel = tile.plain(&self.sampler, within);
        change(&mut pixel);
        tile.set(&self.sampler, within, pixel);
    }

    fn draw_all<P: Sum>(&self, pass: u32, tile: &mut FastTile<F, N>, block: &Block, probe: &mut P) {
        let methods = &self.plain.inner;
        let Some(inner) = pass.checked_sub(self.plain.own_passes()) else {
            for fragment in block.iter() {
                let within = TileGrid::within(fragment.x, fragment.y);
                probe.fragment(fragment.coverage);
                self.plain.cull(pass, &mut tile.opaque[within], &fragment, probe);
            }
            return;
        };
        match methods.pass(inner) {
            Pass::Sample(round) => {
                let round = methods.round(round);
                if tile.entered != Some(round) {
                    tile.entered = Some(round);
                    self.sampler.enter(&round, &mut tile.states);
                }
                self.draw_samples(pass, round, tile, block, probe);
            }
            Pass::Accumulate(_) => self.accumulate(pass, tile, block, probe),
            Pass::TotalAlpha => {
                for fragment in block.iter() {
                    let within = TileGrid::within(fragment.x, fragment.y);
                    probe.fragment(fragment.coverage);
                    let Some(coverage) = self.cull(pass, tile, &fragment, probe) else { continue };
                    let fragment = Fragment { coverage, ..fragment };
                    let sums = tile.sums[within].as_mut().expect("it has sums");
                    methods.draw_alpha(sums, &fragment, probe);
                }
            }
        }
    }

    fn draw_samples<P: Sum>(
        &self,
        pass: u32,
        round: Round,
        tile: &mut FastTile<F, N>,
        block: &Block,
        probe: &mut P,
    ) {
        crate::for_level!(self.level, simd => {
            kernel::draw_samples(simd, self, pass, round, tile, block, probe)
        })
    }

    fn accumulate<P: Probe>(
        &self,
        pass: u32,
        tile: &mut FastTile<F, N>,
        block: &Block,
        probe: &mut P,
    ) {
        crate::for_level!(self.level, simd => {
            kernel::accumulate(simd, self, pass, tile, block, probe)
        })
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

/// A tile of this engine's.
fn own<F: FastSampler<N>, const N: usize>(state: &mut TileState) -> &mut FastTile<F, N>
where
    Count<N>: Width,
{
    state.downcast_mut().expect("the state is the engine's own")
}

impl<F: FastSampler<N>, const N: usize> Engine for FastEngine<F, N>
where
    Count<N>: Width,
{
    fn passes(&self) -> u32 {
        Design::passes(&self.plain)
    }

    fn layout(&self) -> Layout {
        Design::layout(&self.plain)
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        None
    }

    fn clear(&self, grid: TileGrid, tile: TileId) -> TileState {
        let states = self.sampler.clear(grid, tile);
        let frame = &self.plain.inner.frame;
        let site = Site { x: 0, y: 0 };
        let sums = self.plain.inner.clear(site).sums;
        let opaque = self.plain.own_passes() > 0;
        Box::new(FastTile::<F, N>::cleared(frame, boxed(states), sums.as_deref(), opaque))
    }

    fn draw(&self, pass: u32, state: &mut TileState, fragments: &Block, told: Told<'_>) {
        let tile = own::<F, N>(state);
        match told {
            Told::Nobody => self.draw_all(pass, tile, fragments, &mut NoProbe),
            Told::Counts(counts) => self.draw_all(pass, tile, fragments, counts),
            Told::Record(record) => {
                for fragment in fragments.iter() {
                    record.fragment(fragment.coverage);
                    self.draw_plainly(pass, tile, &fragment, record);
                }
            }
        }
    }

    fn end_pass(
        &self,
        pass: u32,
        grid: TileGrid,
        tile: TileId,
        state: &mut TileState,
        told: Told<'_>,
    ) {
        let state = own::<F, N>(state);
        if state.sums.is_empty() {
            return;
        }
        let mut listener = Listener(told);
        for (within, site) in sites(grid, tile).enumerate() {
            self.change(state, within, |pixel| {
                Design::end_pass(&self.plain, pass, site, pixel, &mut listener);
            });
        }
    }

    fn resolve(&self, grid: TileGrid, tile: TileId, state: &TileState) -> TilePixels {
        let state: &FastTile<F, N> = state.downcast_ref().expect("the state is the engine's own");
        let mut result = Box::new([[0.0; 3]; TILE_PIXELS]);
        let single = state.sums.is_empty() && state.opaque.is_empty();
        for ((within, site), out) in sites(grid, tile).enumerate().zip(result.iter_mut()) {
            *out = if single {
                let colour = &state.held[within].colour;
                let colours: [[f32; 3]; N] = std::array::from_fn(|s| {
                    std::array::from_fn(|c| f32::from_bits(colour[c].as_ref()[s] as u32))
                });
                box_filter(&colours)
            } else {
                let pixel = state.plain(&self.sampler, within);
                Design::resolve(&self.plain, site, &pixel)
            };
        }
        result
    }

    fn contents(&self, state: &TileState, within: usize) -> Contents {
        let state: &FastTile<F, N> = state.downcast_ref().expect("the state is the engine's own");
        Design::contents(&self.plain, &state.plain(&self.sampler, within))
    }
}
