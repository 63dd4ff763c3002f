//! What pixels of Vulkan's formats hold.
//!
//! Formats are read by their names, which follow one grammar (`B8G8R8A8_UNORM`,
//! `A2B10G10R10_UNORM_PACK32`), so that no table has to know each of them.

use arrayvec::ArrayVec;
use ash::vk;
use half::f16;
use screendoor_trace::picture::{Space, srgb};

/// How a channel's bits are read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Unorm,
    Snorm,
    Srgb,
    Float,
    /// Without a sign, in 10 or 11 bits.
    UnsignedFloat,
    Integer,
}

/// A channel: which of red, green, blue and alpha, and how many bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Channel {
    of: usize,
    bits: u32,
}

/// A format of colours.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct PixelFormat {
    pub kind: Kind,
    /// From the lowest bit of a little-endian number up.
    channels: ArrayVec<Channel, 4>,
}

/// The name of a `VkFormat`, without what all have in common.
pub(crate) fn name(format: i32) -> String {
    format!("{:?}", vk::Format::from_raw(format))
}

impl PixelFormat {
    /// `None` for what is no colour, is compressed, or shares an exponent.
    pub(crate) fn of(format: i32) -> Option<Self> {
        let name = name(format);
        let mut parts = name.split('_');
        let mut channels = channels(parts.next()?)?;
        let kind = match parts.next()? {
            "UNORM" => Kind::Unorm,
            "SNORM" => Kind::Snorm,
            "SRGB" => Kind::Srgb,
            "SFLOAT" => Kind::Float,
            "UFLOAT" => Kind::UnsignedFloat,
            "UINT" | "SINT" => Kind::Integer,
            _ => return None,
        };
        // Packed ones are named from the highest bit down, others by their bytes.
        match parts.next() {
            None => {}
            Some("PACK8" | "PACK16" | "PACK32") => channels.reverse(),
            Some(_) => return None,
        }
        let bits = |bits: u32| match kind {
            Kind::Float => [16, 32].contains(&bits),
            Kind::UnsignedFloat => [10, 11].contains(&bits),
            _ => (1..=32).contains(&bits),
        };
        let good = channels.iter().all(|c| bits(c.bits));
        let whole = channels.iter().map(|c| c.bits).sum::<u32>() % 8 == 0;
        (good && whole && parts.next().is_none()).then_some(PixelFormat { kind, channels })
    }

    /// Bytes of a pixel.
    pub(crate) fn bytes(&self) -> usize {
        self.channels.iter().map(|c| c.bits).sum::<u32>() as usize / 8
    }

    /// The channels that it has, as `VkColorComponentFlags` has them.
    pub(crate) fn mask(&self) -> u32 {
        self.channels.iter().fold(0, |mask, c| mask | 1 << c.of)
    }

    /// What its numbers stand for when they are blended: those of an sRGB format are made amounts
    /// of light first, those of others are blended as they stand, which for numbers of 0 to 1
    /// is what is sent to a display.
    pub(crate) fn space(&self) -> Space {
        match self.kind {
            Kind::Unorm | Kind::Snorm => Space::Encoded,
            _ => Space::Linear,
        }
    }

    /// The range to which numbers are clamped before they are blended, where they are.
    pub(crate) fn range(&self) -> Option<[f32; 2]> {
        match self.kind {
            Kind::Unorm | Kind::Srgb => Some([0.0, 1.0]),
            Kind::Snorm => Some([-1.0, 1.0]),
            _ => None,
        }
    }

    /// A number as it is clamped there; what is no number becomes 0.
    pub(crate) fn clamped(&self, value: f32) -> f32 {
        match self.range() {
            Some(_) if value.is_nan() => 0.0,
            Some([low, high]) => value.clamp(low, high),
            None => value,
        }
    }

