//! What a stochastic design keeps of a pixel.

use crate::contract::colour::ColourStore;
use crate::contract::samples::Samples;
use screendoor_trace::trace::SampleMask;

/// A pixel of a stochastic design.
#[derive(Clone, Debug)]
pub struct MethodsPixel<T, const N: usize> {
    pub(crate) samples: Samples<N>,
    pub(crate) state: T,
    /// What several passes need; `None` for a single one.
    pub(crate) sums: Option<Box<MethodsSums<N>>>,
}

/// What the methods of several passes keep.
#[derive(Clone, Debug)]
pub(crate) struct MethodsSums<const N: usize> {
    /// `1 − α_total` of each sample; without correction, the share of the rounds in
    /// which the sample stayed empty.
    pub(super) transmittance: [f32; N],
    /// Samples written in this round.
    pub(crate) occupied: SampleMask,
    /// `Σ B` over the occupied samples, or `Σ U`, of all rounds so far.
    pub(super) colour: [f32; 3],
    /// The same with colours replaced by 1.
    pub(super) weight: f32,
}

impl<const N: usize> MethodsSums<N> {
    /// Adds a colour `share` times, which counts as `weight`.
    pub(super) fn add(&mut self, colour: [f32; 3], share: f32, weight: f32, store: ColourStore) {
        for (sum, c) in self.colour.iter_mut().zip(colour) {
            *sum = store.channel(*sum + c * share);
        }
        self.weight = store.channel(self.weight + weight);
    }
}
