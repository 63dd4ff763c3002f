//! What a listing says about a design.

use serde::Serialize;

use screendoor_trace::param::Param;

screendoor_trace::options! {
    /// How designs are grouped in listings.
    pub enum Family {
        Reference = "reference": "the answer that others are measured against",
        Stochastic = "stochastic": "random coverage of samples, or random choice of layers",
        Layered = "layered": "a bounded number of layers per pixel, in the order of their depths",
        Blended = "blended": "sums over all fragments, or blending in the order in which they come",
    }
}

/// What a listing says about a design.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Info {
    /// Its name, as in `--design NAME`.
    pub name: &'static str,
    /// Its family.
    pub family: Family,
    /// What it does, in a line.
    pub summary: &'static str,
    /// Where it was published.
    pub citation: &'static str,
    /// Its parameters.
    pub params: &'static [Param],
    /// Settings, as `a=1,b=2`, that the conformance suite tries beside each parameter
    /// changed alone: where parameters work upon each other.
    pub combinations: &'static [&'static str],
}
