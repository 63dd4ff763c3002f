//! How wide colours are stored, the same for every design that stores any.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, u32x16};
use half::f16;

use crate::contract::frame::Frame;
use screendoor_trace::param::{Typed, Values};

screendoor_trace::options! {
    /// How wide a stored channel of a colour is.
    pub enum ColourWidth {
        Trace = "trace": "as the trace stores colours: 16 or 32",
        Unorm = "8": "8 bits, from 0 to 1",
        Half = "16": "16-bit floating point",
        Single = "32": "32-bit floating point",
    }
}

/// The parameter's declaration.
pub const PARAM: Typed<ColourWidth> = Typed::choice(
    "colour",
    "trace",
    "bits of each channel of a stored or summed colour, and of the alpha beside it",
);

/// A buffer of colours. What is stored there is rounded each time that it is stored: a
/// sum once for each fragment, as a blending unit does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ColourStore {
    width: ColourWidth,
    /// Whether the trace's own colours are stored as they are.
    keeps: bool,
}

impl ColourStore {
    /// As the parameter says, for the frame's trace.
    pub fn of(values: &Values, frame: &Frame) -> Self {
        let trace = if frame.colour_bits == 48 { ColourWidth::Half } else { ColourWidth::Single };
        let width = match values.get(PARAM) {
            ColourWidth::Trace => trace,
            chosen => chosen,
        };
        ColourStore { width, keeps: width == trace || width == ColourWidth::Single }
    }

    /// Colours of single precision.
    pub fn single() -> Self {
        ColourStore { width: ColourWidth::Single, keeps: true }
    }

    /// Whether a fragment's colour is stored as it is.
    pub fn keeps(self) -> bool {
        self.keeps
    }

    /// Bits of a channel: 8, 16 or 32.
    #[inline]
    pub fn channel_bits(self) -> u32 {
        match self.width {
            ColourWidth::Unorm => 8,
            ColourWidth::Half => 16,
            ColourWidth::Single | ColourWidth::Trace => 32,
        }
    }

    /// Bits of a colour.
    #[inline]
    pub fn colour_bits(self) -> u32 {
        3 * self.channel_bits()
    }

    /// Bits of a colour and an alpha, a weight or a transmittance.
    #[inline]
    pub fn texel_bits(self) -> u32 {
        4 * self.channel_bits()
    }

    /// A channel as it is stored: the nearest value that there is; of two the even one in
    /// floating point, the greater one in 8 bits. What lies beyond the greatest value
    /// becomes that, as where a blending unit clamps: no infinity comes of what is finite.
    #[inline]
    pub fn channel(self, value: f32) -> f32 {
        match self.width {
            ColourWidth::Unorm => (value.clamp(0.0, 1.0) * 255.0 + 0.5).floor() / 255.0,
            ColourWidth::Half => as_half(value),
            ColourWidth::Single | ColourWidth::Trace => value,
        }
    }

    /// [`ColourStore::channel`] of sixteen finite ones.
    #[inline(always)]
    pub fn channels<S: Simd>(self, simd: S, values: f32x16<S>) -> f32x16<S> {
        match self.width {
            ColourWidth::Unorm => {
                (values.max(0.0).min(1.0) * 255.0 + f32x16::splat(simd, 0.5)).floor() / 255.0
            }
            ColourWidth::Half => as_halves(simd, values),
            ColourWidth::Single | ColourWidth::Trace => values,
        }
    }

    /// A colour as it is stored.
    #[inline]
    pub fn colour(self, [r, g, b]: [f32; 3]) -> [f32; 3] {
        [self.channel(r), self.channel(g), self.channel(b)]
    }
}

/// The nearest number of 16-bit floating point, the even one of two; the greatest for what
/// lies beyond.
///
/// `f16::from_f32` says the same (tests hold it to that) but asks the machine for its instructions
/// with each number: it took a tenth of the time of designs that keep layers.
#[inline]
fn as_half(value: f32) -> f32 {
    let value = value.clamp(f16::MIN.to_f32_const(), f16::MAX.to_f32_const());
    if value.abs() >= f16::MIN_POSITIVE.to_f32_const() {
        // Ten binary digits of 23 are kept.
        let bits = value.to_bits();
        return f32::from_bits((bits + 0xfff + (bits >> 13 & 1)) & !0x1fff);
    }
    if value.is_nan() {
        return value;
    }
    // Subnormal ones are the multiples of 2^-24, as single precision has them from 1/2 to 1.
    ((value.abs() + 0.75) - 0.75).copysign(value)
}

/// [`as_half`] of sixteen finite numbers.
#[inline(always)]
fn as_halves<S: Simd>(simd: S, values: f32x16<S>) -> f32x16<S> {
    let values = values.max(f16::MIN.to_f32_const()).min(f16::MAX.to_f32_const());
    let word = |word: u32| u32x16::splat(simd, word);
    let bits = values.bitcast::<u32x16<S>>();
    let rounded = (bits + word(0xfff) + ((bits >> 13) & word(1))) & word(!0x1fff);
    let size = values.abs();
    let three_quarters = f32x16::splat(simd, 0.75);
    let small = ((size + three_quarters) - three_quarters).copysign(values);
    let normal = size.simd_ge(f32x16::splat(simd, f16::MIN_POSITIVE.to_f32_const()));
    normal.select(rounded.bitcast::<f32x16<S>>(), small)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: ColourStore = ColourStore { width: ColourWidth::Half, keeps: true };
    const UNORM: ColourStore = ColourStore { width: ColourWidth::Unorm, keeps: false };

    #[test]
    fn every_half_is_kept_and_what_lies_between_goes_to_the_nearest_or_the_even_one() {
        for bits in 0..0x7bff_u16 {
            let [here, next] = [bits, bits + 1].map(|b| f16::from_bits(b).to_f32());
            let middle = f32::midpoint(here, next);
            let even = if bits % 2 == 0 { here } else { next };
            for sign in [1.0, -1.0] {
                assert_eq!(HALF.channel(sign * here), sign * here);
                assert_eq!(HALF.channel(sign * middle), sign * even, "{bits:#x}");
                assert_eq!(HALF.channel(sign * middle.next_down()), sign * here);
                assert_eq!(HALF.channel(sign * middle.next_up()), sign * next);
            }
        }
        let library = |value: f32| f16::from_f32(value).to_f32();
        for value in (0..0x477f_e000).step_by(1021).map(f32::from_bits) {
            for value in [value, -value] {
                assert_eq!(HALF.channel(value).to_bits(), library(value).to_bits(), "{value}");
            }
        }
        assert!(HALF.channel(f32::NAN).is_nan());
        assert_eq!(HALF.channel(1e9), 65504.0);
        assert_eq!(HALF.channel(f32::NEG_INFINITY), -65504.0);
    }

    #[test]
    fn bytes_are_clamped_and_rounded() {
        for byte in 0..=255_u8 {
            let value = f32::from(byte) / 255.0;
            assert_eq!(UNORM.channel(value), value);
            let nearer = (f32::from(byte) + 0.49) / 255.0;
            assert_eq!(UNORM.channel(nearer), value);
        }
        assert_eq!(UNORM.colour([-1.0, 0.6 / 255.0, 7.0]), [0.0, 1.0 / 255.0, 1.0]);
    }

    #[test]
    fn single_precision_is_as_it_is() {
        for value in [0.1, 1e30, -3.5e-41, f32::INFINITY] {
            assert_eq!(ColourStore::single().channel(value), value);
        }
    }
}
