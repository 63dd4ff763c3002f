//! Errors as shares of the baseline's.

use crate::metrics::Estimate;
use crate::study::file::Study;
use crate::study::record::Record;
use crate::study::results::Results;

/// The sample count at which designs are compared, where the study has it.
const PREFERRED_COUNT: u32 = 8;

/// An RMSE below this, in 8-bit units, no 8-bit picture shows: 1/√12 is what rounding to
/// 8 bits makes itself. A mean of ratios takes it for this much: the logarithm of an
/// accidental 1e-12 on one scene would drown all others.
pub const ROUNDING: f64 = 0.288_675_134_594_812_9;

/// A design at a sample count.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RunName<'a> {
    /// The design as the study has it.
    pub series: &'a str,
    /// Samples per pixel.
    pub samples: u32,
}

/// The study's sample count nearest to 8, as a ratio; the smaller of two.
pub fn reference_count(study: &Study) -> u32 {
    let away = |n: &u32| (f64::from(*n) / f64::from(PREFERRED_COUNT)).ln().abs();
    let nearer = |a: &&u32, b: &&u32| away(a).total_cmp(&away(b)).then(a.cmp(b));
    study.samples.iter().min_by(nearer).copied().unwrap_or(PREFERRED_COUNT)
}

/// What errors are held against: the baseline at the reference count.
pub fn baseline(study: &Study) -> RunName<'_> {
    RunName { series: &study.baseline, samples: reference_count(study) }
}

/// A run's records on all of the study's scenes, in their order.
///
/// # Errors
/// The scenes without a record.
pub(crate) fn records_over_scenes<'a>(
    results: &'a Results,
    run: RunName<'_>,
) -> Result<Vec<&'a Record>, Vec<String>> {
    let (mut records, mut missing) = (Vec::new(), Vec::new());
    for scene in &results.study.scenes {
        match results.record(&scene.name, run.series, run.samples) {
            Some(record) => records.push(record),
            None => missing.push(scene.name.clone()),
        }
    }
    if missing.is_empty() && !records.is_empty() { Ok(records) } else { Err(missing) }
}

/// The RMSE over covered pixels of one run as a share of another's on a scene. The
/// interval carries both sides; a run's share of itself is 1 without any.
pub fn ratio_on(
    results: &Results,
    scene: &str,
    run: RunName<'_>,
    to: RunName<'_>,
) -> Option<Estimate> {
    let find = |r: RunName<'_>| results.record(scene, r.series, r.samples);
    let (own, other) = (find(run)?, find(to)?);
    Some(if run == to { Estimate::exactly(1.0) } else { shares(&[(own, other)]) })
}

/// The same over all scenes: the geometric mean of the scenes' shares. Their intervals'
/// half-widths, on a logarithmic scale, add in quadrature and are divided by the number
/// of scenes.
///
/// # Errors
/// The scenes on which either has no record.
pub fn ratio(
    results: &Results,
    run: RunName<'_>,
    to: RunName<'_>,
) -> Result<Estimate, Vec<String>> {
    match (records_over_scenes(results, run), records_over_scenes(results, to)) {
        (Ok(_), Ok(_)) if run == to => Ok(Estimate::exactly(1.0)),
        (Ok(own), Ok(other)) => Ok(shares(&own.into_iter().zip(other).collect::<Vec<_>>())),
        (own, other) => {
            // In the study's order, each once.
            let lacks = [own.err().unwrap_or_default(), other.err().unwrap_or_default()].concat();
            let names = results.study.scenes.iter().map(|s| s.name.clone());
            Err(names.filter(|name| lacks.contains(name)).collect())
        }
    }
}

/// [`ratio`] to the baseline.
///
/// # Errors
/// As [`ratio`].
pub fn relative(results: &Results, run: RunName<'_>) -> Result<Estimate, Vec<String>> {
    ratio(results, run, baseline(&results.study))
}

/// Whether the intervals of a run's errors say anything: those of a single seed do not,
/// where others would give another picture.
pub(crate) fn has_interval(results: &Results, run: RunName<'_>) -> bool {
    records_over_scenes(results, run)
        .is_ok_and(|records| records.iter().all(|r| r.seeds > 1 || !r.promises.seeded))
}

