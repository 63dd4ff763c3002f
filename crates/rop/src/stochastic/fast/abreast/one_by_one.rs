//! Of samplers that have none.

use std::marker::PhantomData;

use fearless_simd::{Simd, mask32x16};

use crate::contract::event::Probe;
use crate::stochastic::fast::abreast::met::{Abreast, Counted, Met, Source};
use crate::stochastic::methods::Round;
use screendoor_trace::tile::TILE_PIXELS;

/// A sampler that has no lanes of pixels.
#[derive(Clone, Copy, Debug)]
pub struct OneByOne<K>(PhantomData<fn() -> K>, Never);

#[derive(Clone, Copy, Debug)]
enum Never {}

impl<K, const N: usize> Abreast<N> for OneByOne<K> {
    type Kept = K;
    type Lanes<S: Simd> = ();

    fn source(&self) -> Source {
        match self.1 {}
    }
    fn load<S: Simd>(&self, _: S, _: &Round, _: &[K; TILE_PIXELS], _: &[u8; 16]) {
        match self.1 {}
    }
    fn store<S: Simd>(&self, (): &(), _: &mut [K; TILE_PIXELS], _: &[u8; 16]) {
        match self.1 {}
    }
    fn choose<S: Simd, P: Probe>(
        &self,
        _: S,
        (): &mut (),
        _: &Met<'_, S, N>,
        _: &mut Counted<S, P>,
    ) -> [mask32x16<S>; N] {
        match self.1 {}
    }
}
