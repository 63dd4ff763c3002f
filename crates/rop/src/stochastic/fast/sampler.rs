//! How a design chooses samples, in lanes.

use crate::contract::event::Probe;
use crate::contract::frame::Site;
use crate::contract::samples::Samples;
use crate::lanes::Lanes;
use crate::stochastic::methods::{Round, Sampler};
use fearless_simd::Simd;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, Fragment, Unorm32};

use crate::stochastic::fast::abreast::Abreast;
use crate::stochastic::fast::limit::Limit;
use crate::stochastic::fast::tally::Tally;

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

    /// Its colour.
    #[inline(always)]
    pub fn colour(&self) -> [f32; 3] {
        let Row { block, i } = *self;
        [block.r[i], block.g[i], block.b[i]]
    }

    /// Its depth over the pixel.
    #[inline(always)]
    pub fn depth(&self) -> DepthPlane {
        let Row { block, i } = *self;
        DepthPlane { z: Unorm32(block.z[i]), dzdx: block.dzdx[i], dzdy: block.dzdy[i] }
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
    type State: Copy + Send + Sync + 'static;
    /// The same with pixels in lanes.
    type Abreast: Abreast<N, Kept = Self::State>;

    /// That, where there is one.
    fn abreast(&self) -> Option<&Self::Abreast> {
        None
    }

    /// The states of a tile's pixels before the first fragment.
    fn clear(&self, grid: TileGrid, tile: TileId) -> Vec<Self::State>;
    /// A state as the plain text has it.
    fn to_plain(&self, state: Self::State) -> <Self::Plain as Sampler<N>>::State;
    /// The other way, of a pixel whose samples are these; `state` is what it was.
    fn of_plain(
        &self,
        plain: &<Self::Plain as Sampler<N>>::State,
        samples: &Samples<N>,
        state: &mut Self::State,
    );
    /// Starts a round: works out what a pixel's fragments have in common in it.
    fn enter(&self, round: &Round, states: &mut [Self::State; TILE_PIXELS]);
    /// As [`Sampler::excess`]; `plain` is the twin.
    fn excess(&self, plain: &Self::Plain, state: &Self::State) -> [f64; 3] {
        plain.excess(&self.to_plain(*state))
    }
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

/// The same in vectors.
#[derive(Clone, Copy)]
pub struct Loaded<L> {
    /// Where the samples lie, in 1/16 pixel from the centre: to the right, downwards.
    pub offsets: [L; 2],
    /// The bits of each lane's number in reverse.
    pub reversed: L,
    /// Each lane's number.
    pub lanes: L,
    /// How far the bit of each lane's pair lies from the upper one.
    pub pairs: L,
}
