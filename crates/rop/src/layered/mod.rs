//! The kit of the designs that keep layers: depth, colour and alpha of a few fragments.

pub(crate) mod bounded;
pub mod layers;
pub(crate) mod normalise;
