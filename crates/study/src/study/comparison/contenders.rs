//! Who is compared: every design, and what Wyman's claim is about.

use serde::Serialize;

use screendoor_designs::{Configured, DESIGNS, Entry, REFERENCE, configure};
use screendoor_rop::Family;
use screendoor_trace::error::Result;
use screendoor_trace::param::Kind;

/// A design in the comparison: its settings for any count.
#[derive(Clone, Debug, Serialize)]
pub struct Contender {
    /// Name and settings without the count.
    pub label: String,
    /// Its family.
    pub family: Family,
    /// Whether the count is one of layers too.
    pub layered: bool,
    /// The design's name.
    name: &'static str,
    settings: Vec<(String, String)>,
    /// Parameters that follow the count, as (name, times the count).
    counted: Vec<(&'static str, u32)>,
    /// Whether the application must sort for it.
    pub sorted_by_application: bool,
}

/// Parameters whose every value makes a contender of its own: they name methods.
const METHODS: [&str; 4] = ["method", "normalise", "moments", "opacity"];

/// The contenders: every design of the registry with its defaults, and with each of
/// its methods.
pub fn contenders() -> Vec<Contender> {
    let mut list = Vec::new();
    for entry in DESIGNS.iter().filter(|e| e.info.name != REFERENCE) {
        list.push(Contender::of(entry, &[]));
        for param in entry.info.params.iter().filter(|p| METHODS.contains(&p.name)) {
            let Kind::Choice { options } = param.kind else { continue };
            for option in options.iter().filter(|o| o.name != param.default) {
                list.push(Contender::of(entry, &[(param.name, option.name)]));
            }
        }
        if entry.info.params.iter().any(|p| p.name == "mask") {
            list.push(Contender::of(entry, &[("mask", "naive")]));
        }
    }
    list
}

impl Contender {
    fn of(entry: &Entry, settings: &[(&str, &str)]) -> Self {
        let has = |name: &str| entry.info.params.iter().any(|p| p.name == name);
        let settings: Vec<(String, String)> =
            settings.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        // Wyman's figure 1: twice as many coverage bits as layers.
        let counted: Vec<(&str, u32)> =
            [("layers", 1), ("bits", 2)].into_iter().filter(|(name, _)| has(name)).collect();
        let shown: Vec<String> = settings.iter().map(|(k, v)| format!("{k}={v}")).collect();
        let separator = if shown.is_empty() { "" } else { ":" };
        Contender {
            label: format!("{}{separator}{}", entry.info.name, shown.join(",")),
            family: entry.info.family,
            layered: counted.iter().any(|(name, _)| *name == "layers"),
            name: entry.info.name,
            settings,
            counted,
            sorted_by_application: entry.asks_for_primitive_depths(),
        }
    }

    /// The design for `count` samples or layers.
    pub(super) fn at(&self, count: u32) -> Result<Configured> {
        let mut settings = self.settings.clone();
        let counted = |(name, times): &(&str, u32)| (name.to_string(), (times * count).to_string());
        settings.extend(self.counted.iter().map(counted));
        configure(self.name, &settings)
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

/// Whether Wyman's claim is about a contender at a count.
pub(super) fn claimed(contender: &Contender, count: u32) -> bool {
    let label = contender.label.as_str();
    let layered = label == SLAB_LIMIT || SLAB_CLAIM.iter().any(|[slab, _]| *slab == label);
    let rival = SLAB_CLAIM.iter().any(|[_, rival]| *rival == label);
    layered && count == SLAB_LAYERS || rival && SLAB_RIVALS.contains(&count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::comparison::COUNTS;

    #[test]
    fn the_claim_is_about_contenders_that_there_are() {
        let list = contenders();
        let counts = |label: &str| {
            let found = list.iter().find(|c| c.label == label).expect(label);
            COUNTS.into_iter().filter(|n| claimed(found, *n)).collect::<Vec<_>>()
        };
        for [slab, rival] in SLAB_CLAIM {
            assert_eq!(counts(slab), [SLAB_LAYERS]);
            assert_eq!(counts(rival), SLAB_RIVALS);
        }
        assert_eq!(counts(SLAB_LIMIT), [SLAB_LAYERS]);
        assert!(counts("mlab").is_empty());
    }

    #[test]
    fn every_design_is_a_contender_and_all_settings_resolve() {
        let list = contenders();
        for entry in DESIGNS.iter().filter(|e| e.info.name != REFERENCE) {
            assert!(list.iter().any(|c| c.label == entry.info.name));
        }
        for contender in &list {
            for count in COUNTS {
                contender.at(count).unwrap();
            }
        }
        assert!(list.len() > DESIGNS.len());
    }
}
