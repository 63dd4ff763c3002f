//! Stochastic transparency with any choice of samples: the single pass, and the
//! methods of several passes of Enderton, Sintorn, Shirley and Luebke (TVCG 2011).
//!
//! A design says which samples a fragment may write ([`Sampler`]); what becomes of
//! them is the same for all ([`Method`]). With the methods of several passes,
//! opaque fragments are drawn first and apart, and what lies behind is dimmed
//! sample by sample (section 3.5).

mod passes;
mod pixel;
mod port;
mod sampler;

pub use passes::Methods;
pub(crate) use passes::Pass;
pub use pixel::MethodsPixel;
pub(crate) use pixel::MethodsSums;
pub use port::{port, port_of_single_pass};
pub use sampler::{Round, Sampler};

use crate::contract::colour::ColourStore;
use crate::contract::frame::Frame;
use crate::contract::over_opaque::{self, Opaque, OverOpaque};
use crate::contract::promise::Promise;
use crate::contract::promises::{OpaquePromise, OrderPromise, Promises};
use crate::stochastic::depth_bits;
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};

screendoor_trace::options! {
    /// What is made of the chosen samples. E: Enderton et al. 2011.
    pub enum Method {
        Basic = "basic": "one pass, the mean of the samples (E section 3.1)",
        AlphaCorrection = "alpha-correction": "scaled to the total alpha, for one more pass (E 3.3)",
        Depth = "depth": "all fragments weighed by a stochastic visibility: two passes (E 3.4)",
        DepthCorrection = "depth-correction": "the same, scaled to the total alpha: three passes (E 3.4)",
    }
}

impl Method {
    /// Whether the picture is scaled to the total alpha.
    pub fn corrected(self) -> bool {
        matches!(self, Method::AlphaCorrection | Method::DepthCorrection)
    }

    /// Whether samples hold depths alone, and colours are added up in a pass of their own.
    pub(crate) fn depth_based(self) -> bool {
        matches!(self, Method::Depth | Method::DepthCorrection)
    }
}

screendoor_trace::options! {
    /// How often the samples are drawn.
    pub enum Rounds {
        One = "1": "once",
        Two = "2": "twice the samples for twice the passes",
        Four = "4": "four times",
        Eight = "8": "eight times",
    }
}

screendoor_trace::options! {
    /// Over what masks are stratified where samples are drawn several times.
    pub enum Strata {
        Round = "round": "within each round: other seeds",
        All = "all": "over all rounds together (E section 4, footnote 4)",
    }
}

/// The parameters that all samplers with several methods share.
pub const METHOD: Typed<Method> =
    Typed::choice("method", "basic", "what is made of the chosen samples");
/// As [`METHOD`].
pub const ROUNDS: Typed<Rounds> =
    Typed::choice("rounds", "1", "how often the samples are drawn (E section 3.5)");
/// As [`METHOD`].
pub const STRATA: Typed<Strata> =
    Typed::choice("strata", "round", "over what several rounds are stratified");
/// As [`METHOD`].
pub const OPAQUE: Typed<Opaque> = Typed::choice(
    over_opaque::PARAM.param.name,
    "first",
    "how opaque fragments are drawn; method basic draws them like all others",
);
/// What the suite should try of them together.
pub const COMBINATIONS: [&str; 4] = [
    "method=alpha-correction,rounds=2,opaque=together",
    "method=depth,rounds=4,strata=all",
    "method=depth-correction,rounds=2,opaque=together",
    "rounds=2,strata=all",
];

/// A stochastic design: a sampler and what is made of its choice.
pub type Stochastic<S, const N: usize> = OverOpaque<Methods<S, N>, N>;

/// The design of `sampler` with the shared parameters in `values`.
///
/// # Errors
/// None today; designs pass it on from their own [`crate::Blueprint::at`].
pub fn with_methods<S: Sampler<N>, const N: usize>(
    values: &Values,
    frame: &Frame,
    sampler: S,
) -> Result<Stochastic<S, N>> {
    let method = values.get(METHOD);
    let rounds = 1 << values.get(ROUNDS) as u32;
    let strata = values.get(STRATA);
    let opaque = match method {
        Method::Basic => Opaque::Together,
        _ => over_opaque::of(values),
    };
    let depth_bits = depth_bits::of(values);
    let colour = ColourStore::of(values, frame);
    let methods =
        Methods { frame: frame.clone(), sampler, depth_bits, colour, method, rounds, strata };
    Ok(OverOpaque::new(values, frame, opaque, methods))
}

/// The design of `sampler` in a single pass, without the shared parameters but for
/// the width of the depth buffer.
pub fn single_pass<S: Sampler<N>, const N: usize>(
    values: &Values,
    frame: &Frame,
    sampler: S,
) -> Stochastic<S, N> {
    let methods = Methods {
        frame: frame.clone(),
        sampler,
        depth_bits: depth_bits::of(values),
        colour: ColourStore::of(values, frame),
        method: Method::Basic,
        rounds: 1,
        strata: Strata::Round,
    };
    OverOpaque::new(values, frame, Opaque::Together, methods)
}

/// What a design promises with the shared parameters, of which the single pass
/// promises `basic` with [`Strata::Round`].
///
/// Correction divides by what chance has found: biased (E sections 4.1 and 4.2).
/// It is consistent for given alphas: what E calls inconsistent is an alpha that
/// falls as 1/S. The visibilities of the depth-based methods count fragments at
/// equal depths as in front of each other: where they overlap, no number of samples or
/// seeds brings those methods to the exact picture.
pub fn promises(values: &Values, basic: Promises) -> Promises {
    let method: Method = values.get(METHOD);
    let together = over_opaque::of(values) == Opaque::Together;
    let sums = method != Method::Basic;
    // The strongest promise that the method leaves of the samples' own. Opaque fragments
    // that are drawn first lie behind transparent ones of their depth that came earlier.
    let by_depth = match method.depth_based() || (sums && !together) {
        true => Promise::DistinctDepths,
        false => Promise::Always,
    };
    Promises {
        unbiased: if method.corrected() { Promise::Never } else { basic.unbiased.min(by_depth) },
        consistent: basic.consistent.min(by_depth),
        order: match basic.order {
            OrderPromise::Independent if sums => OrderPromise::UpToRounding,
            order => order,
        },
        // By their depths alone, opaque fragments at equal depths are all seen.
        exact_opaque: match method.depth_based() && together {
            true => OpaquePromise::Never,
            false => basic.exact_opaque,
        },
        ..basic
    }
}

/// Whether these settings draw opaque fragments in a pass of their own.
pub fn draws_opaque_first(values: &Values) -> bool {
    let has = |name| values.iter().any(|(param, _)| param == name);
    has(over_opaque::PARAM.param.name)
        && over_opaque::of(values) == Opaque::First
        && !(has(METHOD.param.name) && values.get(METHOD) == Method::Basic)
}

/// Whether several rounds are stratified together.
pub fn strata_over_rounds(values: &Values) -> bool {
    values.get(STRATA) == Strata::All && values.get(ROUNDS) != Rounds::One
}
