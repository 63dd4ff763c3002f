//! `screendoor report`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::console::Console;
use crate::cli::files::JsonArgument;
use crate::cli::kind::{Kind, check_input};
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
    #[command(flatten)]
    json: JsonArgument,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    if let Some(folder) = &arguments.folder {
        check_input(folder, Kind::Folder)?;
        let store = Store::open(folder)?;
        return reported(&store, None, arguments.json.open()?, console).map(|_| ());
    }
    let place = Place {
        base: Path::new(""),
        shard: Shard::WHOLE,
        adapter: None,
        json: &arguments.json,
        command: format!("screendoor report -o {}", arguments.output.display()),
    };
    measured(&arguments.output, &Study::preset()?, place, console)
}
