//! Sixteen pixels side by side for designs that blend, sum or keep layers: a lane for each
//! pixel.
//!
//! A fragment has to wait for the one before it in its pixel, and what a list of layers does
//! with it is full of jumps that nobody can foretell. Fragments of different pixels know nothing
//! of each other: a *round* takes one of each of sixteen pixels, and what jumps become is
//! selected. The bits are the plain text's.
//!
//! What is done for a fragment is compiled once a design for all sample counts up to
//! [`MOST_SAMPLES`].

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

mod engine;
mod groups;
mod kernel;
mod met;
mod numbers;
mod told;
mod window;

use std::fmt::Debug;

use fearless_simd::{Simd, f32x16, f64x8};

use crate::contract::event::Probe;
use crate::contract::over_opaque::Transparent;
use screendoor_trace::tile::TILE_PIXELS;

pub use engine::engine;
pub use met::Met;
pub use numbers::{counted, depth_at, hashed, reaches_ends, widened, words};
pub use told::Told;

/// Pixels that are drawn side by side.
pub const LANES: usize = 16;

/// The most samples of a pixel: those of a mask of 32 bits.
pub const MOST_SAMPLES: usize = 32;

/// Pixels' colours: each channel in two halves of eight lanes.
pub type Wide<S> = [f64x8<S>; 2];

/// A [`Transparent`] design that has lanes, and nothing to do at the ends of passes.
pub trait HasLanes<const N: usize>: Transparent<N> {
    /// The same in lanes.
    type InLanes: InLanes<State = Self::Pixel>;

    /// It, where there is one for these parameters.
    fn in_lanes(&self) -> Option<Self::InLanes>;
}

/// A design with pixels in lanes, whatever the number of their samples.
pub trait InLanes: Send + Sync + Debug {
    /// What a pixel holds: [`Transparent::Pixel`].
    type State;
    /// What sixteen hold.
    type Lanes<S: Simd>;

    /// What sixteen cleared pixels hold.
    fn clear<S: Simd>(&self, simd: S) -> Self::Lanes<S>;

    /// Makes the lanes those of cleared pixels again.
    fn clear_again<S: Simd>(&self, simd: S, lanes: &mut Self::Lanes<S>);

    /// Takes pixels in.
    fn load<S: Simd>(
        &self,
        simd: S,
        lanes: &mut Self::Lanes<S>,
        states: &[Self::State; TILE_PIXELS],
        pixels: &[u8; LANES],
    );

    /// Puts them back.
    fn store<S: Simd>(
        &self,
        lanes: &Self::Lanes<S>,
        states: &mut [Self::State; TILE_PIXELS],
        pixels: &[u8; LANES],
    );

    /// As [`Transparent::draw`], a fragment of each pixel.
    fn draw<S: Simd, P: Probe>(
        &self,
        simd: S,
        lanes: &mut Self::Lanes<S>,
        pass: u32,
        met: &Met<S>,
        told: &mut Told<S, P>,
    );

    /// As [`Transparent::resolve`], of all lanes; `behind` has an entry for each sample.
    fn resolve<S: Simd>(
        &self,
        simd: S,
        lanes: &Self::Lanes<S>,
        behind: &[[f32x16<S>; 3]],
    ) -> [Wide<S>; 3];
}
