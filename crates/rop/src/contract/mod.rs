//! The contract between a design and everything that replays, explains or counts it, and
//! what every design may use to fulfil it.
//!
//! Invariant: nothing here knows a kit, the replay or a design, and no two files need each
//! other.

pub(crate) mod blueprint;
pub mod colour;
pub(crate) mod contents;
pub(crate) mod design;
pub(crate) mod event;
pub(crate) mod frame;
pub(crate) mod info;
pub(crate) mod layout;
pub(crate) mod opacity;
pub mod over_opaque;
pub(crate) mod port;
pub(crate) mod primitive_depths;
pub(crate) mod promise;
pub(crate) mod promises;
pub(crate) mod samples;
pub(crate) mod shader;
pub(crate) mod tiled;
pub(crate) mod words;
