//! Measured records as documents and pictures. Knows nothing of how runs are made.

#![warn(missing_docs)]

pub mod chart;
pub mod document;
pub mod export;
mod filters;
mod folder;
pub mod html;
mod montage;
mod results;
mod stability;
mod visibility;

pub use folder::{About, PAGE, write_report};
pub use results::{
    Chapter, FIGURES, FIGURES_FOLDER, Figure, PARTS, chapter, check_marks, in_short, results,
};
pub use stability::stability;
