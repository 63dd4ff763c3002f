//! Functions of double precision of eight numbers, with the bits of `libm`: its steps, one for
//! one, with what it decides by jumps selected.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8, u64x8};

/// ln 2, in a part of which multiples are exact, and the rest.
const LN_2: [f64; 2] =
    [f64::from_bits(0x3fe6_2e42_fee0_0000), f64::from_bits(0x3dea_39ef_3579_3c76)];

/// 2^52: a whole number below it, added to it, stands in the lowest bits.
const WHOLE: f64 = (1_u64 << 52) as f64;

/// The same function of each number, for what is rare.
#[cold]
#[inline(never)]
fn one_by_one<S: Simd>(simd: S, x: f64x8<S>, f: fn(f64) -> f64) -> f64x8<S> {
    let mut each = [0.0; 8];
    x.store_slice(&mut each);
    f64x8::from_slice(simd, &each.map(f))
}

#[inline(always)]
fn bits<S: Simd>(simd: S, bits: u64) -> u64x8<S> {
    u64x8::splat(simd, bits)
}

/// Whole numbers below 2^52.
#[inline(always)]
fn real<S: Simd>(simd: S, whole: u64x8<S>) -> f64x8<S> {
    (whole | bits(simd, WHOLE.to_bits())).bitcast::<f64x8<S>>() - WHOLE
}

/// Whole numbers of 32 bits.
#[inline(always)]
pub(crate) fn reals<S: Simd>(simd: S, whole: fearless_simd::u32x16<S>) -> [f64x8<S>; 2] {
    let (low, high) = simd.widen_u32x16(whole);
    [real(simd, low), real(simd, high)]
}

/// [`libm::exp`].
#[inline(always)]
pub fn exp<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    const P: [f64; 5] = [
        f64::from_bits(0x3fc5_5555_5555_553e),
        f64::from_bits(0xbf66_c16c_16be_bd93),
        f64::from_bits(0x3f11_566a_af25_de2c),
        f64::from_bits(0xbebb_bd41_c5d2_6bf1),
        f64::from_bits(0x3e66_3769_72be_a4d0),
    ];
    let number = |x: f64| f64x8::splat(simd, x);
    // The least numbers of which the upper word is beyond a bound.
    let from = |upper: u64| number(f64::from_bits(upper << 32));
    let size = x.abs();
    // Beyond, results come near the ends of the range; and those that are no numbers.
    if !size.simd_lt(number(700.0)).all_true() {
        return one_by_one(simd, x, libm::exp);
    }
    let inverse = number(std::f64::consts::LOG2_E);
    let far = (inverse * x + number(0.5).copysign(x)).trunc();
    let k = size.simd_ge(from(0x3ff0_a2b2)).select(far, number(1.0).copysign(x));
    let k = size.simd_ge(from(0x3fd6_2e43)).select(k, number(0.0));
    let (high, low) = (x - k * LN_2[0], k * LN_2[1]);
    let r = high - low;
    let square = r * r;
    let mut sum = number(P[4]);
    for p in [P[3], P[2], P[1], P[0]] {
        sum = number(p) + square * sum;
    }
    let c = r - square * sum;
    let y = number(1.0) + (r * c / (number(2.0) - c) - low + high);
    let power = (k + (WHOLE + 1023.0)).bitcast::<u64x8<S>>() << 52;
    let small = size.simd_lt(from(0x3e30_0001));
    small.select(number(1.0) + x, y * power.bitcast::<f64x8<S>>())
}

/// The upper word of √½, and what takes it to that of 1.
const ROOT: u64 = 0x3fe6_a09e << 32;
const TO_ONE: u64 = (0x3ff0_0000 << 32) - ROOT;

/// 2^k, of which k comes back, times a number between √½ and √2, which comes back less 1.
#[inline(always)]
fn parted<S: Simd>(simd: S, x: f64x8<S>) -> (f64x8<S>, f64x8<S>) {
    let raised = x.bitcast::<u64x8<S>>() + bits(simd, TO_ONE);
    let k = real(simd, raised >> 52) - 1023.0;
    let fraction = (raised & bits(simd, (1 << 52) - 1)) + bits(simd, ROOT);
    (k, fraction.bitcast::<f64x8<S>>() - 1.0)
}

/// The logarithm of 2^k (1 + f), and of what was lost of that, c.
#[inline(always)]
fn logarithm<S: Simd>(simd: S, k: f64x8<S>, f: f64x8<S>, c: f64x8<S>) -> f64x8<S> {
    const L: [f64; 7] = [
        f64::from_bits(0x3fe5_5555_5555_5593),
        f64::from_bits(0x3fd9_9999_9997_fa04),
        f64::from_bits(0x3fd2_4924_9422_9359),
        f64::from_bits(0x3fcc_71c5_1d8e_78af),
        f64::from_bits(0x3fc7_4664_96cb_03de),
        f64::from_bits(0x3fc3_9a09_d078_c69f),
        f64::from_bits(0x3fc2_f112_df3e_5244),
    ];
    let number = |x: f64| f64x8::splat(simd, x);
    let half = number(0.5) * f * f;
    let s = f / (number(2.0) + f);
    let z = s * s;
    let w = z * z;
    let even = w * (number(L[1]) + w * (number(L[3]) + w * L[5]));
    let odd = z * (number(L[0]) + w * (number(L[2]) + w * (number(L[4]) + w * L[6])));
    s * (half + (odd + even)) + (k * LN_2[1] + c) - half + f + k * LN_2[0]
}

