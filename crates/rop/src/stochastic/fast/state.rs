//! A tile's pixels as the fast engine holds them.

use crate::contract::frame::Frame;
use crate::contract::over_opaque::OverOpaquePixel;
use crate::contract::samples::Samples;
use crate::lanes::{Count, Width};
use crate::stochastic::fast::sampler::FastSampler;
use crate::stochastic::methods::{MethodsPixel, MethodsSums, Round, Sampler};
use screendoor_trace::tile::TILE_PIXELS;
use screendoor_trace::trace::Unorm32;

/// Turns unsigned depths into signed words of the same order, and back.
pub(super) const SIGN: u32 = 1 << 31;

/// The samples of a pixel, quantity by quantity.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub(super) struct SampleRows<W: Width> {
    /// Depths, their upper bit flipped.
    pub depth: W::Row,
    /// Red, green and blue, as the bits of single-precision numbers.
    pub colour: [W::Row; 3],
}

/// The pixels of a tile.
pub struct FastTile<F: FastSampler<N>, const N: usize>
where
    Count<N>: Width,
{
    pub(super) held: Box<[SampleRows<Count<N>>; TILE_PIXELS]>,
    pub(super) states: Box<[F::State; TILE_PIXELS]>,
    /// Empty where there is a single pass.
    pub(super) sums: Vec<Option<Box<MethodsSums<N>>>>,
    /// The round for which the states were made ready.
    pub(super) entered: Option<Round>,
    /// Whether a fragment has come to the near end of the depth range: from then on the tile
    /// is drawn with samples in lanes, which know of that end.
    pub(super) near: bool,
    /// Empty where opaque fragments are drawn like all others.
    pub(super) opaque: Vec<Option<Box<Samples<N>>>>,
}

/// A list whose length is known when kernels are compiled.
pub(super) fn boxed<T, const LEN: usize>(list: Vec<T>) -> Box<[T; LEN]> {
    let Ok(boxed) = list.into_boxed_slice().try_into() else { panic!("of another length") };
    boxed
}

/// A pixel of the plain text.
pub(super) type PlainPixel<F, const N: usize> =
    OverOpaquePixel<MethodsPixel<<<F as FastSampler<N>>::Plain as Sampler<N>>::State, N>, N>;

impl<W: Width> SampleRows<W> {
    pub(super) fn cleared(frame: &Frame) -> Self {
        let far = (Unorm32::FAR.0 ^ SIGN) as i32;
        SampleRows {
            depth: W::row(|_| far),
            colour: frame.background.map(|c| W::row(|_| c.to_bits() as i32)),
        }
    }
}

impl<F: FastSampler<N>, const N: usize> FastTile<F, N>
where
    Count<N>: Width,
{
    /// Pixels in `states`, cleared; with sums or opaque samples where they are asked for.
    pub(super) fn cleared(
        frame: &Frame,
        states: Box<[F::State; TILE_PIXELS]>,
        sums: Option<&MethodsSums<N>>,
        opaque: bool,
    ) -> Self {
        let sums = sums.map(|sums| vec![Some(Box::new(sums.clone())); TILE_PIXELS]);
        FastTile {
            held: boxed(vec![SampleRows::cleared(frame); TILE_PIXELS]),
            states,
            sums: sums.unwrap_or_default(),
            entered: None,
            near: false,
            opaque: if opaque { vec![None; TILE_PIXELS] } else { Vec::new() },
        }
    }

    /// The pixel as the plain text holds it.
    pub(super) fn plain(&self, sampler: &F, within: usize) -> PlainPixel<F, N> {
        let held = &self.held[within];
        let channel = |c: usize, s: usize| f32::from_bits(held.colour[c].as_ref()[s] as u32);
        let samples = Samples {
            depth: std::array::from_fn(|s| Unorm32(held.depth.as_ref()[s] as u32 ^ SIGN)),
            colour: std::array::from_fn(|s| std::array::from_fn(|c| channel(c, s))),
        };
        OverOpaquePixel {
            opaque: self.opaque.get(within).cloned().flatten(),
            inner: MethodsPixel {
                samples,
                state: sampler.to_plain(self.states[within]),
                sums: self.sums.get(within).cloned().flatten(),
            },
        }
    }

    /// Puts a pixel of the plain text in its place.
    pub(super) fn set(&mut self, sampler: &F, within: usize, pixel: PlainPixel<F, N>) {
        let held = &mut self.held[within];
        let MethodsPixel { samples, state, sums } = pixel.inner;
        for s in 0..N {
            held.depth.as_mut()[s] = (samples.depth[s].0 ^ SIGN) as i32;
            for (row, channel) in held.colour.iter_mut().zip(samples.colour[s]) {
                row.as_mut()[s] = channel.to_bits() as i32;
            }
        }
        sampler.of_plain(&state, &samples, &mut self.states[within]);
        if let Some(slot) = self.sums.get_mut(within) {
            *slot = sums;
        }
        if let Some(slot) = self.opaque.get_mut(within) {
            *slot = pixel.opaque;
        }
    }
}
