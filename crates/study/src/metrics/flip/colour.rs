//! The colour pipeline (section 4.1): what the eye resolves, and how far apart two colours are.

use glam::{DMat3, DVec3};

use super::Planes;
use super::filter::{Kernel, Size};

/// Linear sRGB to CIE XYZ, from the primaries and the white of D65, as exact ratios
/// (the matrix of the papers' evaluator).
fn to_xyz() -> DMat3 {
    let row = |r: [f64; 3], over: f64| DVec3::from_array(r) / over;
    DMat3::from_cols(
        row([10_135_552.0, 8_788_810.0, 4_435_075.0], 24_577_794.0),
        row([2_613_072.0, 8_788_810.0, 887_015.0], 12_288_897.0),
        row([1_425_312.0, 8_788_810.0, 70_074_185.0], 73_733_382.0),
    )
    .transpose()
}

/// Linear sRGB to XYZ in units of the white's, so that white is (1, 1, 1).
fn to_relative_xyz() -> DMat3 {
    let matrix = to_xyz();
    DMat3::from_diagonal((matrix * DVec3::ONE).recip()) * matrix
}

/// A matrix in single precision, row by row.
type Rows = [[f32; 3]; 3];

fn rows(matrix: DMat3) -> Rows {
    matrix.transpose().to_cols_array_2d().map(|row| row.map(|v| v as f32))
}

#[inline]
fn times(rows: &Rows, v: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Calls `change` for the three values of each pixel.
fn change_pixels(planes: &mut Planes, change: impl Fn([f32; 3]) -> [f32; 3]) {
    let [a, b, c] = planes;
    for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
        [*a, *b, *c] = change([*a, *b, *c]);
    }
}

/// Linear RGB to relative luminance Y, X − Y and Y − Z, all relative to white: the
/// space YCxCz but for its factors (116, 500 and 200) and offset,
/// which linear filters of unit sum leave where they are.
pub(super) fn opponent(mut rgb: Planes) -> Planes {
    let matrix = rows(to_relative_xyz());
    change_pixels(&mut rgb, |v| {
        let [x, y, z] = times(&matrix, v);
        [y, x - y, y - z]
    });
    rgb
}

/// A channel's contrast sensitivity as a sum of Gaussians of the distance d in degrees:
/// Σ a √(π/b) exp(−π² d²/b) (table 1 of the paper: a and b).
const SENSITIVITY: [&[(f64, f64)]; 3] =
    [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

/// How far the filters reach: three standard deviations of the widest Gaussian.
const WIDEST: f64 = 0.04;

/// Exponent of colour distances.
const COLOUR_EXPONENT: f32 = 0.7;
/// Distances up to this share of the largest ...
const KNEE: f32 = 0.4;
/// ... take this share of the metric's range.
const KNEE_VALUE: f32 = 0.95;

/// The filters of the colour pipeline and the scale of its differences.
#[derive(Debug)]
pub(super) struct Contrast {
    /// For each channel the kernels whose results add up.
    kernels: [Vec<Kernel>; 3],
    to_rgb: Rows,
    to_xyz: Rows,
    /// The largest distance, green's to blue, raised to `COLOUR_EXPONENT`.
    largest: f32,
}

impl Contrast {
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        let matrix = to_relative_xyz();
        let to_xyz = rows(matrix);
        let green = hunt_lab(times(&to_xyz, [0.0, 1.0, 0.0]));
        let blue = hunt_lab(times(&to_xyz, [0.0, 0.0, 1.0]));
        Contrast {
            kernels: SENSITIVITY.map(|terms| kernels(terms, pixels_per_degree)),
            to_rgb: rows(matrix.inverse()),
            to_xyz,
            largest: power(hyab(green, blue), COLOUR_EXPONENT),
        }
    }

    /// What the eye resolves of [`opponent`] colours, as Hunt-adjusted CIELAB.
    pub(super) fn filtered_lab(&self, opponent: Planes, size: Size) -> Planes {
        let mut planes = [0, 1, 2].map(|c| {
            let filtered = self.kernels[c]
                .iter()
                .map(|k| k.along_columns(&k.along_rows(&opponent[c], size), size));
            filtered
                .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect())
                .unwrap_or_default()
        });
        change_pixels(&mut planes, |[y, x_y, y_z]| {
            // Filtering mixes colours that no display can show; those are clamped.
            let rgb = times(&self.to_rgb, [x_y + y, y, y - y_z]).map(|v| v.clamp(0.0, 1.0));
            hunt_lab(times(&self.to_xyz, rgb))
        });
        planes
    }

    /// The difference of two Hunt-adjusted colours, in [0, 1].
    #[inline]
    pub(super) fn difference(&self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let distance = hyab(a, b);
        if distance == 0.0 {
            return 0.0;
        }
        let share = power(distance, COLOUR_EXPONENT) / self.largest;
        if share < KNEE {
            share * (KNEE_VALUE / KNEE)
        } else {
            // Nothing is farther than green from blue but by rounding.
            (KNEE_VALUE + (share - KNEE) / (1.0 - KNEE) * (1.0 - KNEE_VALUE)).min(1.0)
        }
    }
}

/// Kernels of unit sum in two dimensions: each Gaussian is the product of two.
fn kernels(terms: &[(f64, f64)], pixels_per_degree: f64) -> Vec<Kernel> {
    use std::f64::consts::PI;
    let reach = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
    let half = |&(a, b): &(f64, f64)| -> Vec<f64> {
        let height = (a * (PI / b).sqrt()).sqrt();
        let value = |k: usize| {
            let degrees = k as f64 / pixels_per_degree;
            height * libm::exp(-PI * PI * degrees * degrees / b)
        };
        (0..=reach).map(value).collect()
    };
    let halves: Vec<Vec<f64>> = terms.iter().map(half).collect();
    let sum = |h: &Vec<f64>| 2.0 * h.iter().sum::<f64>() - h[0];
    let scale = halves.iter().map(|h| sum(h) * sum(h)).sum::<f64>().sqrt().recip();
    halves.iter().map(|h| Kernel::even(&h.iter().map(|v| v * scale).collect::<Vec<_>>())).collect()
}

/// CIELAB of XYZ relative to white, its a* and b* scaled by L*/100: after Hunt, the
/// darker a colour, the less colourful.
#[inline]
fn hunt_lab(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = xyz.map(|t| {
        if t > DELTA * DELTA * DELTA {
            libm::cbrtf(t)
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// A positive number to a power, to some 1e-6 of itself: half the time of the exact one,
/// in which most of a map's time would go.
#[inline]
pub(super) fn power(base: f32, exponent: f32) -> f32 {
    libm::exp2f(exponent * libm::log2f(base))
}

/// The distance HyAB (Abasi, Tehran and Fairchild 2019): of lightness and, apart from it,
/// of chroma.
#[inline]
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [l, m, n] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    l.abs() + (m * m + n * n).sqrt()
}
