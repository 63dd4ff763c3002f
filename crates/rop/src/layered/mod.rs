//! The kit of the designs that keep layers: depth, colour and alpha of a few fragments.

pub mod bounded;
pub mod layers;
pub mod normalise;
