//! The sRGB transfer function (IEC 61966-2-1), on single channels.

/// The linear value of an sRGB-encoded one; both nominally in [0, 1].
pub fn decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// The sRGB encoding of a linear value; both nominally in [0, 1], values beyond
/// are clamped.
pub fn encode(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    }
}

/// The sRGB encoding in 8 bits, rounded to nearest.
pub(crate) fn encode8(linear: f64) -> u8 {
    (encode(linear) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_bit_value_survives_the_round_trip() {
        for v in 0..=255_u8 {
            assert_eq!(encode8(decode(f64::from(v) / 255.0)), v);
        }
        assert_eq!((encode8(-1.0), encode8(7.0), encode8(f64::NAN)), (0, 255, 0));
    }
}
