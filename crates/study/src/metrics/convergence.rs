//! How errors fall with the number of samples.

use serde::{Deserialize, Serialize};

use crate::metrics::{Estimate, student_t};

/// Errors up to this, in 8-bit units, are rounding: a design that has them is exact.
const ROUNDING: f64 = 1e-9;
/// Half the width of a normal distribution's 95 % interval, in deviations.
const NORMAL: f64 = 1.959_964;

/// A power law RMSE ≈ a·N^−p fitted to errors at several numbers of samples. Independent
/// samples have p = 1/2; stratified ones more (LK section 5).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Convergence {
    /// The exponent p, with a 95 % interval: the wider of two, of which one comes from the
    /// points' scatter about the line (Student's t with two degrees of freedom less than
    /// there are points), the other from the points' own intervals.
    pub exponent: Estimate,
    /// The RMSE that the law has at one sample, a, in the errors' units.
    pub at_one: f64,
    /// How much of the variance of ln RMSE the line explains, from 0 to 1; 1 where there
    /// is none.
    pub r_squared: f64,
    /// To how many points it is fitted.
    pub points: usize,
}

/// A point of the line: the logarithms, and the variance of the second.
struct Point {
    x: f64,
    y: f64,
    variance: f64,
}

impl Convergence {
    /// Fits the RMSE at each number of samples N by weighted least squares of ln RMSE on
    /// ln N.
    ///
    /// A point's weight is the inverse of its variance, which is taken from its interval
    /// as if that were normal (Student's are wider, so the fit's is rather too wide). A
    /// variance from a few runs is itself uncertain, so each is first averaged with the
    /// mean of all; where none has an interval all weigh the same.
    ///
    /// Points that are not finite or have no positive N are left out. `None` with fewer
    /// than three others, where all N are equal, or where an error is 0 but for rounding:
    /// an exact design has no exponent.
    pub fn fit(points: &[(f64, Estimate)]) -> Option<Self> {
        let usable = |(n, e): &&(f64, Estimate)| *n > 0.0 && n.is_finite() && e.value.is_finite();
        let usable: Vec<&(f64, Estimate)> = points.iter().filter(usable).collect();
        if usable.len() < 3 || usable.iter().any(|(_, e)| e.value <= ROUNDING) {
            return None;
        }
        let points: Vec<Point> = usable.into_iter().map(|(n, e)| point(*n, *e)).collect();
        let count = points.len() as f64;
        let pooled = points.iter().map(|p| p.variance).sum::<f64>() / count;
        let weight = |p: &Point| if pooled > 0.0 { 2.0 / (p.variance + pooled) } else { 1.0 };
        let weights: Vec<f64> = points.iter().map(weight).collect();

        let sum = |f: &dyn Fn(&Point) -> f64| -> f64 {
            points.iter().zip(&weights).map(|(p, w)| w * f(p)).sum()
        };
        let total = sum(&|_| 1.0);
        let (mean_x, mean_y) = (sum(&|p| p.x) / total, sum(&|p| p.y) / total);
        let square_x = sum(&|p| (p.x - mean_x).powi(2));
        let square_y = sum(&|p| (p.y - mean_y).powi(2));
        // Equal N leave only rounding.
        if square_x <= 1e-12 * total {
            return None;
        }
        let slope = sum(&|p| (p.x - mean_x) * (p.y - mean_y)) / square_x;
        let residual = sum(&|p| (p.y - mean_y - slope * (p.x - mean_x)).powi(2));

        let scatter = (residual / (count - 2.0) / square_x).sqrt();
        // The slope is a sum of the ln RMSE with these factors.
        let own = points.iter().zip(&weights);
        let own: f64 = own.map(|(p, w)| (w * (p.x - mean_x) / square_x).powi(2) * p.variance).sum();
        let half = (student_t(0.95, points.len() - 1) * scatter).max(NORMAL * own.sqrt());
        let value = -slope;
        let explained = 1.0 - residual / square_y;
        Some(Convergence {
            exponent: Estimate::around(value, half),
            at_one: libm::exp(mean_y - slope * mean_x),
            r_squared: if square_y > 1e-18 * total { explained.clamp(0.0, 1.0) } else { 1.0 },
            points: points.len(),
        })
    }
}

