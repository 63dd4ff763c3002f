//! The kit of the designs that keep layers: depth, colour and alpha of a few fragments.

pub(crate) mod bounded;
pub(crate) mod in_lanes;
pub mod lanes;
pub mod layers;
pub(crate) mod normalise;
