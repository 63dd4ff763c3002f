//! Transmittance from moments: a measure on [−1, 1] is known by its first few power
//! moments, and what of it lies before a point is estimated from these (the Hamburger
//! moment problem).
//!
//! Of all measures with the moments b_0 … b_2n, one has the point z among n + 1 points
//! of support (Akhiezer, The Classical Moment Problem, 1965). With the Hankel matrix
//! B_ij = b_(i+j) and v(x) = (1, x, … x^n), its other points are the roots of
//! K(x) = v(z)ᵀ B⁻¹ v(x), and the mass at each of its points is 1 / v(x)ᵀ B⁻¹ v(x).
//! No measure with these moments has less mass before z than the points before z
//! have together, nor more than these and z itself.
//!
//! Moments are summed in single precision, as a render target holds them. They are
//! evaluated in double precision, so that what is seen is the method and its state
//! and not one way to round on.

mod lanes;
mod newton;

use arrayvec::ArrayVec;

pub use lanes::{Factors, OfMoments};

screendoor_trace::options! {
    /// How many moments beside the zeroth are kept.
    pub enum MomentCount {
        Four = "4": "up to 2 layers apart",
        Six = "6": "up to 3",
        Eight = "8": "up to 4",
    }
}

impl MomentCount {
    /// The number.
    pub fn count(self) -> usize {
        match self {
            MomentCount::Four => 4,
            MomentCount::Six => 6,
            MomentCount::Eight => 8,
        }
    }

    /// Moments drawn towards a measure of no extremes, and how far they are, so that
    /// rounding leaves a measure that exists: the bias and the even moments b_2, b_4, …
    /// for single precision. The moments are those of the code that Münstermann et al.
    /// published. The biases are those of public ports of it, which for 4 moments refer
    /// to the publication's supplement.
    fn bias(self) -> (f64, &'static [f64]) {
        match self {
            MomentCount::Four => (5e-7, &[0.375, 0.375]),
            MomentCount::Six => (5e-6, &[0.48, 0.451, 0.45]),
            MomentCount::Eight => (5e-5, &[0.75, 0.676_666_67, 0.63, 0.600_303_03]),
        }
    }

    /// How far moments are drawn with a bias of so many units, and towards which.
    fn pull(self, bias: f64) -> (f64, [f64; MOST_MOMENTS]) {
        let (unit, even) = self.bias();
        let mut towards = [0.0; MOST_MOMENTS];
        for (k, moment) in even.iter().enumerate() {
            towards[2 * k + 2] = *moment;
        }
        ((bias * unit).min(1.0), towards)
    }
}

/// The most moments, and the largest degree of K.
const MOST: usize = 8;
const DEGREE: usize = MOST / 2;

/// As many sums are kept, whatever the number of moments.
pub const MOST_MOMENTS: usize = MOST + 1;

/// Sums of absorbance, times the powers of the depth at which it lies.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Moments([f32; MOST_MOMENTS]);

impl Moments {
    /// Adds `absorbance` (the negative logarithm of a transmittance) at depth `z` in
    /// [−1, 1].
    #[inline]
    pub fn add(&mut self, count: MomentCount, absorbance: f64, z: f64) {
        let mut term = absorbance;
        for sum in &mut self.0[..=count.count()] {
            *sum += term as f32;
            term *= z;
        }
    }

    /// All absorbance together.
    #[inline]
    pub fn total(&self) -> f64 {
        f64::from(self.0[0])
    }

    /// They, the zeroth first.
    pub fn sums(&self) -> [f32; MOST_MOMENTS] {
        self.0
    }

    /// Of such sums.
    pub fn of(sums: [f32; MOST_MOMENTS]) -> Self {
        Moments(sums)
    }

