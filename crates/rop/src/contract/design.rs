//! The contract between a design and everything that replays it.

use crate::contract::contents::Contents;
use crate::contract::event::Probe;
use crate::contract::frame::Site;
use crate::contract::layout::Layout;
use screendoor_trace::trace::{Fragment, Unorm32};

/// A design of a raster-operations unit, for pixels of a fixed number of samples.
///
/// The replay calls [`clear`](Design::clear) when a pixel's tile is touched for
/// the first time, then, pass by pass, [`draw`](Design::draw) for each fragment
/// in API order and [`end_pass`](Design::end_pass), then
/// [`resolve`](Design::resolve). Pixels are independent: a design must not keep
/// anything between calls outside the pixel's state, and all randomness must be
/// a pure function of the frame's seed, the site, the fragment and the pass
/// ([`screendoor_trace::random`]). A fragment's coverage is never empty and names only the
/// frame's samples.
pub trait Design: Send + Sync {
    /// The state of one pixel: what this design needs and nothing else.
    type Pixel: Send + Sync + 'static;

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

    /// The pixel's colour over the background, in the trace's space as its fragments are.
    fn resolve(&self, site: Site, pixel: &Self::Pixel) -> [f64; 3];

    /// The pixel's state as `explain` shows it.
    fn contents(&self, pixel: &Self::Pixel) -> Contents;

    /// How much of the light that comes through the near plane reaches a depth: puts down the
    /// share (0 to 1) for each sample, of whose depths `at` has one each; `svis(z)` of Enderton
    /// et al. 2011, sections 3.2 and 3.4, is the mean over the samples. What lies at that very
    /// depth does not hide it. Tells whether the pixel's state says: which does not depend on the
    /// pixel; where not, `to` stays as it was.
    fn visibility(&self, _pixel: &Self::Pixel, _at: &[Unorm32], _to: &mut [f64]) -> bool {
        false
    }

    /// Bytes that the state grows by with each fragment, where it grows; the
    /// replay then works in groups of tiles that fit into its memory limit.
    fn bytes_per_fragment(&self) -> Option<usize> {
        None
    }
}