fn point(n: f64, e: Estimate) -> Point {
    // An RMSE's lower end can be 0 where its square's is negative; the upper end cannot.
    let half =
        if e.low > 0.0 { libm::log(e.high / e.low) / 2.0 } else { libm::log(e.high / e.value) };
    let deviation = if half.is_finite() { half / NORMAL } else { 0.0 };
    Point { x: libm::log(n), y: libm::log(e.value), variance: deviation * deviation }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::random::Stream;

    #[test]
    fn a_power_law_is_found() {
        let points =
            [1.0, 2.0, 4.0, 8.0, 64.0].map(|n: f64| (n, Estimate::exactly(12.0 * n.powf(-0.75))));
        let c = Convergence::fit(&points).unwrap();
        assert!((c.exponent.value - 0.75).abs() < 1e-12 && c.exponent.half_width() < 1e-6);
        assert!((c.at_one - 12.0).abs() < 1e-9);
        assert!((c.r_squared - 1.0).abs() < 1e-9);
        assert_eq!(c.points, 5);
        // Errors that do not fall.
        let c = Convergence::fit(&[1.0, 2.0, 4.0].map(|n| (n, Estimate::exactly(3.0)))).unwrap();
        assert!(c.exponent.value.abs() < 1e-12);
        assert_eq!(c.r_squared, 1.0);
    }

    /// y = 0, 1, 1 at x = 0, 1, 2: slope 1/2, residuals −1/6, 1/3, −1/6, r² = 3/4.
    #[test]
    fn scatter_widens_the_interval_by_students_t() {
        let points = [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0)]
            .map(|(x, y): (f64, f64)| (x.exp(), Estimate::exactly((-y).exp())));
        let c = Convergence::fit(&points).unwrap();
        assert!((c.exponent.value - 0.5).abs() < 1e-12);
        assert!((c.r_squared - 0.75).abs() < 1e-12);
        // t(1) = 12.7062 times √(1/6 / 2).
        assert!((c.exponent.half_width() - 12.706_2 / 12_f64.sqrt()).abs() < 1e-3, "{c:?}");
    }

    #[test]
    fn the_points_own_intervals_count_where_they_are_wider() {
        let points = [1.0, 2.0, 4.0, 8.0].map(|n: f64| {
            let value = n.powf(-0.5);
            (n, Estimate { value, low: value / 1.2, high: value * 1.2 })
        });
        let c = Convergence::fit(&points).unwrap();
        // x in steps of ln 2 about their mean: Σ(x − x̄)² = 5 ln²2.
        let expected = 1.2_f64.ln() / (5_f64.sqrt() * 2_f64.ln());
        assert!((c.exponent.half_width() / expected - 1.0).abs() < 1e-9, "{c:?}");
        // A point that is known badly hardly moves the line.
        let mut moved = points;
        moved[3].1 = Estimate { value: 2.0, low: 0.0, high: 2000.0 };
        let c = Convergence::fit(&moved).unwrap();
        let equal = Convergence::fit(&moved.map(|(n, e)| (n, Estimate::exactly(e.value)))).unwrap();
        assert!((c.exponent.value - 0.5).abs() < (equal.exponent.value - 0.5).abs() / 1.5, "{c:?}");
    }

    #[test]
    fn no_exponent_without_errors_or_points() {
        let law = [1.0, 2.0, 4.0].map(|n: f64| (n, Estimate::exactly(1.0 / n)));
        assert!(Convergence::fit(&law).is_some());
        assert_eq!(Convergence::fit(&law[..2]), None);
        for (place, bad) in [(0, 0.0), (1, 1e-13), (2, -1.0), (0, f64::NAN), (1, f64::INFINITY)] {
            let mut points = law;
            points[place].1 = Estimate::exactly(bad);
            assert_eq!(Convergence::fit(&points), None, "{bad}");
        }
        assert_eq!(Convergence::fit(&law.map(|(_, e)| (8.0, e))), None);
        assert_eq!(Convergence::fit(&law.map(|(n, e)| (-n, e))), None);
    }

    /// A thousand simulated studies of five numbers of samples and eight seeds each, with
    /// errors of unlike precision. The share of intervals that hold the exponent must be
    /// 0.95 at least, less 3.1 of its deviations of 0.0069 (a significance of 0.001).
    #[test]
    fn intervals_hold_the_exponent() {
        let mut random = Stream::new([0xc0_7e]);
        // A sum of 12 uniform numbers has a variance of 1.
        let mut normal = || (0..12).map(|_| f64::from(random.unit())).sum::<f64>() - 6.0;
        let studies = 1000;
        let mut held = 0;
        for _ in 0..studies {
            let points = [1.0, 2.0, 4.0, 8.0, 16.0].map(|n: f64| {
                let squares: Vec<f64> = (0..8)
                    .map(|_| (9.0 / n * (1.0 + 0.02 * n.sqrt() * normal())).max(0.0))
                    .collect();
                (n, Estimate::of(&squares).sqrt())
            });
            let e = Convergence::fit(&points).unwrap().exponent;
            held += usize::from(e.low <= 0.5 && 0.5 <= e.high);
        }
        let share = held as f64 / f64::from(studies);
        assert!(share > 0.95 - 3.1 * 0.0069, "{share}");
        // And they are no wider than they need be.
        assert!(share < 1.0, "{share}");
    }
}