/// Geometric mean of one run's errors as shares of another's, pair by pair: an RMSE over covered
/// pixels below [`ROUNDING`] counts as that; without any error in any pair it is 0.
pub fn shares(pairs: &[(&Record, &Record)]) -> Estimate {
    if pairs.iter().all(|(own, _)| own.covered.rmse.high == 0.0) {
        return Estimate::exactly(0.0);
    }
    let (mut logs, mut square) = (0.0, 0.0);
    for (own, other) in pairs {
        let share = above_rounding(own.covered.rmse).ratio(above_rounding(other.covered.rmse));
        logs += share.value.ln();
        let half = (share.high / share.low).ln() / 2.0;
        square += half * half;
    }
    let scenes = pairs.len() as f64;
    let (value, half) = ((logs / scenes).exp(), square.sqrt() / scenes);
    Estimate { value, low: value * (-half).exp(), high: value * half.exp() }
}

fn above_rounding(e: Estimate) -> Estimate {
    let floor = |v: f64| v.max(ROUNDING);
    Estimate { value: floor(e.value), low: floor(e.low), high: floor(e.high) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::made_up::planted;

    fn run(series: &str, samples: u32) -> RunName<'_> {
        RunName { series, samples }
    }

    #[test]
    fn the_reference_count_is_8_or_the_nearest() {
        for (counts, nearest) in
            [(&[2, 8, 32][..], 8), (&[4, 16], 4), (&[1, 2], 2), (&[16, 64], 16), (&[4], 4)]
        {
            let study = planted(&["s"], counts, &[("a", &[Estimate::exactly(1.0)])]).study;
            assert_eq!(reference_count(&study), nearest, "{counts:?}");
        }
    }

    #[test]
    fn a_mean_over_scenes_is_geometric_and_carries_both_intervals() {
        let e = |value: f64, by: f64| Estimate { value, low: value / by, high: value * by };
        let results = planted(
            &["s", "t"],
            &[8],
            &[("a", &[e(4.0, 1.1), e(9.0, 1.1)]), ("b", &[e(2.0, 1.2), e(18.0, 1.2)])],
        );
        let overall = relative(&results, run("b", 8)).unwrap();
        assert!((overall.value - 1.0).abs() < 1e-12, "{overall:?}");
        let each = 1.1_f64.ln().hypot(1.2_f64.ln());
        let half = (2.0 * each * each).sqrt() / 2.0;
        assert!((overall.high.ln() - half).abs() < 1e-12, "{overall:?}");
        assert!((overall.low.ln() + half).abs() < 1e-12);
        assert_eq!(
            ratio_on(&results, "s", run("b", 8), baseline(&results.study)).unwrap().value,
            0.5
        );
        assert_eq!(relative(&results, run("a", 8)).unwrap(), Estimate::exactly(1.0));
    }

    #[test]
    fn a_missing_scene_is_named_and_never_a_zero() {
        let two = &[Estimate::exactly(4.0), Estimate::exactly(9.0)];
        let mut results = planted(&["s", "t"], &[8], &[("a", two), ("b", two)]);
        results.records.retain(|r| (r.series.as_str(), r.scene.as_str()) != ("b", "t"));
        assert_eq!(relative(&results, run("b", 8)), Err(vec!["t".to_string()]));
        assert_eq!(ratio_on(&results, "t", run("b", 8), baseline(&results.study)), None);
        // Without the baseline nothing is relative to it.
        results.records.retain(|r| (r.series.as_str(), r.scene.as_str()) != ("a", "s"));
        let both = vec!["s".to_string(), "t".to_string()];
        assert_eq!(relative(&results, run("b", 8)), Err(both));
    }

    #[test]
    fn no_error_on_one_scene_does_not_drown_the_others() {
        let results = planted(
            &["s", "t"],
            &[8],
            &[
                ("a", &[Estimate::exactly(1.0), Estimate::exactly(1.0)]),
                ("some", &[Estimate::exactly(0.0), Estimate::exactly(1.0)]),
                ("exact", &[Estimate::exactly(0.0), Estimate::exactly(0.0)]),
            ],
        );
        let some = relative(&results, run("some", 8)).unwrap();
        assert!((some.value - ROUNDING.sqrt()).abs() < 1e-12, "{some:?}");
        assert_eq!(relative(&results, run("exact", 8)).unwrap(), Estimate::exactly(0.0));
    }
}
