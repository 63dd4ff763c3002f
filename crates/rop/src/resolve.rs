//! From a pixel's samples to its colour.

/// Box filter: the mean of the samples' colours, summed in sample order in single
/// precision, so that every implementation rounds alike.
///
/// Two rules come before the sum's own rounding. Where all samples hold one colour, bit for
/// bit, that is the pixel's: a pixel that nothing covers keeps the background's bits, whether
/// or not its tile was touched. Where the sum of a channel overflows, the samples' shares are
/// summed instead: the mean of finite colours is finite.
///
/// # Panics
/// Where there are no samples.
#[inline]
pub fn box_filter(colours: &[[f32; 3]]) -> [f64; 3] {
    let first = colours.first().expect("a pixel has samples");
    let bits = |colour: &[f32; 3]| colour.map(f32::to_bits);
    if colours.iter().all(|c| bits(c) == bits(first)) {
        return first.map(f64::from);
    }
    let count = colours.len() as f32;
    let mut sum = [0.0_f32; 3];
    for colour in colours {
        for (s, c) in sum.iter_mut().zip(colour) {
            *s += c;
        }
    }
    std::array::from_fn(|i| {
        let mean = sum[i] / count;
        f64::from(if mean.is_finite() { mean } else { colours.iter().map(|c| c[i] / count).sum() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_samples_hold_is_the_pixel_bit_for_bit() {
        for value in [0.1, 1.0 / 3.0, 1e-38, 65504.0, f32::MAX, f32::from_bits(1)] {
            for count in [1, 2, 4, 8, 16, 32, 64] {
                let colour = [value, 0.3, 0.7];
                assert_eq!(box_filter(&vec![colour; count]), colour.map(f64::from), "{count}");
            }
        }
        // The sum by itself rounds away from it, and does so for all that differs anywhere.
        let mut samples = [[0.1_f32, 0.0, 0.0]; 8];
        samples[0][1] = 1.0;
        assert!(box_filter(&samples)[0] != f64::from(0.1_f32));
    }

    #[test]
    fn the_mean_is_summed_in_single_precision() {
        assert_eq!(
            box_filter(&[[1.0, 0.5, 0.0], [0.0; 3], [0.0; 3], [0.0; 3]]),
            [0.25, 0.125, 0.0]
        );
        // Neither an overflow nor two that cancel are seen.
        let most = f32::MAX;
        let [same, gone, half] = box_filter(&[
            [most, most, 1.0],
            [most, most, 0.0],
            [most, -most, 0.0],
            [most, -most, 1.0],
        ]);
        assert_eq!((same, gone, half), (f64::from(most), 0.0, 0.5));
        // In single precision 2^24 + 1 is 2^24, thrice.
        let large = (1 << 24) as f32;
        let sum = box_filter(&[[large; 3], [1.0; 3], [1.0; 3], [1.0; 3]]);
        assert_eq!(sum, [f64::from(large / 4.0); 3]);
    }
}
