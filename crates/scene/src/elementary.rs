//! Elementary functions without branches, of which a loop over several numbers becomes vector
//! instructions: the steps of [`libm`]'s, for the numbers that are met here, to the last bit.

/// `libm::log2f` of a finite number above 1.
#[inline(always)]
pub(crate) fn log2(x: f32) -> f32 {
    const HIGH: f32 = 1.442_871_1;
    const LOW: f32 = -1.760_528_5e-4;
    const ROOT_HALF: u32 = 0x3f35_04f3;
    // To [√2/2, √2].
    let bits = x.to_bits().wrapping_add(0x3f80_0000 - ROOT_HALF);
    let k = (bits >> 23) as i32 - 0x7f;
    let f = f32::from_bits((bits & 0x007f_ffff) + ROOT_HALF) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let even = w * (0.400_009_72 + w * 0.242_790_79);
    let odd = z * (0.666_666_6 + w * 0.284_987_87);
    let half = 0.5 * f * f;
    let high = f32::from_bits((f - half).to_bits() & 0xffff_f000);
    let low = f - high - half + s * (half + (odd + even));
    (low + high) * LOW + low * HIGH + high * HIGH + k as f32
}

/// The least argument of [`exp`].
pub(crate) const LEAST_EXPONENT: f64 = -700.0;

/// `libm::exp` of a number from [`LEAST_EXPONENT`] to 0.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    const P: [f64; 5] = [
        1.666_666_666_666_660_2e-1,
        -2.777_777_777_701_559_3e-3,
        6.613_756_321_437_934e-5,
        -1.653_390_220_546_525_2e-6,
        4.138_136_797_057_238_5e-8,
    ];
    // About 3/2 ln 2, 1/2 ln 2 and 2^-28: bounds of the upper word alone.
    let far = x <= -f64::from_bits(0x3ff0_a2b2 << 32);
    let aside = x <= -f64::from_bits(0x3fd6_2e43 << 32);
    let near = x > -f64::from_bits(0x3e30_0001 << 32);
    let k = (std::f64::consts::LOG2_E * x - 0.5) as i32;
    let k = if far { k } else { -i32::from(aside) };
    let (high, low) = (x - f64::from(k) * LN2_HIGH, f64::from(k) * LN2_LOW);
    let r = high - low;
    let rr = r * r;
    let c = r - rr * (P[0] + rr * (P[1] + rr * (P[2] + rr * (P[3] + rr * P[4]))));
    let y = 1.0 + (r * c / (2.0 - c) - low + high);
    let power = f64::from_bits(((i64::from(k) + 1023) as u64) << 52);
    if near { 1.0 + x } else { y * power }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::SQRT_2;

    use super::*;
    use screendoor_trace::random::Stream;

    #[test]
    fn they_are_those_of_libm() {
        let mut random = Stream::new([0xe1e]);
        for i in 0..400_000_u32 {
            // Any float above 1, all exponents alike.
            let x = f32::from_bits(0x3f80_0001 + random.below(0x7f80_0000 - 0x3f80_0001));
            assert_eq!(log2(x).to_bits(), libm::log2f(x).to_bits(), "{x}");
            // Dense near 0 and where the reduction changes, and all of the range.
            let share = f64::from(random.word()) / 4_294_967_296.0;
            let x = -share * [1e-9, 0.01, 2.0, 30.0, 700.0][i as usize % 5];
            assert_eq!(exp(x).to_bits(), libm::exp(x).to_bits(), "{x}");
        }
        for bits in [0x3ff0_a2b2_u64, 0x3fd6_2e42, 0x3fd6_2e43, 0x3e30_0000, 0x3e30_0001] {
            for x in [(bits << 32) - 1, bits << 32, (bits << 32) + 1].map(f64::from_bits) {
                assert_eq!(exp(-x).to_bits(), libm::exp(-x).to_bits(), "{x}");
            }
        }
        for x in [0.0, -0.0, LEAST_EXPONENT] {
            assert_eq!(exp(x).to_bits(), libm::exp(x).to_bits(), "{x}");
        }
        for x in [1.0_f32.next_up(), SQRT_2, SQRT_2.next_up(), 2.0, f32::MAX] {
            assert_eq!(log2(x).to_bits(), libm::log2f(x).to_bits(), "{x}");
        }
    }
}