/// [`libm::log`].
#[inline(always)]
pub fn log<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let number = |x: f64| f64x8::splat(simd, x);
    if !(x.simd_ge(number(f64::MIN_POSITIVE)) & x.simd_lt(number(f64::INFINITY))).all_true() {
        return one_by_one(simd, x, libm::log);
    }
    let (k, f) = parted(simd, x);
    logarithm(simd, k, f, number(0.0))
}

/// [`libm::log1p`].
#[inline(always)]
pub fn log1p<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let number = |x: f64| f64x8::splat(simd, x);
    let from = |upper: u64| number(f64::from_bits(upper << 32));
    // Nothing is lost of larger ones that is not in the plain text's way.
    if !(x.simd_ge(number(0.0)) & x.simd_lt(number(WHOLE))).all_true() {
        return one_by_one(simd, x, libm::log1p);
    }
    let sum = number(1.0) + x;
    let (k, f) = parted(simd, sum);
    let lost = k.simd_ge(number(2.0)).select(number(1.0) - (sum - x), x - (sum - 1.0)) / sum;
    let near = x.simd_lt(from(0x3fda_827a));
    let nought = number(0.0);
    let (k, f) = (near.select(nought, k), near.select(x, f));
    let log = logarithm(simd, k, f, near.select(nought, lost));
    x.simd_lt(from(0x3ca0_0000)).select(x, log)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::for_level;
    use crate::lanes::levels;
    use fearless_simd::Level;
    use screendoor_trace::random::Stream;

    /// Holds a function in lanes to the plain one.
    macro_rules! same {
        ($f:ident, $numbers:expr) => {{
            fn eight(level: Level, x: &[f64], found: &mut [f64; 8]) {
                for_level!(level, simd => {
                    $f(simd, f64x8::from_slice(simd, x)).store_slice(&mut found[..]);
                })
            }
            let mut numbers: Vec<f64> = $numbers;
            numbers.resize(numbers.len().next_multiple_of(8), 0.5);
            for (name, level) in levels() {
                for x in numbers.chunks(8) {
                    let mut found = [0.0; 8];
                    eight(level, x, &mut found);
                    for (x, found) in x.iter().zip(found) {
                        let plain = libm::$f(*x);
                        let same = plain.to_bits() == found.to_bits()
                            || plain.is_nan() && found.is_nan();
                        assert!(same, "{name}: {x:?} ({:#x}): {plain:?}, {found:?}", x.to_bits());
                    }
                }
            }
        }};
    }

    /// Numbers of all sizes between two powers of 2, some of either sign, and their neighbours
    /// at each of `ends`.
    fn numbers(powers: std::ops::Range<i32>, signed: bool, ends: &[f64]) -> Vec<f64> {
        let mut random = Stream::new([17]);
        let mut numbers = Vec::new();
        for power in powers {
            for _ in 0..200 {
                let fraction = 1.0 + f64::from(random.word()) / (f64::from(u32::MAX) + 1.0);
                let odd = f64::from(random.word()) * f64::EPSILON / 4.0;
                let x = (fraction + odd) * 2.0_f64.powi(power);
                numbers.push(if signed && random.below(2) == 1 { -x } else { x });
            }
        }
        for end in ends {
            let mut near = [*end; 2];
            for _ in 0..20 {
                numbers.extend(near);
                numbers.extend(near.map(|x| -x).iter().filter(|_| signed));
                near = [near[0].next_down(), near[1].next_up()];
            }
        }
        numbers
    }

    #[test]
    fn exponentials_have_the_bits_of_the_plain_ones() {
        let upper = |word: u64| f64::from_bits(word << 32);
        let bounds = [0x3fd6_2e43, 0x3fd6_2e42, 0x3ff0_a2b2, 0x3e30_0000, 0x3e30_0001].map(upper);
        let ends = [bounds.to_vec(), vec![0.0, 700.0, 708.396, 745.133, f64::INFINITY]].concat();
        let whole = (1..1000).map(|k| -f64::from(k) * std::f64::consts::LN_2 / 2.0);
        let mut all = numbers(-60..11, true, &ends);
        all.extend(whole.flat_map(|x| [x, x.next_up(), x.next_down()]));
        // Where all eight are ordinary the ends are not in their way.
        all.sort_by(f64::total_cmp);
        all.push(f64::NAN);
        same!(exp, all);
    }

    #[test]
    fn logarithms_have_the_bits_of_the_plain_ones() {
        let root = std::f64::consts::FRAC_1_SQRT_2;
        let ends = [0.0, 1.0, root, 2.0 * root, f64::MIN_POSITIVE, f64::MAX];
        let mut all = numbers(-1030..1024, false, &ends);
        all.extend(numbers(-54..1, true, &[0.5, 1.0]).iter().map(|x| 1.0 + x));
        all.sort_by(f64::total_cmp);
        all.push(f64::NAN);
        same!(log, all);
    }

    #[test]
    fn logarithms_beside_one_have_the_bits_of_the_plain_ones() {
        let root = std::f64::consts::SQRT_2;
        let upper = |word: u64| f64::from_bits(word << 32);
        let ends = [root - 1.0, upper(0x3fda_827a), upper(0x3ca0_0000), 1.0, 3.0, WHOLE, 0.0];
        let mut all = numbers(-1030..80, true, &ends);
        all.extend([f64::INFINITY, f64::MAX]);
        all.sort_by(f64::total_cmp);
        all.push(f64::NAN);
        same!(log1p, all);
    }
}
