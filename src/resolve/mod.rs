//! From a pixel's samples to its colour.

/// Box filter: the mean of the samples' colours, summed in sample order in single
/// precision, so that every implementation rounds alike. Where the sum overflows, the
/// samples' shares are summed instead: the mean of finite colours is finite.
///
/// # Panics
/// Where there are no samples.
pub fn box_filter(colours: &[[f32; 3]]) -> [f64; 3] {
    assert!(!colours.is_empty());
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
