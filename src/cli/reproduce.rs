//! `screendoor reproduce`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::console::Console;
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::picture::write_png;
use crate::report::{figures, results};
use crate::study::publications::{Effort, reproduce};

/// Rerun the publications' experiments and write RESULTS.md with its figures
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where RESULTS.md and the folder 'figures' go
    #[arg(long, short, default_value = "docs", value_name = "FOLDER")]
    output: PathBuf,
    /// A folder with the models of the tables; without it only the built-in
    /// scenes are measured
    #[arg(long, value_name = "FOLDER")]
    models: Option<PathBuf>,
    /// Seeds of each run of the tables
    #[arg(long, default_value_t = 4, value_name = "K", value_parser = clap::value_parser!(u32).range(2..=1000))]
    seeds: u32,
    /// Seeds of each expectation
    #[arg(long, default_value_t = 128, value_name = "K", value_parser = clap::value_parser!(u32).range(2..=10_000))]
    seeds_of_means: u32,
    /// Frame side in pixels
    #[arg(long, default_value_t = 800, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(128..=4096))]
    side: u32,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    if let Some(models) = arguments.models.as_ref().filter(|m| !m.is_dir()) {
        return Err(Error::config(
            format_args!("there is no folder {}", models.display()),
            "name the folder that holds the models",
        ));
    }
    let folder = arguments.output.join("figures");
    std::fs::create_dir_all(&folder).map_err(|e| Error::io("create", &folder, e))?;
    let effort = Effort {
        seeds: arguments.seeds,
        seeds_of_means: arguments.seeds_of_means,
        side: arguments.side,
    };
    let progress = console.progress("reproducing", "steps");
    let publications = reproduce(arguments.models.as_deref(), effort, |what, done, total| {
        progress.name(what);
        progress.set(done, total);
    })?;
    drop(progress);
    for missing in &publications.missing {
        console.warn(&format!("{missing}: not in the models' folder; its table is left out"));
    }
    let pictures = figures(&publications);
    for (name, picture) in &pictures {
        write_png(folder.join(format!("{name}.png")), picture)?;
    }
    let path = arguments.output.join("RESULTS.md");
    OutputFile::put(&path, results(&publications, "figures").as_bytes())?;
    console.print(format_args!("{} and {} figures", path.display(), pictures.len()))
}
