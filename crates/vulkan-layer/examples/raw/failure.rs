//! Why a case gave no picture.

use std::fmt;
use std::panic::Location;

use ash::vk;

pub(crate) type Result<T> = std::result::Result<T, Failure>;

pub(crate) enum Failure {
    /// The device cannot do it: no fault of anybody's.
    Unsupported(String),
    Failed(String),
}

impl Failure {
    pub(crate) fn unsupported(why: impl fmt::Display) -> Self {
        Self::Unsupported(why.to_string())
    }
}

impl From<vk::Result> for Failure {
    #[track_caller]
    fn from(result: vk::Result) -> Self {
        Self::Failed(format!("{result} at {}", Location::caller()))
    }
}

impl From<std::io::Error> for Failure {
    #[track_caller]
    fn from(error: std::io::Error) -> Self {
        Self::Failed(format!("{error} at {}", Location::caller()))
    }
}
