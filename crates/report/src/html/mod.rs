//! A study's results as one page: a single file that needs no network, for screen, phone
//! and paper.

mod about;
mod against;
mod choice;
mod convergence;
mod cost;
mod document;
mod error;
mod filters;
pub(crate) mod packed;
mod page;
mod parts;
mod perception;
mod reproduce;
#[cfg(test)]
mod tests;
pub(crate) mod verification;
pub(crate) mod viewer;
mod visibility;
pub(crate) mod words;

pub use choice::answer;
pub use document::Figure;
pub use page::{DesignText, Extras, Place, Section, page};
pub(crate) use parts::replay_command;
pub use words::grouped;
