//! The feature pipeline (section 4.2): edges and points of the luminance.

use super::filter::{Kernel, Size};

/// Width of the features that matter most, in degrees.
const WIDTH: f64 = 0.082;

/// The detectors: a Gaussian and its derivatives.
#[derive(Debug)]
pub(super) struct Features {
    smooth: Kernel,
    first: Kernel,
    second: Kernel,
}

impl Features {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        let deviation = 0.5 * WIDTH * pixels_per_degree;
        let reach = (3.0 * deviation).ceil() as usize;
        let gaussian = |k: usize| libm::exp(-((k * k) as f64) / (2.0 * deviation * deviation));
        let half = |f: &dyn Fn(usize) -> f64| (0..=reach).map(f).collect::<Vec<f64>>();

        let smooth = half(&gaussian);
        let sum = 2.0 * smooth.iter().sum::<f64>() - smooth[0];
        // The derivatives' positive weights add up to 1 and the negative ones to −1.
        let first = half(&|k| k as f64 * gaussian(k));
        let one_side: f64 = first.iter().sum();
        let second = half(&|k| ((k * k) as f64 / (deviation * deviation) - 1.0) * gaussian(k));
        let total = |sign: f64| {
            let part = |(k, v): (usize, &f64)| (v * sign).max(0.0) * if k == 0 { 1.0 } else { 2.0 };
            second.iter().enumerate().map(part).sum::<f64>()
        };
        let (above, below) = (total(1.0), total(-1.0));
        let scaled = |values: &[f64], scale: &dyn Fn(f64) -> f64| {
            values.iter().map(|v| scale(*v)).collect::<Vec<f64>>()
        };
        Features {
            smooth: Kernel::even(&scaled(&smooth, &|v| v / sum)),
            first: Kernel::odd(&scaled(&first, &|v| v / one_side)),
            second: Kernel::even(&scaled(&second, &|v| v / if v > 0.0 { above } else { below })),
        }
    }

    /// The strength of edges and of points in `luminance`, which lies in [0, 1].
    pub(super) fn of(&self, luminance: &[f32], size: Size) -> (Vec<f32>, Vec<f32>) {
        let across = self.smooth.along_rows(luminance, size);
        let strength = |kernel: &Kernel| {
            let x = self.smooth.along_columns(&kernel.along_rows(luminance, size), size);
            let y = kernel.along_columns(&across, size);
            x.iter().zip(&y).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        (strength(&self.first), strength(&self.second))
    }
}

/// The difference of features whose strengths of edges and of points differ so much, in
/// [0, 1]: the larger difference, raised to the papers' exponent of 1/2.
#[inline]
pub(super) fn difference(edge: f32, point: f32) -> f32 {
    (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0)
}
