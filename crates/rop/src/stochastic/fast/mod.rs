//! The stochastic family in vector instructions: the same bits as the plain text,
//! sooner.
//!
//! A pixel's samples lie in lanes ([`Lanes`]); a fragment is tested, numbered and
//! written in a few dozen instructions without a branch that chance decides. The
//! plain text ([`tracked`](crate::tracked), [`stochastic`](crate::stochastic))
//! stays what a design *is*: what is rare here (depths that reach beyond the depth
//! range, very steep planes) and what is done once a pixel (the resolve of several
//! passes) goes through it.

mod abreast;
mod comb;
mod engine;
mod kernel;
mod limit;
mod rank;
mod references;
mod sampler;
mod state;
mod tally;
#[cfg(test)]
mod tests;
mod tracked;
mod twin;

pub use crate::lanes::{Count, Lanes, Width, levels};
pub use abreast::{
    Abreast, Counted, Met, NumberedAbreast, OneByOne, Ranks, STRIDE, Source, bit, exchanged_teeth,
    gather, hashed_on, left_by, mixed, white,
};
pub use comb::teeth;
pub use limit::{Limit, below};
pub use rank::{in_sample_order, picked, ranks, ranks_of_any, ranks_of_distinct};
pub use references::{Base, FastReferences, HashBy, Numbered, PublishedHash};
pub use sampler::{FastSampler, Loaded, Offered, Row};
pub use state::FastTile;
pub use tally::Tally;
pub use tracked::{FastTracked, Parameterised, Published, Rules, is_published};
pub use twin::FastEngine;
#[cfg(test)]
use twin::Flaw;
