//! Who is dominated by whom.

use crate::metrics::Estimate;
use crate::study::analysis::cost::Cost;
use crate::study::analysis::kept::kept;
use crate::study::analysis::relative::{RunName, relative};
use crate::study::record::Kept;
use crate::study::results::Results;
use crate::study::throughput::Spread;

/// A run between its cost and its error.
#[derive(Clone, PartialEq, Debug)]
pub struct Point<'a> {
    /// The run.
    pub run: RunName<'a>,
    /// The record's name, where the point is of one scene.
    pub id: Option<&'a str>,
    /// The design's family.
    pub family: &'a str,
    /// What the design promises and keeps on all scenes.
    pub kept: Kept,
    /// Passes over the trace, on the scene that takes most.
    pub passes: u32,
    /// The cost.
    pub cost: Spread,
    /// The error: RMSE on a scene, and over all scenes relative to the baseline.
    pub error: Estimate,
    /// Whether no other point has less of one and no more of the other.
    pub front: bool,
}

/// All runs between costs and errors.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Points<'a> {
    /// Those that have both, designs in the study's order.
    pub known: Vec<Point<'a>>,
    /// The others, and why.
    pub absent: Vec<(RunName<'a>, String)>,
}

/// For each (cost, error), whether it lies on the Pareto front: no other is less in one
/// and not more in the other. Equal points do not dominate each other.
pub fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points.iter().map(|p| !points.iter().any(|other| beats(*other, *p))).collect()
}

/// Cost and error of every run on a scene, or over all of them where none is named.
pub fn points<'a>(results: &'a Results, scene: Option<&str>, cost: Cost) -> Points<'a> {
    let mut points = Points::default();
    for series in &results.study.designs {
        for samples in &results.study.samples {
            let run = RunName { series, samples: *samples };
            match point(results, scene, run, cost) {
                Ok(point) => points.known.push(point),
                Err(why) => points.absent.push((run, why)),
            }
        }
    }
    let pairs: Vec<(f64, f64)> =
        points.known.iter().map(|p| (p.cost.median, p.error.value)).collect();
    for (point, on) in points.known.iter_mut().zip(front(&pairs)) {
        point.front = on;
    }
    points
}

fn point<'a>(
    results: &'a Results,
    scene: Option<&str>,
    run: RunName<'a>,
    cost: Cost,
) -> Result<Point<'a>, String> {
    let on = |scene: &str| results.record(scene, run.series, run.samples);
    let (record, cost, error, passes) = match scene {
        Some(scene) => {
            let record = on(scene).ok_or("no result")?;
            (record, cost.of(record)?, record.covered.rmse, record.passes)
        }
        None => {
            let error = relative(results, run)
                .map_err(|scenes| format!("no result on {}", scenes.join(", ")))?;
            let records = results.study.scenes.iter().filter_map(|s| on(&s.name));
            let passes = records.map(|r| r.passes).max().unwrap_or(0);
            let first = results.study.scenes.iter().find_map(|s| on(&s.name));
            (first.ok_or("no result")?, cost.over_scenes(results, run)?, error, passes)
        }
    };
    let family = record.family.as_str();
    let kept = kept(results, run.series).ok_or("no result")?;
    let id = scene.map(|_| record.id.as_str());
    Ok(Point { run, id, family, kept, passes, cost, error, front: false })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::made_up::planted;

    #[test]
    fn a_dominated_point_is_found() {
        // The third is worse than the second in both, the fourth equals the first, the
        // fifth costs the same as the second and errs more.
        let points = [(1.0, 9.0), (2.0, 3.0), (3.0, 4.0), (1.0, 9.0), (2.0, 3.5), (8.0, 0.0)];
        assert_eq!(front(&points), [true, true, false, true, false, true]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn points_are_of_all_runs_or_say_why_not() {
        let mut results = planted(
            &["s", "t"],
            &[8],
            &[
                ("a", &[Estimate::exactly(4.0), Estimate::exactly(4.0)]),
                ("worse", &[Estimate::exactly(5.0), Estimate::exactly(5.0)]),
                ("grows", &[Estimate::exactly(1.0), Estimate::exactly(1.0)]),
                ("gone", &[Estimate::exactly(1.0), Estimate::exactly(1.0)]),
            ],
        );
        for r in results.records.iter_mut().filter(|r| r.series == "grows") {
            r.state_bits.unbounded = true;
        }
        results.records.retain(|r| r.series != "gone" || r.scene == "s");
        let all = points(&results, None, Cost::State);
        let known: Vec<_> = all.known.iter().map(|p| (p.run.series, p.front)).collect();
        assert_eq!(known, [("a", true), ("worse", false)]);
        let absent: Vec<_> = all.absent.iter().map(|(r, why)| (r.series, why.as_str())).collect();
        let why = [("grows", "its state grows with the fragments"), ("gone", "no result on t")];
        assert_eq!(absent, why);
        let on = points(&results, Some("s"), Cost::State);
        assert_eq!(on.known.len(), 3);
        assert!(on.known.iter().all(|p| p.id.is_some() && p.error.value > 0.0));
    }
}
