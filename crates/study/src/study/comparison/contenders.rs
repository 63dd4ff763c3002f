//! Who is compared: the designs of the study file, and what Wyman's claim is about.

use serde::Serialize;

use crate::study::record::Record;
use screendoor_designs::{DESIGNS, configure};
use screendoor_trace::error::Result;

/// A design in the comparison: its settings for any count.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Contender {
    /// Name and settings without the count.
    pub label: String,
    /// The design as the study has it.
    pub series: String,
    /// Whether the application must sort for it.
    pub sorted_by_application: bool,
}

impl Contender {
    /// The contender of a study's design: what follows the count is no part of its label.
    ///
    /// # Errors
    /// As [`configure`].
    pub(super) fn of(series: &str) -> Result<Self> {
        let (name, settings) = series.split_once(':').unwrap_or((series, ""));
        let own = settings.split(',').filter(|s| !s.is_empty() && !s.contains('{'));
        let own = own.collect::<Vec<_>>().join(",");
        let separator = if own.is_empty() { "" } else { ":" };
        let label = format!("{name}{separator}{own}");
        let name = configure(&label, &[])?.info().name;
        let entry = DESIGNS.iter().find(|entry| entry.info.name == name);
        Ok(Contender {
            sorted_by_application: entry.is_some_and(|e| e.asks_for_primitive_depths()),
            series: series.to_string(),
            label,
        })
    }

    /// Whether a record is its.
    pub fn owns(&self, record: &Record) -> bool {
        record.series == self.series
    }
}

/// What Wyman's claim is about: SLAB with each normalisation, and stochastic transparency
/// with the same.
pub const SLAB_CLAIM: [[&str; 2]; 5] = [
    ["slab", "enderton:method=depth-correction"],
    ["slab:opacity=discrete", "enderton:method=depth-correction"],
    ["slab:normalise=none", "enderton"],
    ["slab:normalise=alpha", "enderton:method=alpha-correction"],
    ["slab:normalise=depth", "enderton:method=depth"],
];
/// Layers of `slab` in Wyman's claim.
pub const SLAB_LAYERS: u32 = 8;
/// Samples of stochastic transparency that it is held against there.
pub const SLAB_RIVALS: [u32; 3] = [8, 16, 32];
/// What `slab` becomes with ever more bits.
pub const SLAB_LIMIT: &str = "kbuffer";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::comparison::{COUNTS, slab};
    use crate::study::file::Study;
    use crate::study::publications::experiment::{parse, studies};
    use screendoor_designs::{Entry, REFERENCE};
    use screendoor_trace::param::Kind;

    /// Parameters whose every value makes a contender of its own: they name methods.
    const METHODS: [&str; 5] = ["method", "normalise", "moments", "opacity", "per"];

    /// Whether a design has a parameter that can be any of the counts.
    fn counts(entry: &Entry, name: &str) -> bool {
        let param = entry.info.params.iter().find(|p| p.name == name);
        let reaches = |max: i64| COUNTS.iter().all(|count| i64::from(*count) <= max);
        param.is_some_and(|p| matches!(p.kind, Kind::Integer { max, .. } if reaches(max)))
    }

    /// A design of the registry with settings, and what follows the count.
    fn series(entry: &Entry, settings: &[(&str, &str)]) -> String {
        // Wyman's figure 1: twice as many coverage bits as layers.
        let counted = [("layers", "{n}"), ("bits", "{2n}")];
        let counted = counted.into_iter().filter(|(name, _)| counts(entry, name));
        let all = settings.iter().copied().chain(counted);
        let list: Vec<String> = all.map(|(name, value)| format!("{name}={value}")).collect();
        let separator = if list.is_empty() { "" } else { ":" };
        format!("{}{separator}{}", entry.info.name, list.join(","))
    }

    /// Every design of the registry with its defaults, and with each of its methods.
    fn of_the_registry() -> Vec<String> {
        let mut list = Vec::new();
        for entry in DESIGNS.iter().filter(|e| e.info.name != REFERENCE) {
            list.push(series(entry, &[]));
            for param in entry.info.params.iter().filter(|p| METHODS.contains(&p.name)) {
                let Kind::Choice { options } = param.kind else { continue };
                let others = options.iter().filter(|o| o.name != param.default);
                list.extend(others.map(|o| series(entry, &[(param.name, o.name)])));
            }
            // A few layers where there cannot be as many as samples.
            let has = |name: &str| entry.info.params.iter().any(|p| p.name == name);
            if has("layers") && !counts(entry, "layers") {
                list.push(series(entry, &[("layers", "4")]));
            }
            if has("mask") {
                list.push(series(entry, &[("mask", "naive")]));
            }
        }
        list
    }

    #[test]
    fn the_study_file_compares_every_design_of_the_registry_at_every_count() {
        let study = parse(studies::COMPARISON).unwrap();
        assert_eq!(study.designs, of_the_registry(), "write them into comparison.toml");
        assert_eq!(study.samples, COUNTS);
    }

    #[test]
    fn the_claim_is_about_contenders_that_there_are() {
        let [of_slab, rivals] = slab().unwrap();
        let labels = |study: &Study| -> Vec<String> {
            study.designs.iter().map(|d| Contender::of(d).unwrap().label).collect()
        };
        let (slabs, rival_labels) = (labels(&of_slab), labels(&rivals));
        for [slab, rival] in SLAB_CLAIM {
            assert!(slabs.iter().any(|l| l == slab) && rival_labels.iter().any(|l| l == rival));
        }
        assert!(slabs.iter().any(|l| l == SLAB_LIMIT));
        assert_eq!((of_slab.samples, rivals.samples), (vec![SLAB_LAYERS], SLAB_RIVALS.to_vec()));
        // What is measured for both is one contender.
        let all = parse(studies::COMPARISON).unwrap().designs;
        assert!(of_slab.designs.iter().chain(&rivals.designs).all(|d| all.contains(d)));
    }

    #[test]
    fn what_follows_the_count_is_no_part_of_a_label() {
        let of = |series: &str| Contender::of(series).unwrap();
        assert_eq!(of("slab:opacity=discrete,layers={n},bits={2n}").label, "slab:opacity=discrete");
        assert_eq!(of("kbuffer:layers={n}").label, "kbuffer");
        assert!(of("sorted-blend").sorted_by_application && !of("blend").sorted_by_application);
        assert!(Contender::of("nothing").is_err());
    }
}
