//! The contract between a design and everything that replays, explains or counts it, and
//! what every design may use to fulfil it.
//!
//! Invariant: nothing here knows a kit, the replay or a design, and no two files need each
//! other.

pub mod blueprint;
pub mod colour;
pub mod contents;
pub mod design;
pub mod event;
pub mod frame;
pub mod info;
pub mod layout;
pub mod opacity;
pub mod over_opaque;
pub mod port;
pub mod primitive_depths;
pub mod promise;
pub mod promises;
pub mod samples;
pub mod shader;
pub mod tiled;
pub mod words;
