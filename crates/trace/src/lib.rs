//! Fragment traces of screendoor: the format, its streaming reader and writer, what is done to
//! whole traces, pictures, and
//! what all of it stands on (errors, parameters, randomness, files that are whole or not there).

#![warn(missing_docs)]

pub mod edit;
pub mod error;
pub mod output;
pub mod param;
pub mod picture;
pub mod random;
pub mod tile;
pub mod trace;
