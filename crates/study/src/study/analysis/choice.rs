//! Which design should be built: the least error that meets a need within a budget.

use crate::metrics::Estimate;
use crate::study::analysis::cost::Cost;
use crate::study::analysis::kept::kept;
use crate::study::analysis::relative::{
    RunName, has_interval, ratio, records_over_scenes, relative,
};
use crate::study::record::Kept;
use crate::study::results::Results;

screendoor_trace::options! {
    /// What a design must promise.
    pub enum Need {
        Any = "any design": "whatever it promises",
        Unbiased = "unbiased": "its expectation is the exact picture",
        SameExpectation = "same mean in any order": "the order of fragments does not change its expectation",
        SamePicture = "same picture in any order": "the order of fragments changes nothing but rounding",
        OnePass = "one pass": "the scene is drawn once",
        All = "all at once": "unbiased, the same mean in any order of fragments, and one pass",
    }
}

/// How much state it may have per pixel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Budget {
    /// So many bytes at most.
    Bytes(u32),
    /// Any fixed amount.
    Bounded,
    /// Even state that grows with the fragments.
    Any,
}

/// The budgets that are answered for.
pub const BUDGETS: [Budget; 6] = [
    Budget::Bytes(32),
    Budget::Bytes(64),
    Budget::Bytes(128),
    Budget::Bytes(256),
    Budget::Bounded,
    Budget::Any,
];

/// A run that has results on all scenes.
#[derive(Clone, PartialEq, Debug)]
pub struct Candidate<'a> {
    /// The run.
    pub run: RunName<'a>,
    /// The design at this sample count.
    pub design: &'a str,
    /// What it promises and keeps on all scenes.
    pub kept: Kept,
    /// Error relative to the baseline over all scenes.
    pub error: Estimate,
    /// Bytes of state per pixel; `None` where it grows.
    pub state: Option<f64>,
    /// Passes over the trace, on the scene that takes most.
    pub passes: u32,
}

/// What the seeds show of the difference between the best and the runner-up.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Separation {
    /// There is no other design.
    Alone,
    /// The best has less: its share of the runner-up's error, its interval below 1.
    Apart(Estimate),
    /// The interval holds 1.
    NoDifference(Estimate),
    /// One seed gives no interval.
    OneSeed,
}

/// The answer to a need and a budget.
#[derive(Clone, PartialEq, Debug)]
pub struct Answer<'a> {
    /// What is needed.
    pub need: Need,
    /// Within which state.
    pub budget: Budget,
    /// The least error; `None` where nothing meets the need.
    pub best: Option<Candidate<'a>>,
    /// The least error of another design.
    pub runner_up: Option<Candidate<'a>>,
    /// Whether the two differ.
    pub separation: Separation,
}

impl Need {
    fn met(self, c: &Candidate<'_>) -> bool {
        match self {
            Need::Any => true,
            Need::Unbiased => c.kept.unbiased,
            Need::SameExpectation => c.kept.same_expectation,
            Need::SamePicture => c.kept.same_picture,
            Need::OnePass => c.passes <= 1,
            Need::All => c.kept.unbiased && c.kept.same_expectation && c.passes <= 1,
        }
    }
}

impl Budget {
    fn holds(self, c: &Candidate<'_>) -> bool {
        match self {
            Budget::Bytes(most) => c.state.is_some_and(|bytes| bytes <= f64::from(most)),
            Budget::Bounded => c.state.is_some(),
            Budget::Any => true,
        }
    }
}

/// Every run that can be chosen: those with results on all scenes, designs in the study's
/// order.
pub fn candidates(results: &Results) -> Vec<Candidate<'_>> {
    let study = &results.study;
    let runs = study.designs.iter().flat_map(|series| {
        study.samples.iter().map(move |samples| RunName { series, samples: *samples })
    });
    runs.filter_map(|run| {
        let records = records_over_scenes(results, run).ok()?;
        let first = records.first()?;
        Some(Candidate {
            run,
            design: &first.design,
            kept: kept(results, run.series)?,
            error: relative(results, run).ok()?,
            state: Cost::State.over_scenes(results, run).ok().map(|s| s.median),
            passes: records.iter().map(|r| r.passes).max()?,
        })
    })
    .collect()
}

/// The answer to one question.
pub fn answer<'a>(
    results: &Results,
    candidates: &[Candidate<'a>],
    need: Need,
    budget: Budget,
) -> Answer<'a> {
    let fits = |c: &&Candidate<'a>| need.met(c) && budget.holds(c);
    // Of equal errors the one with less state, then the study's first.
    let least = |a: &&Candidate<'a>, b: &&Candidate<'a>| {
        let state = |c: &Candidate<'_>| c.state.unwrap_or(f64::INFINITY);
        a.error.value.total_cmp(&b.error.value).then(state(a).total_cmp(&state(b)))
    };
    let best = candidates.iter().filter(fits).min_by(least).cloned();
    let other = |c: &&Candidate<'a>| best.as_ref().is_some_and(|b| b.run.series != c.run.series);
    let runner_up = candidates.iter().filter(fits).filter(other).min_by(least).cloned();
    let separation = match (&best, &runner_up) {
        (Some(best), Some(second)) => separation(results, best.run, second.run),
        _ => Separation::Alone,
    };
    Answer { need, budget, best, runner_up, separation }
}

