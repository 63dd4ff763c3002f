//! Under what condition a promise of a design holds.

use serde::{Deserialize, Serialize};

/// Whether a promise holds, and where. From the weakest to the strongest.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Promise {
    /// It is not given.
    Never,
    /// It holds where no two fragments that cover a sample have the same depth, there or at
    /// the pixel's centre: where [`tied_fragments`](screendoor_trace::trace::tied_fragments) finds none.
    DistinctDepths,
    /// It holds for every trace.
    Always,
}

impl Promise {
    /// [`Promise::Always`] if `holds`, or [`Promise::Never`].
    pub fn always_if(holds: bool) -> Self {
        if holds { Promise::Always } else { Promise::Never }
    }

    /// Whether it holds for a trace of which `tied` fragments share a depth with another
    /// one at a sample.
    pub fn holds(self, tied: u64) -> bool {
        match self {
            Promise::Never => false,
            Promise::DistinctDepths => tied == 0,
            Promise::Always => true,
        }
    }

    /// What is promised, in words; `None` where it is not.
    pub fn words(self, what: &str) -> Option<String> {
        match self {
            Promise::Never => None,
            Promise::DistinctDepths => Some(format!("{what} where depths differ")),
            Promise::Always => Some(what.to_string()),
        }
    }
}