    /// The transmittance of what lies before `z`, and of the share `overestimation` of
    /// what may lie at `z`. `bias` counts in units of the publication's.
    pub fn transmittance(&self, count: MomentCount, z: f64, bias: f64, overestimation: f64) -> f64 {
        let total = self.total();
        if total <= 0.0 {
            return 1.0;
        }
        let (pull, towards) = count.pull(bias);
        let mut b = [1.0; MOST_MOMENTS];
        for (k, (b, sum)) in b.iter_mut().zip(self.0).enumerate().skip(1).take(count.count()) {
            *b = (1.0 - pull) * f64::from(sum) / total + pull * towards[k];
        }
        libm::exp(-total * share_before(&b[..=count.count()], z, overestimation))
    }
}

/// The share of a measure with the normalised moments `b` (b_0 = 1; 4, 6 or 8 more)
/// that lies before `z`, and the share `overestimation` of what may lie at `z`.
fn share_before(b: &[f64], z: f64, overestimation: f64) -> f64 {
    match b.len() {
        5 => share_of_degree::<2>(b, z, overestimation),
        7 => share_of_degree::<3>(b, z, overestimation),
        _ => share_of_degree::<4>(b, z, overestimation),
    }
}

/// The same where K is of degree `D`, which is known beforehand, so that loops over its
/// coefficients are none.
fn share_of_degree<const D: usize>(b: &[f64], z: f64, overestimation: f64) -> f64 {
    let hankel = Hankel::<D>::factor(b);
    let (kernel, at_z) = hankel.kernel(z);
    let before: f64 = roots::<D>(&kernel, -REACH, z).iter().map(|x| hankel.mass(*x)).sum();
    let share = before + overestimation * at_z;
    // Numbers beyond all range, from moments that no measure has, say nothing.
    if share.is_finite() { share.clamp(0.0, 1.0) } else { overestimation }
}

/// Mass that lies further out than this is below REACH^-2n.
const REACH: f64 = 100.0;

/// A coefficient for each power up to the degree, and nothing beyond.
type Polynomial = [f64; DEGREE + 1];

/// The Hankel matrix as L D Lᵀ, L with a unit diagonal.
struct Hankel<const D: usize> {
    l: [Polynomial; DEGREE + 1],
    d: Polynomial,
}

/// A pivot of a measure with too few points of support is 0, or what rounding makes
/// of it. With this in its place the kernel's roots are those points still.
const LEAST_PIVOT: f64 = 1e-12;

impl<const D: usize> Hankel<D> {
    #[inline]
    fn factor(b: &[f64]) -> Self {
        let mut hankel = Hankel { l: [[0.0; DEGREE + 1]; DEGREE + 1], d: [0.0; DEGREE + 1] };
        for j in 0..=D {
            for i in j..=D {
                let known: f64 =
                    (0..j).map(|k| hankel.l[i][k] * hankel.l[j][k] * hankel.d[k]).sum();
                let rest = b[i + j] - known;
                if i == j {
                    hankel.d[j] = rest.max(LEAST_PIVOT);
                }
                hankel.l[i][j] = if i == j { 1.0 } else { rest / hankel.d[j] };
            }
        }
        hankel
    }

    /// L⁻¹ v(x): the orthogonal polynomials at x.
    #[inline]
    fn orthogonal(&self, x: f64) -> Polynomial {
        let mut y = [0.0; DEGREE + 1];
        let mut power = 1.0;
        for i in 0..=D {
            y[i] = power - (0..i).map(|k| y[k] * self.l[i][k]).sum::<f64>();
            power *= x;
        }
        y
    }

    /// 1 / v(x)ᵀ B⁻¹ v(x): the most mass that can lie at x.
    #[inline]
    fn mass(&self, x: f64) -> f64 {
        let y = self.orthogonal(x);
        1.0 / (0..=D).map(|i| y[i] * y[i] / self.d[i]).sum::<f64>()
    }

    /// The coefficients of K for `z`, and the most mass that can lie there.
    #[inline]
    fn kernel(&self, z: f64) -> (Polynomial, f64) {
        let y = self.orthogonal(z);
        let mut q = [0.0; DEGREE + 1];
        for i in 0..=D {
            q[i] = y[i] / self.d[i];
        }
        let inverse: f64 = (0..=D).map(|i| y[i] * q[i]).sum();
        for i in (0..=D).rev() {
            q[i] -= (i + 1..=D).map(|k| self.l[k][i] * q[k]).sum::<f64>();
        }
        (q, 1.0 / inverse)
    }
}

