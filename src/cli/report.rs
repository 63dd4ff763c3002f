//! `screendoor report`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::console::Console;
use crate::cli::study::{Place, measured, reported};
use crate::error::Result;
use crate::study::file::Study;
use crate::study::run::{Shard, Store};

/// Which design should I build? Measure the default study on the built-in scenes and write
/// its report; with a folder of results, write that one's report again
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A folder with a study's results
    folder: Option<PathBuf>,
    /// Where the default study's results and report go
    #[arg(
        long,
        short,
        default_value = "screendoor-report",
        value_name = "FOLDER",
        conflicts_with = "folder"
    )]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    if let Some(folder) = &arguments.folder {
        return reported(&Store::open(folder)?, None, console).map(|_| ());
    }
    let store = Store::begin(&arguments.output, &Study::preset()?)?;
    let place = Place {
        base: Path::new(""),
        shard: Shard::WHOLE,
        adapter: None,
        command: format!("screendoor report -o {}", arguments.output.display()),
    };
    measured(&store, place, console)
}
