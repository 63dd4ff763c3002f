//! Alpha blending into a multisample colour buffer, sample by sample.

use crate::contract::colour::ColourStore;
use crate::contract::contents::Contents;
use crate::contract::event::Probe;
use crate::contract::layout::Layout;
use crate::contract::over_opaque::Opaque;
use crate::resolve::box_filter;
use screendoor_trace::trace::SampleMask;

/// What has been blended over the colours of a pixel's `N` samples, in their own buffer.
#[derive(Clone, Debug)]
pub struct BlendBuffer<const N: usize> {
    /// Of all samples.
    pub colour: [[f32; 3]; N],
}

impl<const N: usize> Default for BlendBuffer<N> {
    fn default() -> Self {
        BlendBuffer { colour: [[0.0; 3]; N] }
    }
}

impl<const N: usize> BlendBuffer<N> {
    /// What a pixel holds beside the opaque geometry's buffers: where there are such,
    /// nothing, as their colours are blended into.
    pub fn layout(opaque: Opaque, store: ColourStore) -> Layout {
        match opaque {
            Opaque::First => Layout::default(),
            Opaque::Together => Layout::samples(N as u32, &[(store.colour_bits(), "colour")]),
        }
    }

    /// Tells `probe` what blending a fragment costs: each sample's colour is read and
    /// written, and each of its channels multiplied with the fragment's alpha: it moves by α of what
    /// it lacks.
    #[inline]
    pub fn tell<P: Probe>(covered: SampleMask, store: ColourStore, probe: &mut P) {
        probe.written(covered);
        let bits = store.colour_bits() * covered.count();
        probe.state(bits, bits);
        probe.multiplied(3 * covered.count());
    }

    /// `C ← αc + (1 − α)C` at each covered sample, stored each time.
    #[inline]
    pub fn blend(&mut self, covered: SampleMask, colour: [f32; 3], alpha: f32, store: ColourStore) {
        for s in covered.iter() {
            for (stored, c) in self.colour[s].iter_mut().zip(colour) {
                *stored = store.channel(alpha * c + (1.0 - alpha) * *stored);
            }
        }
    }

    /// The pixel.
    pub fn resolve(&self) -> [f64; 3] {
        box_filter(&self.colour)
    }

    /// The mean over the samples, for people.
    pub fn contents(&self) -> Contents {
        let mean = self.resolve().map(|c| format!("{c:.3}")).join(" ");
        Contents { samples: Vec::new(), fields: vec![("blended", mean)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_layers_by_hand() {
        let single = ColourStore::single();
        let mut buffer = BlendBuffer::<2> { colour: [[0.0, 0.0, 1.0]; 2] };
        buffer.blend(SampleMask::first(2), [1.0, 0.0, 0.0], 0.5, single);
        buffer.blend(SampleMask::first(1), [0.0, 1.0, 0.0], 0.25, single);
        // Sample 0: 0.25 green + 0.75 (0.5 red + 0.5 blue). Sample 1: 0.5 red + 0.5 blue.
        assert_eq!(buffer.resolve(), [0.4375, 0.125, 0.4375]);
    }

    #[test]
    fn what_is_blended_into_the_opaque_buffer_takes_nothing_more() {
        let bits = |opaque| BlendBuffer::<4>::layout(opaque, ColourStore::single()).bits().total();
        assert_eq!((bits(Opaque::First), bits(Opaque::Together)), (0, 4 * 96));
    }
}
