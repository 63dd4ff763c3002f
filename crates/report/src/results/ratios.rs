//! A ratio on every scene, and on which of them a rule holds: what a sentence about scenes
//! is made of.

use crate::document::code;
use screendoor_study::metrics::Estimate;

/// Whether an estimate lies below a bound by more than its interval.
pub(super) fn below(e: Estimate, bound: f64) -> bool {
    e.high < bound
}

/// The same above it.
pub(super) fn above(e: Estimate, bound: f64) -> bool {
    e.low > bound
}

/// A number on each of several scenes.
#[derive(Clone, Debug, Default)]
pub(super) struct OnScenes(pub Vec<(String, Estimate)>);

impl OnScenes {
    /// Those that are known: a ratio of two errors of 0 is not.
    fn known(&self) -> impl Iterator<Item = &(String, Estimate)> {
        self.0.iter().filter(|(_, e)| e.value.is_finite() && e.value > 0.0)
    }

    /// Their geometric mean.
    pub(super) fn mean(&self) -> f64 {
        let logs: f64 = self.known().map(|(_, e)| e.value.ln()).sum();
        (logs / self.known().count().max(1) as f64).exp()
    }

    /// The least and the greatest, with the scenes that have them.
    pub(super) fn range(&self) -> String {
        let by = |a: &&(String, Estimate), b: &&(String, Estimate)| a.1.value.total_cmp(&b.1.value);
        let ends = self.known().min_by(by).zip(self.known().max_by(by));
        ends.map_or("not measured".to_string(), |((low_name, low), (high_name, high))| {
            let [low_name, high_name] = [low_name, high_name].map(|name| code(name));
            format!("{:.2} ({low_name}) to {:.2} ({high_name})", low.value, high.value)
        })
    }

    /// How many lie below a bound by more than their interval.
    pub(super) fn below(&self, bound: f64) -> usize {
        self.0.iter().filter(|(_, e)| below(*e, bound)).count()
    }

    /// The same above it.
    pub(super) fn above(&self, bound: f64) -> usize {
        self.0.iter().filter(|(_, e)| above(*e, bound)).count()
    }

    /// On which scenes a rule holds.
    pub(super) fn holding(&self, rule: impl Fn(Estimate) -> bool) -> Holding {
        holding(self.0.iter().map(|(name, e)| (name.as_str(), rule(*e))))
    }
}

/// On which scenes a rule holds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Holding {
    /// One entry a scene.
    pub each: Vec<bool>,
    /// Where it does not.
    pub but: Vec<String>,
}

/// On which of the named scenes a rule holds.
pub(super) fn holding<'a>(scenes: impl Iterator<Item = (&'a str, bool)>) -> Holding {
    let (mut each, mut but) = (Vec::new(), Vec::new());
    for (name, holds) in scenes {
        each.push(holds);
        if !holds {
            but.push(code(name));
        }
    }
    Holding { each, but }
}

impl Holding {
    /// In words: 'on all 9 scenes', 'on 7 of 9 scenes (not on `oak`, `smoke`)', 'on none of
    /// 9 scenes'.
    pub(super) fn words(&self) -> String {
        let (all, but) = (self.each.len(), self.but.len());
        match but {
            _ if all == 0 => "on no scene that was measured".to_string(),
            0 if all == 1 => "on the one scene".to_string(),
            0 => format!("on all {all} scenes"),
            _ if but == all => format!("on none of {all} scenes"),
            _ => format!("on {} of {all} scenes (not on {})", all - but, self.but.join(", ")),
        }
    }

    /// Whether it holds everywhere.
    pub(super) fn everywhere(&self) -> bool {
        !self.each.is_empty() && self.but.is_empty()
    }
}

/// Whether something holds, in a word.
pub(super) fn yes(holds: bool) -> &'static str {
    if holds { "yes" } else { "no" }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(value: f64) -> Estimate {
        Estimate::around(value, 0.01)
    }

    #[test]
    fn sentences_name_the_scenes_on_which_a_rule_does_not_hold() {
        let three = [("a", 0.5), ("b", 1.0), ("c", 2.0)].map(|(n, v)| (n.to_string(), at(v)));
        let list = OnScenes(three.to_vec());
        assert_eq!(list.range(), "0.50 (`a`) to 2.00 (`c`)");
        assert!((list.mean() - 1.0).abs() < 1e-12);
        assert_eq!((list.below(1.0), list.above(1.0)), (1, 1));
        assert_eq!(list.holding(|e| e.value < 1.5).words(), "on 2 of 3 scenes (not on `c`)");
        assert_eq!(list.holding(|e| e.value < 3.0).words(), "on all 3 scenes");
        assert!(list.holding(|e| e.value < 3.0).everywhere());
        assert_eq!(list.holding(|e| e.value > 3.0).words(), "on none of 3 scenes");
        // A scene without errors has no ratio, and takes no part in means.
        let nothing = Estimate { value: f64::NAN, low: 0.0, high: f64::INFINITY };
        let more = OnScenes([list.0.as_slice(), &[("d".to_string(), nothing)]].concat());
        assert_eq!((more.range(), more.mean()), (list.range(), list.mean()));
        let none = OnScenes::default();
        assert_eq!(none.range(), "not measured");
        assert!(!none.holding(|_| true).everywhere());
    }
}
