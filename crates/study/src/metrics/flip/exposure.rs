//! The exposures of HDR-FLIP: from the one that shows the reference's brightest pixel
//! well to the one that shows its median.

use super::Planes;

/// Narkowicz' fit to the ACES tone curve with its exposure of 0.6 folded in, as both
/// papers' evaluator has it: (a x² + b x) / (c x² + d x + e).
const CURVE: [f32; 5] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

/// What a well exposed pixel is mapped to.
const BRIGHT: f64 = 0.85;

/// No luminance counts as less.
const DARKEST: f32 = f32::EPSILON;

/// A factor before tone mapping; `None` shows values as they are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Exposure(Option<f32>);

impl Exposure {
    /// The picture at this exposure, in [0, 1].
    pub(super) fn show(self, linear: &Planes) -> Planes {
        let mapped = |v: f32| match self.0 {
            None => v.min(1.0),
            Some(factor) => tone_map(v * factor),
        };
        linear.each_ref().map(|plane| plane.iter().map(|v| mapped(*v)).collect())
    }
}

fn tone_map(x: f32) -> f32 {
    // Far beyond where the curve reaches 1, and where its squares are still finite.
    let x = x.min(1e6);
    let [a, b, c, d, e] = CURVE;
    ((a * x + b) * x / ((c * x + d) * x + e)).clamp(0.0, 1.0)
}

/// What the curve maps to `BRIGHT`: the positive root of a quadratic.
fn bright() -> f64 {
    let [a, b, c, d, e] = CURVE.map(f64::from);
    let (p, q, r) = (a - BRIGHT * c, b - BRIGHT * d, -BRIGHT * e);
    (-q + (q * q - 4.0 * p * r).sqrt()) / (2.0 * p)
}

/// The exposures for a reference: from log2(bright / brightest luminance) to
/// log2(bright / median luminance), at most a stop apart, at least two; one where the
/// two ends are equal, since the largest of equals is any of them.
pub(super) fn exposures(reference: &Planes) -> Vec<Exposure> {
    let [r, g, b] = reference;
    let mut luminances: Vec<f32> = r
        .iter()
        .zip(g)
        .zip(b)
        .map(|((r, g), b)| (0.2126 * r + 0.7152 * g + 0.0722 * b).max(DARKEST))
        .collect();
    let Some(brightest) = luminances.iter().copied().reduce(f32::max) else {
        return Vec::new();
    };
    if brightest <= DARKEST {
        return vec![Exposure(None)];
    }
    let middle = luminances.len() / 2;
    let median = *luminances.select_nth_unstable_by(middle, f32::total_cmp).1;
    let stops = |luminance: f32| libm::log2(bright() / f64::from(luminance));
    let (start, stop) = (stops(brightest), stops(median));
    let count = if start == stop { 1 } else { ((stop - start).ceil() as usize).max(2) };
    let step = (stop - start) / count.saturating_sub(1).max(1) as f64;
    let factor = |i: usize| libm::exp2(start + i as f64 * step) as f32;
    (0..count).map(|i| Exposure(Some(factor(i)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> Planes {
        [values.to_vec(), values.to_vec(), values.to_vec()]
    }

    fn stops(values: &[f32]) -> Vec<f32> {
        exposures(&grey(values)).iter().map(|e| e.0.map_or(f32::NAN, f32::log2)).collect()
    }

    /// What the evaluator `flip_evaluator` 1.7 reports of its exposures.
    #[test]
    fn exposures_are_the_evaluators() {
        for (values, start, stop, count) in [
            (&[1.0, 2.0, 3.0, 4.0][..], -0.916_702_8, -0.501_665_35, 2),
            (&[1.0, 2.0, 3.0, 10.0, 20.0], -3.238_630_8, -0.501_665_35, 3),
            (&[0.0, 0.0, 0.0, 5.0], -1.238_630_9, 24.083_298, 26),
            (&[3.0, 1.0, 2.0, 4.0, 5.0, 9.0], -2.086_627_7, -0.916_702_8, 2),
            // The evaluator compares the same exposure twice.
            (&[1.0, 1.0, 1.0, 1.0], 1.083_297_3, 1.083_297_3, 1),
        ] {
            let found = stops(values);
            assert_eq!(found.len(), count, "{values:?}");
            assert!((found[0] - start).abs() < 1e-5, "{found:?}");
            assert!((found[count - 1] - stop).abs() < 1e-5, "{found:?}");
        }
    }

    #[test]
    fn black_has_one_exposure_and_shows_values_as_they_are() {
        assert_eq!(exposures(&grey(&[0.0; 5])), [Exposure(None)]);
        assert_eq!(Exposure(None).show(&grey(&[0.25, 7.0]))[0], [0.25, 1.0]);
        assert!(exposures(&grey(&[])).is_empty());
    }

    #[test]
    fn the_curve_stays_in_range_and_finite() {
        assert!((f64::from(tone_map(bright() as f32)) - BRIGHT).abs() < 1e-6);
        assert_eq!((tone_map(0.0), tone_map(f32::INFINITY)), (0.0, 1.0));
    }
}
