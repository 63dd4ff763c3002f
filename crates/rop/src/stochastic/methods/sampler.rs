//! What a stochastic design is made of: how it chooses samples.

use crate::contract::event::Probe;
use crate::contract::frame::Site;
use crate::contract::layout::Layout;
use crate::contract::samples::Samples;
use screendoor_trace::trace::{Fragment, SampleMask};

/// One drawing of the samples among several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Round {
    /// Its number among those that are stratified together.
    pub index: u32,
    /// How many are stratified together.
    pub count: u32,
    /// The seed of its random numbers.
    pub seed: u32,
}

/// How a design chooses the samples that a fragment writes.
pub trait Sampler<const N: usize>: Send + Sync {
    /// What it keeps of a pixel beside the multisample buffer.
    type State: Send + Sync + 'static;

    /// A pixel's state before the first fragment of a round.
    fn clear(&self, site: Site) -> Self::State;

    /// Bits of that state.
    fn state_bits(&self) -> u32;

    /// What they hold.
    fn layout(&self) -> Layout {
        Layout::of(1, &[(self.state_bits(), "tracking")])
    }

    /// The samples of `passed` that the fragment writes, where `passed` are those of
    /// its samples that are not behind what `samples` hold. Tells `probe` of its
    /// state's bits, surfaces, sorts, hashes and reference values.
    #[expect(clippy::too_many_arguments, reason = "everything that a choice may depend on")]
    fn choose<P: Probe>(
        &self,
        round: Round,
        site: Site,
        state: &mut Self::State,
        samples: &Samples<N>,
        passed: SampleMask,
        fragment: &Fragment,
        probe: &mut P,
    ) -> SampleMask;

    /// Whether it knows of an [`Sampler::excess`].
    const CORRECTS: bool = false;

    /// By how much the samples' mean is estimated to exceed its expectation: in a single
    /// pass it is taken away when the pixel is resolved.
    fn excess(&self, _state: &Self::State) -> [f64; 3] {
        [0.0; 3]
    }

    /// Names and values of the state, for `explain`.
    fn fields(&self, _state: &Self::State) -> Vec<(&'static str, String)> {
        Vec::new()
    }
}
