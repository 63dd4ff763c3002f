//! `screendoor reproduce`.

use std::io;
use std::path::PathBuf;

use clap::Args;

use crate::cli::console::{Console, shown};
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
    #[arg(long, default_value_t = 4, value_name = "K", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=1000))]
    seeds: u32,
    /// Seeds of each expectation
    #[arg(long, default_value_t = 128, value_name = "K", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    seeds_of_means: u32,
    /// Frame side in pixels
    #[arg(long, default_value_t = 800, value_name = "PIXELS", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(128..=4096))]
    side: u32,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    if let Some(models) = arguments.models.as_ref().filter(|m| !m.is_dir()) {
        let why = "there is no such folder; name the one that holds the models";
        return Err(Error::io("read", models, io::Error::new(io::ErrorKind::NotFound, why)));
    }
    let folder = arguments.output.join("figures");
    std::fs::create_dir_all(&folder).map_err(|e| Error::io("create", &folder, e))?;
    let path = arguments.output.join("RESULTS.md");
    // The work takes hours: that it can be written is found out before.
    let mut file = OutputFile::create(&path)?;
    drop(OutputFile::create(folder.join("figure.png"))?);
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
    let text = results(&publications, "figures");
    let save = || {
        for (name, picture) in &pictures {
            write_png(folder.join(format!("{name}.png")), picture)?;
        }
        file.write_bytes(text.as_bytes())?;
        file.commit()
    };
    if let Err(error) = save() {
        // What has been measured is not lost.
        console.print(format_args!("{text}"))?;
        return Err(error);
    }
    let (path, count) = (shown(path.display()), pictures.len());
    console.print(format_args!("{path} and {count} figures"))
}
