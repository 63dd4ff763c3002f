//! Results as files that other programs read: JSON lines, CSV, Arrow and Markdown.
//!
//! Each is a pure function of the results. `docs/STUDIES.md` says what every column is.

mod arrow;
mod derived;
mod markdown;
mod table;
#[cfg(test)]
mod tests;
mod text;
mod tree;

pub use arrow::arrow;
pub use derived::{DERIVED, Derived};
pub use markdown::markdown;
pub use text::{csv, json_lines};