/// The answers to all needs and budgets.
pub fn answers(results: &Results) -> Vec<Answer<'_>> {
    use screendoor_trace::param::Options;
    let candidates = candidates(results);
    BUDGETS
        .iter()
        .flat_map(|budget| Need::ALL.iter().map(|need| (*need, *budget)))
        .map(|(need, budget)| answer(results, &candidates, need, budget))
        .collect()
}

/// The two held against each other directly: their shares of the baseline's error would
/// carry its scatter twice.
fn separation(results: &Results, best: RunName<'_>, second: RunName<'_>) -> Separation {
    if !(has_interval(results, best) && has_interval(results, second)) {
        return Separation::OneSeed;
    }
    match ratio(results, best, second) {
        Ok(share) if share.high < 1.0 => Separation::Apart(share),
        Ok(share) => Separation::NoDifference(share),
        Err(_) => Separation::Alone,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::made_up::planted;
    use screendoor_rop::Promise;
    use screendoor_trace::param::Options;

    fn near(value: f64) -> Estimate {
        Estimate { value, low: value * 0.98, high: value * 1.02 }
    }

    fn ask(results: &Results, need: Need, budget: Budget) -> (Option<String>, Separation) {
        let all = candidates(results);
        let answer = answer(results, &all, need, budget);
        (answer.best.map(|b| b.run.series.to_string()), answer.separation)
    }

    fn study() -> Results {
        let mut results = planted(
            &["s"],
            &[8],
            &[
                ("base", &[near(4.0)]),
                ("same", &[near(3.99)]),
                ("large", &[near(2.0)]),
                ("exact", &[Estimate::exactly(0.0)]),
            ],
        );
        for r in &mut results.records {
            r.state_bits.samples = if r.series == "large" { 8 * 100 } else { 8 * 40 };
            r.promises.unbiased = Promise::always_if(r.series == "base" || r.series == "same");
            r.state_bits.unbounded = r.series == "exact";
        }
        results
    }

    #[test]
    fn the_least_error_within_the_budget_wins() {
        let results = study();
        let (best, apart) = ask(&results, Need::Any, Budget::Bytes(128));
        assert_eq!(best.as_deref(), Some("large"));
        assert!(matches!(apart, Separation::Apart(e) if e.high < 1.0), "{apart:?}");
        let (best, tie) = ask(&results, Need::Any, Budget::Bytes(64));
        assert_eq!(best.as_deref(), Some("same"));
        assert!(matches!(tie, Separation::NoDifference(_)), "{tie:?}");
        assert_eq!(ask(&results, Need::Any, Budget::Any).0.as_deref(), Some("exact"));
        assert_eq!(ask(&results, Need::Any, Budget::Bytes(32)), (None, Separation::Alone));
        assert_eq!(ask(&results, Need::Unbiased, Budget::Any).0.as_deref(), Some("same"));
        assert_eq!(answers(&results).len(), BUDGETS.len() * Need::ALL.len());
    }

    #[test]
    fn a_promise_for_distinct_depths_counts_where_no_scene_has_equal_ones() {
        let mut results =
            planted(&["s", "t"], &[8], &[("base", &[near(4.0); 2]), ("by depth", &[near(2.0); 2])]);
        for r in results.records.iter_mut().filter(|r| r.series == "by depth") {
            r.promises.unbiased = Promise::DistinctDepths;
            (r.promises.same_picture, r.promises.same_expectation) =
                (false, Promise::DistinctDepths);
        }
        let needs = [Need::Unbiased, Need::SameExpectation, Need::SamePicture, Need::All];
        let best = |results: &Results| {
            needs.map(|need| ask(results, need, Budget::Bounded).0.unwrap_or_default())
        };
        assert_eq!(best(&results), ["by depth", "by depth", "base", "by depth"]);
        // Equal depths on one of the scenes.
        results.records[3].tied_fragments = 1;
        assert_eq!(results.records[3].series, "by depth");
        assert_eq!(best(&results), ["base"; 4]);
        assert_eq!(ask(&results, Need::Any, Budget::Bounded).0.as_deref(), Some("by depth"));
    }

    #[test]
    fn one_seed_separates_nothing_and_a_missing_scene_is_no_candidate() {
        let mut results = study();
        for r in &mut results.records {
            r.seeds = 1;
        }
        assert_eq!(ask(&results, Need::Any, Budget::Bounded).1, Separation::OneSeed);
        results.records.retain(|r| r.series != "large");
        assert!(candidates(&results).iter().all(|c| c.run.series != "large"));
    }
}
