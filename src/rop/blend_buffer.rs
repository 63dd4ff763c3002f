//! Alpha blending into a multisample colour buffer, sample by sample.

use crate::rop::design::{Contents, StateBits};
use crate::rop::event::Probe;
use crate::rop::over_opaque::Opaque;
use crate::trace::SampleMask;

/// Bits of a colour that is blended: single precision, as rounding to half
/// precision at each layer would show.
const COLOUR_BITS: u32 = 3 * 32;

/// What has been blended over a pixel's `N` samples.
///
/// Hardware blends into the buffer that already holds the opaque colour. Here that
/// colour is added when the pixel is resolved, by the transmittance of all that was
/// blended over it; it is the same sum, and only this simulation stores the
/// transmittance.
#[derive(Clone, Debug)]
pub struct BlendBuffer<const N: usize> {
    colour: [[f32; 3]; N],
    transmittance: [f32; N],
}

impl<const N: usize> Default for BlendBuffer<N> {
    fn default() -> Self {
        BlendBuffer { colour: [[0.0; 3]; N], transmittance: [1.0; N] }
    }
}

impl<const N: usize> BlendBuffer<N> {
    /// Bits of state beside the opaque geometry's buffers: with a buffer of opaque
    /// colours of `colour_bits` there, only what single precision adds to it.
    pub fn state_bits(opaque: Opaque, colour_bits: u32) -> StateBits {
        let there = match opaque {
            Opaque::First => colour_bits,
            Opaque::Together => 0,
        };
        StateBits { samples: N as u32 * (COLOUR_BITS - there), extra: 0, unbounded: false }
    }

    /// Tells `probe` what blending a fragment costs: each sample's colour is read and
    /// written.
    #[inline]
    pub fn tell<P: Probe>(covered: SampleMask, probe: &mut P) {
        probe.written(covered);
        probe.state(COLOUR_BITS * covered.count(), COLOUR_BITS * covered.count());
    }

    /// `C ← αc + (1 − α)C` at each covered sample.
    #[inline]
    pub fn blend(&mut self, covered: SampleMask, colour: [f32; 3], alpha: f32) {
        for s in covered.iter() {
            for (stored, c) in self.colour[s].iter_mut().zip(colour) {
                *stored = alpha * c + (1.0 - alpha) * *stored;
            }
            self.transmittance[s] *= 1.0 - alpha;
        }
    }

    /// The pixel over the opaque samples `behind`.
    pub fn over(&self, behind: &[[f32; 3]; N]) -> [f64; 3] {
        let sample = |s: usize, i: usize| {
            let (colour, behind) = (self.colour[s][i], behind[s][i]);
            f64::from(colour) + f64::from(self.transmittance[s]) * f64::from(behind)
        };
        std::array::from_fn(|i| (0..N).map(|s| sample(s, i)).sum::<f64>() / N as f64)
    }

    /// The means over the samples, for people.
    pub fn contents(&self) -> Contents {
        let mean = |sum: f32| format!("{:.3}", sum / N as f32);
        let channel = |i: usize| mean(self.colour.iter().map(|c| c[i]).sum());
        let fields = vec![
            ("blended", [channel(0), channel(1), channel(2)].join(" ")),
            ("transmittance", mean(self.transmittance.iter().sum())),
        ];
        Contents { samples: Vec::new(), fields }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_layers_by_hand() {
        let mut buffer = BlendBuffer::<2>::default();
        buffer.blend(SampleMask::first(2), [1.0, 0.0, 0.0], 0.5);
        buffer.blend(SampleMask::first(1), [0.0, 1.0, 0.0], 0.25);
        // Sample 0: 0.25 green + 0.75 (0.5 red + 0.5 blue). Sample 1: 0.5 red + 0.5 blue.
        let blue = [0.0, 0.0, 1.0];
        assert_eq!(buffer.over(&[blue; 2]), [0.4375, 0.125, 0.4375]);
    }

    #[test]
    fn what_is_blended_into_the_opaque_buffer_only_widens_it() {
        let bits = |opaque, colour| BlendBuffer::<4>::state_bits(opaque, colour).samples;
        assert_eq!(bits(Opaque::First, 48), 4 * 48);
        assert_eq!(bits(Opaque::First, 96), 0);
        assert_eq!(bits(Opaque::Together, 48), 4 * 96);
    }
}