    /// The colour that a pixel's bytes hold, as it is blended. Channels that are not there are 0,
    /// alpha 1.
    pub(crate) fn decode(&self, bytes: &[u8]) -> [f32; 4] {
        let mut word = [0; 16];
        word[..self.bytes()].copy_from_slice(&bytes[..self.bytes()]);
        let mut word = u128::from_le_bytes(word);
        let mut colour = [0.0, 0.0, 0.0, 1.0];
        for channel in &self.channels {
            let bits = (word & ((1 << channel.bits) - 1)) as u32;
            word >>= channel.bits;
            colour[channel.of] = self.number(*channel, bits);
        }
        colour
    }

    fn number(&self, channel: Channel, bits: u32) -> f32 {
        let all = f64::from(u32::MAX >> (32 - channel.bits));
        match self.kind {
            Kind::Srgb if channel.of < 3 => srgb::decode(f64::from(bits) / all) as f32,
            Kind::Unorm | Kind::Srgb => (f64::from(bits) / all) as f32,
            Kind::Snorm => {
                let shift = 32 - channel.bits;
                let signed = f64::from(((bits << shift) as i32) >> shift);
                (signed / f64::from(u32::MAX >> (shift + 1))).max(-1.0) as f32
            }
            Kind::Float if channel.bits == 32 => f32::from_bits(bits),
            Kind::Float => f16::from_bits(bits as u16).to_f32(),
            // A half without its sign and some of its last bits.
            Kind::UnsignedFloat => f16::from_bits((bits << (15 - channel.bits)) as u16).to_f32(),
            Kind::Integer => bits as f32,
        }
    }

    /// What a colour is after it was stored.
    pub(crate) fn stored(&self, colour: [f32; 4]) -> [f32; 4] {
        let mut stored = [0.0, 0.0, 0.0, 1.0];
        for channel in &self.channels {
            let value = self.clamped(colour[channel.of]);
            let steps = |most: f64, value: f64| (value * most).round() / most;
            let all = f64::from(u32::MAX >> (32 - channel.bits));
            let exact = f64::from(value);
            stored[channel.of] = match self.kind {
                Kind::Srgb if channel.of < 3 => {
                    srgb::decode(steps(all, srgb::encode(exact))) as f32
                }
                Kind::Unorm | Kind::Srgb => steps(all, exact) as f32,
                Kind::Snorm => steps(f64::from(u32::MAX >> (33 - channel.bits)), exact) as f32,
                Kind::Float if channel.bits == 32 => value,
                Kind::Float => f16::from_f32(value).to_f32(),
                Kind::UnsignedFloat => {
                    let lost = 15 - channel.bits;
                    let half = f16::from_f32(value.max(0.0)).to_bits();
                    // To the nearest, as far as there is one above.
                    let near = (half + (1 << (lost - 1))).min(0x7bff) >> lost << lost;
                    f16::from_bits(near).to_f32()
                }
                Kind::Integer => value,
            };
        }
        stored
    }
}

/// `R8G8B8A8` as channels.
fn channels(text: &str) -> Option<ArrayVec<Channel, 4>> {
    let mut channels = ArrayVec::<Channel, 4>::new();
    for (at, letter) in text.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()) {
        let of = "RGBA".find(letter)?;
        let digits = &text[at + 1..];
        let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
        channels.try_push(Channel { of, bits: digits[..end].parse().ok()? }).ok()?;
    }
    let twice = (1..channels.len()).any(|i| channels[..i].iter().any(|c| c.of == channels[i].of));
    (!channels.is_empty() && !twice && text.starts_with(char::is_alphabetic)).then_some(channels)
}

