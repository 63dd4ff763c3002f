//! Which samples a fragment writes.

use screendoor_rop::{PixelIndex, Probe, Reference, ReferenceKey, SampleList, Threshold};
use screendoor_trace::random::hash;
use screendoor_trace::trace::SampleMask;

screendoor_trace::options! {
    /// How samples are chosen.
    pub enum Drawn {
        Paired = "paired": "evenly spaced, pairs of samples exchanged at random: one hash a fragment",
        Hashed = "hashed": "by a reference value for each sample",
    }
}

/// How samples are chosen, and by what values.
#[derive(Clone, Copy, Debug)]
pub(super) enum Choice {
    Paired,
    Hashed(Reference),
}

impl Choice {
    pub(super) fn new(drawn: Drawn, reference: Reference) -> Self {
        match drawn {
            Drawn::Paired => Choice::Paired,
            Drawn::Hashed => Choice::Hashed(reference),
        }
    }

    /// The samples of `order` that a fragment writes; `key` holds its primitive's number as
    /// the surface's.
    pub(super) fn choose<const N: usize, P: Probe>(
        self,
        key: &ReferenceKey,
        opacity: Threshold,
        order: &SampleList<N>,
        probe: &mut P,
    ) -> SampleMask {
        let PixelIndex(pixel) = key.pixel;
        let opaque = opacity == Threshold::of(1.0);
        let xi = match self {
            Choice::Paired => hash([key.seed, pixel, key.surface]),
            Choice::Hashed(_) => 0,
        };
        let hashes = match self {
            // Nothing is left to chance.
            _ if opaque => 0,
            Choice::Paired => u32::from(!order.is_empty()),
            Choice::Hashed(_) => order.len() as u32,
        };
        probe.hashed(hashes);
        let mut written = SampleMask::NONE;
        for (n, sample) in order.iter().enumerate() {
            let n = n as u32;
            let value = match self {
                Choice::Paired => paired(xi, opacity, n),
                Choice::Hashed(reference) => reference.value(n, N as u32, key),
            };
            probe.reference(*sample, n, value, opacity);
            if opacity.passes(value) {
                written.insert(usize::from(*sample));
            }
        }
        written
    }
}

/// The reference value of the sample with number `n`: evenly spaced ones from ξ on, two and
/// two of which change places at random. Without that an alpha of 1/2 would write every
/// other sample in the order of their depths, and the next such fragment in front every
/// other of those: samples and surfaces in step, however many samples there are.
///
/// Which pairs do is said by the lower bits of ξ. Given these, each sample passes with
/// probability α to within 2^(j−31), j its pair's number: at most 2^-27 for 8 samples, 2^-16
/// for 64.
pub(super) fn paired(xi: u32, opacity: Threshold, n: u32) -> u32 {
    let exchanged = xi >> (n >> 1 & 15) & 1;
    let place = n ^ exchanged;
    xi.wrapping_add((opacity.value() as u32).wrapping_mul(place + 1))
}
