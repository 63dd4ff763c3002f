//! `screendoor scenes`.

use clap::Args;

use crate::cli::console::Console;
use crate::cli::designs::print_params;
use crate::error::Result;
use crate::scene::builtin::BUILTINS;

/// List the built-in scenes and their parameters
#[derive(Debug, Args)]
pub(super) struct Arguments {}

pub(super) fn run(_: &Arguments, console: &Console) -> Result<()> {
    for scene in BUILTINS {
        console.print(format_args!("builtin:{}\n  {}", scene.name, scene.summary))?;
        print_params(scene.params, console)?;
    }
    Ok(())
}