/// A depth as a depth image of this format holds it.
pub(crate) fn stored_depth(format: i32, depth: f32) -> f32 {
    let depth = depth.clamp(0.0, 1.0);
    let steps = |most: f64| ((f64::from(depth) * most).round() / most) as f32;
    match vk::Format::from_raw(format) {
        vk::Format::D16_UNORM | vk::Format::D16_UNORM_S8_UINT => steps(65535.0),
        vk::Format::D24_UNORM_S8_UINT | vk::Format::X8_D24_UNORM_PACK32 => steps(16_777_215.0),
        _ => depth,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(format: vk::Format) -> PixelFormat {
        PixelFormat::of(format.as_raw()).unwrap()
    }

    #[test]
    fn pixels_are_read_by_the_format_s_name() {
        let bgra = of(vk::Format::B8G8R8A8_UNORM);
        assert_eq!((bgra.bytes(), bgra.mask(), bgra.space()), (4, 15, Space::Encoded));
        assert_eq!(bgra.decode(&[255, 0, 51, 102]), [0.2, 0.0, 1.0, 0.4]);
        let packed = of(vk::Format::A2B10G10R10_UNORM_PACK32);
        assert_eq!(packed.decode(&1023_u32.to_le_bytes()), [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(packed.decode(&(3_u32 << 30).to_le_bytes()), [0.0, 0.0, 0.0, 1.0]);
        let small = of(vk::Format::R5G6B5_UNORM_PACK16);
        assert_eq!(small.decode(&0xf800_u16.to_le_bytes()), [1.0, 0.0, 0.0, 1.0]);
        let half = of(vk::Format::R16G16B16A16_SFLOAT);
        let bytes: Vec<u8> =
            [1.5, -2.0, 0.25, 7.0].iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect();
        assert_eq!(half.decode(&bytes), [1.5, -2.0, 0.25, 7.0]);
        let srgb = of(vk::Format::R8G8B8A8_SRGB);
        assert_eq!(srgb.space(), Space::Linear);
        let read = srgb.decode(&[255, 188, 0, 128]);
        assert!((read[1] - 0.503).abs() < 0.001 && (read[3] - 0.50196).abs() < 1e-5, "{read:?}");
        assert_eq!(of(vk::Format::R8_SNORM).decode(&[0x81])[0], -1.0);
        let packed = of(vk::Format::B10G11R11_UFLOAT_PACK32);
        assert_eq!(packed.stored([1.0, 0.5, 3.0, 0.3]), [1.0, 0.5, 3.0, 1.0]);
        assert_eq!(of(vk::Format::R8_UINT).kind, Kind::Integer);
        for none in [
            vk::Format::D32_SFLOAT,
            vk::Format::D24_UNORM_S8_UINT,
            vk::Format::BC1_RGB_UNORM_BLOCK,
            vk::Format::E5B9G9R9_UFLOAT_PACK32,
            vk::Format::UNDEFINED,
            vk::Format::G8B8G8R8_422_UNORM,
            vk::Format::R64_SFLOAT,
        ] {
            assert_eq!(PixelFormat::of(none.as_raw()), None, "{none:?}");
        }
        assert_eq!(PixelFormat::of(i32::MAX), None);
    }

    #[test]
    fn what_is_read_is_stored_as_it_was() {
        for format in [
            vk::Format::R8G8B8A8_UNORM,
            vk::Format::B8G8R8A8_SRGB,
            vk::Format::A2R10G10B10_UNORM_PACK32,
            vk::Format::R16G16B16A16_SNORM,
            vk::Format::R16G16B16A16_UNORM,
            vk::Format::B10G11R11_UFLOAT_PACK32,
        ] {
            let format = of(format);
            for seed in 0..200_u64 {
                let word = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).to_le_bytes();
                let read = format.decode(&word);
                if read.iter().all(|v| v.is_finite()) {
                    assert_eq!(format.stored(read), read, "{format:?}");
                }
            }
        }
    }

    #[test]
    fn depths_are_as_coarse_as_their_image() {
        let coarse = stored_depth(vk::Format::D16_UNORM.as_raw(), 0.5);
        assert_eq!(coarse, (32768.0 / 65535.0) as f32);
        assert_eq!(stored_depth(vk::Format::D32_SFLOAT.as_raw(), 0.3), 0.3);
        assert_eq!(stored_depth(vk::Format::D32_SFLOAT.as_raw(), 1.5), 1.0);
    }
}
