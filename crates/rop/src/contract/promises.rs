//! What a design promises of its pictures.

use serde::Serialize;

use crate::contract::promise::Promise;

/// What a design promises; the conformance suite holds it to each of these, and
/// shows that what is not promised does not hold. Promised is what holds for traces as
/// `TRACE_FORMAT.md` asks for them: no primitive covers a sample twice.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct Promises {
    /// Its expectation over seeds is the exact picture.
    pub unbiased: Promise,
    /// Its picture approaches the exact one as samples increase.
    pub consistent: Promise,
    /// What the order does in which fragments arrive, where those that share a depth at a
    /// sample stay in sequence: of them the last lies in front in the exact picture, too.
    pub order: OrderPromise,
    /// Where the picture of opaque fragments is the exact one.
    pub exact_opaque: OpaquePromise,
    /// The picture depends on the seed.
    pub seeded: bool,
}

impl Promises {
    /// Nothing is promised.
    pub const NONE: Promises = Promises {
        unbiased: Promise::Never,
        consistent: Promise::Never,
        order: OrderPromise::Dependent,
        exact_opaque: OpaquePromise::Never,
        seeded: false,
    };

    /// Whether the picture is the same in any order, but for rounding.
    pub fn same_picture(&self) -> bool {
        self.order != OrderPromise::Dependent
    }

    /// Where the expectation over seeds is the same in any order: where each picture is, and
    /// where it is the exact picture. The noise about it may still differ: with
    /// `lk:track=covered` near to far has less than far to near.
    pub fn same_expectation(&self) -> Promise {
        if self.same_picture() { Promise::Always } else { self.unbiased }
    }

    /// What is promised, in words.
    pub fn words(&self) -> Vec<String> {
        let order = match self.order {
            OrderPromise::Independent => "the same picture in any order",
            OrderPromise::UpToRounding => "the same picture in any order up to rounding",
            OrderPromise::AmplifiedRounding => {
                "the same picture in any order up to amplified rounding"
            }
            OrderPromise::Dependent => "",
        };
        let expectation = match self.same_picture() {
            true => Promise::Never,
            false => self.same_expectation(),
        };
        let opaque = match self.exact_opaque {
            OpaquePromise::Always => "exact where opaque",
            OpaquePromise::WholePixels => "exact where opaque over whole pixels",
            OpaquePromise::Never => "",
        };
        let list = [
            (self.unbiased, "unbiased"),
            (self.consistent, "consistent"),
            (Promise::always_if(!order.is_empty()), order),
            (expectation, "the same expectation in any order"),
            (Promise::always_if(!opaque.is_empty()), opaque),
            (Promise::always_if(!self.seeded), "the same for every seed"),
        ];
        list.iter().filter_map(|(promise, what)| promise.words(what)).collect()
    }
}

/// What the order does in which fragments arrive ([`Promises::order`]).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderPromise {
    /// It changes no bit.
    Independent,
    /// It changes in which order sums are rounded and nothing else.
    UpToRounding,
    /// So does this; but what the design makes of its sums amplifies their rounding,
    /// where depths lie close together until it shows.
    AmplifiedRounding,
    /// It changes the picture.
    Dependent,
}

/// Where the picture of opaque fragments (alpha 1) is the exact one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OpaquePromise {
    /// However they share pixels.
    Always,
    /// Where each covers whole pixels.
    WholePixels,
    /// Not even there.
    Never,
}
