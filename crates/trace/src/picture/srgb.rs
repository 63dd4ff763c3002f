//! The sRGB transfer function (IEC 61966-2-1), on single channels.

/// The linear value of an sRGB-encoded one; both nominally in [0, 1].
pub fn decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// The sRGB encoding of a linear value; both nominally in [0, 1], values beyond
/// are clamped.
pub fn encode(linear: f64) -> f64 {
    encode_beyond(linear.clamp(0.0, 1.0))
}

/// The same without a clamp: the curve goes on above 1, and below 0 it is mirrored.
pub(crate) fn encode_beyond(linear: f64) -> f64 {
    let size = linear.abs();
    let encoded =
        if size <= 0.003_130_8 { size * 12.92 } else { 1.055 * libm::pow(size, 1.0 / 2.4) - 0.055 };
    if linear < 0.0 { -encoded } else { encoded }
}

/// An encoded value in 8 bits, rounded to nearest.
pub(crate) fn to_8_bits(encoded: f64) -> u8 {
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_bit_value_survives_the_round_trip() {
        for v in 0..=255_u8 {
            assert_eq!(to_8_bits(encode(decode(f64::from(v) / 255.0))), v);
        }
        let of = |linear| to_8_bits(encode(linear));
        assert_eq!((of(-1.0), of(7.0), of(f64::NAN)), (0, 255, 0));
    }
}
