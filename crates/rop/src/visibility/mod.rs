//! How much light reaches a depth: what is asked of a trace that was taken from a light.
//!
//! A light's trace is drawn like any other, and the pixels' state is kept (`map.rs`). A receiver
//! then looks up one pixel or several (`filter.rs`). Enderton et al. 2011, section 3.2, do so with
//! stochastic samples: `svis(z) = #{s : z ≤ z_s} / S` over the samples of the region. A design that
//! keeps layers or moments answers by these; `exact` by `Π (1 − α_i)` over what lies nearer.

mod filter;
mod map;
#[cfg(test)]
mod tests;

pub use filter::{Filter, Receiver, Taps};
pub use map::VisibilityMap;