/// The roots of a polynomial of degree `D`, all of whose roots are real, between `low` and
/// `high`: between two neighbouring roots of its derivative there is one or none.
#[inline]
fn roots<const D: usize>(p: &Polynomial, low: f64, high: f64) -> ArrayVec<f64, DEGREE> {
    // The polynomial and its derivatives, down to a constant.
    let mut chain = [*p; DEGREE + 1];
    for k in 1..=D {
        for i in 0..=D - k {
            chain[k][i] = (i + 1) as f64 * chain[k - 1][i + 1];
        }
    }
    let mut turns = ArrayVec::<f64, DEGREE>::new();
    for k in (0..D).rev() {
        let (p, derivative) = (&chain[k], &chain[k + 1]);
        let mut found = ArrayVec::new();
        let mut start = low;
        for end in turns.iter().copied().chain([high]) {
            found.extend(match D - k {
                1 => root_between::<1>(p, derivative, start, end),
                2 => root_between::<2>(p, derivative, start, end),
                3 => root_between::<3>(p, derivative, start, end),
                _ => root_between::<4>(p, derivative, start, end),
            });
            start = end;
        }
        turns = found;
    }
    turns
}

/// The value at `x` of a polynomial of degree `D`.
#[inline]
fn evaluate<const D: usize>(p: &Polynomial, x: f64) -> f64 {
    (0..D).rev().fold(p[D], |sum, i| sum * x + p[i])
}

