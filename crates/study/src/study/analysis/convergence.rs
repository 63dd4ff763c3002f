//! How errors fall as samples increase.

use crate::metrics::{Convergence, Estimate};
use crate::study::results::Results;

/// The power law through a design's errors on a scene; `None` where they give none.
pub fn convergence(results: &Results, scene: &str, series: &str) -> Option<Convergence> {
    let record = |samples: u32| results.record(scene, series, samples);
    let point = |n: &u32| Some((f64::from(*n), record(*n)?.covered.rmse));
    let points: Vec<(f64, Estimate)> = results.study.samples.iter().filter_map(point).collect();
    Convergence::fit(&points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::made_up::planted;

    #[test]
    fn a_power_law_is_found() {
        let counts = [2, 4, 8, 16];
        let mut results = planted(&["s"], &counts, &[("a", &[Estimate::exactly(1.0)])]);
        for record in &mut results.records {
            record.covered.rmse = Estimate::exactly(20.0 * f64::from(record.samples).powf(-0.75));
        }
        let fitted = convergence(&results, "s", "a").unwrap();
        assert!((fitted.exponent.value - 0.75).abs() < 1e-12, "{fitted:?}");
        assert!((fitted.at_one - 20.0).abs() < 1e-9 && fitted.r_squared > 0.999_999);
        assert_eq!(fitted.points, 4);
        results.records.truncate(2);
        assert_eq!(convergence(&results, "s", "a"), None);
        for record in &mut results.records {
            record.covered.rmse = Estimate::exactly(0.0);
        }
        assert_eq!(convergence(&results, "s", "a"), None);
    }
}
