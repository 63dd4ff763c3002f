//! Parts of the report that is one HTML file.

pub mod packed;
pub mod viewer;