/// The root of `p`, of degree `D`, between two points between which it is monotone, if it has
/// one there: Newton's method within an interval that shrinks.
#[inline]
fn root_between<const D: usize>(
    p: &Polynomial,
    derivative: &Polynomial,
    mut low: f64,
    mut high: f64,
) -> Option<f64> {
    let slope = |x: f64| (0..D - 1).rev().fold(derivative[D - 1], |sum, i| sum * x + derivative[i]);
    let rises = evaluate::<D>(p, high) > 0.0;
    if (evaluate::<D>(p, low) > 0.0) == rises {
        return None;
    }
    let mut x = 0.5 * (low + high);
    for _ in 0..80 {
        let value = evaluate::<D>(p, x);
        if (value > 0.0) == rises {
            high = x;
        } else {
            low = x;
        }
        let newton = x - value / slope(x);
        // At an end, too: what does not move any more has arrived there.
        let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() <= 1e-14 * (1.0 + x.abs()) {
            break;
        }
        x = next;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::param::Options as _;
    use screendoor_trace::random::Stream;

    /// Normalised moments of `(depth, mass)` layers.
    fn moments(layers: &[(f64, f64)], count: usize) -> Vec<f64> {
        let total: f64 = layers.iter().map(|l| l.1).sum();
        (0..=count as i32)
            .map(|k| layers.iter().map(|(z, m)| m * z.powi(k)).sum::<f64>() / total)
            .collect()
    }

    fn share_by_hand(layers: &[(f64, f64)], z: f64) -> f64 {
        let total: f64 = layers.iter().map(|l| l.1).sum();
        layers.iter().filter(|l| l.0 < z).map(|l| l.1).sum::<f64>() / total
    }

    #[test]
    fn few_layers_are_found_exactly_between_and_at_them() {
        let mut random = Stream::new([6]);
        for count in [4, 6, 8] {
            for trial in 0..300 {
                let n = 1 + random.below(count as u32 / 2);
                // Apart from each other: 2/9 of the range at least.
                let mut places = [-0.9, -0.5, 0.0, 0.4, 0.85];
                random.shuffle(&mut places);
                let mut layers = Vec::new();
                for place in &places[..n as usize] {
                    let jitter = f64::from(random.range(-0.08, 0.08));
                    layers.push((place + jitter, f64::from(random.range(0.1, 3.0))));
                }
                let b = moments(&layers, count);
                let at = layers.iter().map(|l| l.0);
                let between = layers.iter().flat_map(|l| [l.0 - 0.06, l.0 + 0.06]);
                for z in at.chain(between).chain([-1.0, 1.0]) {
                    let found = share_before(&b, z, 0.0);
                    let error = found - share_by_hand(&layers, z);
                    assert!(error.abs() < 2e-3, "{count}, {trial}: {layers:?} at {z}: {error}");
                }
            }
        }
    }

    #[test]
    fn transmittance_falls_with_depth_and_is_never_out_of_range() {
        let mut random = Stream::new([7]);
        for count in MomentCount::ALL {
            for (bias, layers, spread) in
                [(1.0, 1, 1.0), (1.0, 3, 1.0), (1.0, 40, 1.0), (1.0, 40, 1e-3), (0.0, 5, 1e-6)]
            {
                let mut sums = Moments::default();
                for _ in 0..layers {
                    let z = spread * f64::from(random.range(-1.0, 1.0));
                    sums.add(*count, f64::from(random.range(0.01, 1.0)), z);
                }
                let mut last = 1.0;
                for i in 0..=1000 {
                    let z = i as f64 / 500.0 - 1.0;
                    let t = sums.transmittance(*count, z, bias, 0.25);
                    assert!((0.0..=1.0).contains(&t), "{count:?} {t}");
                    // Without bias, rounded moments need not be those of any measure.
                    assert!(bias == 0.0 || t <= last + 1e-3, "{count:?} {layers} {z}: {last} {t}");
                    last = t;
                }
            }
        }
    }

    #[test]
    fn more_moments_come_nearer() {
        let mut random = Stream::new([8]);
        let mut errors = [0.0; 3];
        for _ in 0..200 {
            let layers: Vec<(f64, f64)> = (0..12)
                .map(|_| (f64::from(random.range(-1.0, 1.0)), f64::from(random.range(0.05, 0.6))))
                .collect();
            let total: f64 = layers.iter().map(|l| l.1).sum();
            for (count, error) in MomentCount::ALL.iter().zip(&mut errors) {
                let mut sums = Moments::default();
                layers.iter().for_each(|(z, a)| sums.add(*count, *a, *z));
                for i in 0..100 {
                    let z = i as f64 / 50.0 - 0.99;
                    let exact = (-total * share_by_hand(&layers, z)).exp();
                    // Half of what may lie at z: between the bounds.
                    *error += (sums.transmittance(*count, z, 1.0, 0.5) - exact).powi(2);
                }
            }
        }
        assert!(errors[2] < 0.8 * errors[1] && errors[1] < 0.8 * errors[0], "{errors:?}");
    }

    #[test]
    fn damaged_sums_give_numbers() {
        for value in [0.0, f32::MIN_POSITIVE, 1e-40, 1.0, f32::MAX, f32::INFINITY, f32::NAN, -1.0] {
            for other in [0.0, 1e-40, -1.0, f32::MAX, f32::NAN] {
                let mut sums = Moments([other; MOST + 1]);
                sums.0[0] = value;
                for count in MomentCount::ALL {
                    let t = sums.transmittance(*count, 0.5, 1.0, 0.25);
                    assert!((0.0..=1.0).contains(&t) || value.is_nan(), "{value} {other}: {t}");
                }
            }
        }
    }

    #[test]
    fn roots_are_found_wherever_they_lie() {
        // (x + 90)(x + 1)(x − 0.25)(x − 0.5), and the same without the first.
        let cubic = [0.125, -0.625, 0.25, 1.0, 0.0];
        let quartic = [11.25, -56.125, 21.875, 90.25, 1.0];
        let found = [roots::<4>(&quartic, -REACH, 0.4), roots::<3>(&cubic, -REACH, 0.4)];
        for (found, expected) in found.into_iter().zip([&[-90.0, -1.0, 0.25][..], &[-1.0, 0.25]]) {
            assert_eq!(found.len(), expected.len());
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        }
        assert_eq!(roots::<2>(&[0.0; 5], -1.0, 1.0).len(), 0);
    }
}
