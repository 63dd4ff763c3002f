//! How errors fall as samples increase.

use crate::metrics::Estimate;
use crate::study::results::Results;

/// A power law through a design's errors: RMSE ≈ `at_one` · N^−`exponent`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fitted {
    /// The exponent.
    pub exponent: Estimate,
    /// The law's error at one sample.
    pub at_one: f64,
    /// The share of the logarithms' variance that it explains.
    pub r_squared: f64,
    /// How many sample counts it goes through.
    pub points: usize,
}

/// The fit through a design's errors on a scene; `None` of fewer than three sample counts
/// with an error.
pub fn convergence(results: &Results, scene: &str, series: &str) -> Option<Fitted> {
    let points: Vec<(f64, Estimate)> = results
        .study
        .samples
        .iter()
        .filter_map(|n| Some((f64::from(*n), results.record(scene, series, *n)?.covered.rmse)))
        .collect();
    fit(&points)
}

/// The one place that fits.
fn fit(points: &[(f64, Estimate)]) -> Option<Fitted> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(_, e)| e.value > 0.0)
        .map(|(n, e)| (n.ln(), e.value.ln()))
        .collect();
    let count = logs.len() as f64;
    if logs.len() < 3 {
        return None;
    }
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let sum = |of: &dyn Fn(f64, f64) -> f64| {
        logs.iter().map(|(x, y)| of(x - mx, y - my)).sum::<f64>()
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    if xx == 0.0 {
        return None;
    }
    let slope = xy / xx;
    let left = (yy - slope * xy).max(0.0);
    let half = crate::metrics::student_t(0.95, logs.len() - 1)
        * (left / (count - 2.0) / xx).sqrt();
    Some(Fitted {
        exponent: Estimate { value: -slope, low: -slope - half, high: -slope + half },
        at_one: (my - slope * mx).exp(),
        r_squared: if yy > 0.0 { 1.0 - left / yy } else { 1.0 },
        points: logs.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::made_up::{exactly, planted};

    #[test]
    fn a_power_law_is_found() {
        let counts = [2, 4, 8, 16];
        let mut results = planted(&["s"], &counts, &[("a", &[exactly(1.0)])]);
        for record in &mut results.records {
            record.covered.rmse = exactly(20.0 * f64::from(record.samples).powf(-0.75));
        }
        let fitted = convergence(&results, "s", "a").unwrap();
        assert!((fitted.exponent.value - 0.75).abs() < 1e-12, "{fitted:?}");
        assert!((fitted.at_one - 20.0).abs() < 1e-9 && fitted.r_squared > 0.999_999);
        assert_eq!(fitted.points, 4);
        results.records.truncate(2);
        assert_eq!(convergence(&results, "s", "a"), None);
        for record in &mut results.records {
            record.covered.rmse = exactly(0.0);
        }
        assert_eq!(convergence(&results, "s", "a"), None);
    }
}
