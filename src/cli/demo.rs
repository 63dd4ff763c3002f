//! `screendoor demo`.
use crate::cli::console::Console;
use crate::error::Result;
use clap::Args;
/// Do the main job on a built-in scene
#[derive(Debug, Args)]
pub(super) struct Arguments {}
pub(super) fn run(_: &Arguments, _: &Console) -> Result<()> {
    Ok(())
}
