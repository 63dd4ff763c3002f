//! The stochastic family in vector instructions: the same bits as the plain text,
//! sooner.
//!
//! A pixel's samples lie in lanes ([`Lanes`]); a fragment is tested, numbered and
//! written in a few dozen instructions without a branch that chance decides. The
//! plain text ([`tracked`](crate::rop::tracked), [`stochastic`](crate::rop::stochastic))
//! stays what a design *is*: what is rare here (depths that reach beyond the depth
//! range, very steep planes) and what is done once a pixel (the resolve of several
//! passes) goes through it.

mod engine;
mod kernel;
mod lanes;
mod rank;
mod references;
mod state;
mod tally;
mod tracked;

#[cfg(test)]
pub use engine::Flaw;
pub use engine::{FastEngine, FastSampler, Loaded, Offered, Row};
pub use lanes::{Count, Lanes, Width, levels};
pub use rank::{in_sample_order, picked, ranks, ranks_of_any, ranks_of_distinct};
pub use references::{Base, FastReferences, HashBy, Limit, Numbered, PublishedHash, below};
pub use state::FastTile;
pub use tally::Tally;
pub use tracked::{FastTracked, Given, Published, Rules, is_published};
