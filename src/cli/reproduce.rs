//! `screendoor reproduce`.

use std::io;
use std::path::PathBuf;

use clap::Args;

use crate::cli::console::{Console, shown};
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::param::Options;
use crate::picture::write_png;
use crate::report::{Measured, Part, results};
use crate::study::comparison::compare;
use crate::study::publications::methods::methods;
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
    /// Frame side in pixels of the comparison of all designs
    #[arg(long, default_value_t = 128, value_name = "PIXELS", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(32..=4096))]
    comparison_side: u32,
    /// Measure only this part; the others stay in RESULTS.md as they are
    #[arg(long, value_name = "PART", value_parser = part)]
    part: Option<Part>,
}

fn part(text: &str) -> std::result::Result<Part, String> {
    let names = || Part::CHOICES.iter().map(|c| c.name);
    let found = names().position(|name| name == text);
    found.map(|i| Part::ALL[i]).ok_or_else(|| Error::unknown("part", text, names()).to_string())
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
    let before = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => String::new(),
        Err(e) => return Err(Error::io("read", &path, e)),
    };
    let effort = Effort {
        seeds: arguments.seeds,
        seeds_of_means: arguments.seeds_of_means,
        side: arguments.side,
    };
    let progress = console.progress("reproducing", "steps");
    let watch = |what: &str, done, total| {
        progress.name(what);
        progress.set(done, total);
    };
    let models = arguments.models.as_deref();
    let wanted = |part| arguments.part.is_none_or(|only| only == part);
    let publications =
        wanted(Part::LaineKarras).then(|| reproduce(models, effort, watch)).transpose()?;
    let methods = wanted(Part::Methods).then(|| methods(models, effort, watch)).transpose()?;
    let comparison = wanted(Part::Comparison)
        .then(|| compare(models, arguments.comparison_side, arguments.seeds, watch))
        .transpose()?;
    drop(progress);
    let missing = publications.iter().flat_map(|p| &p.missing);
    let missing = missing.chain(comparison.iter().flat_map(|c| &c.missing));
    for missing in missing {
        console.warn(&format!("{missing}: not in the models' folder; its table is left out"));
    }
    let measured: Vec<Measured<'_>> = [
        publications.as_ref().map(Measured::LaineKarras),
        methods.as_ref().map(Measured::Methods),
        comparison.as_ref().map(Measured::Comparison),
    ]
    .into_iter()
    .flatten()
    .collect();
    let pictures: Vec<_> = measured.iter().flat_map(Measured::figures).collect();
    let text = results(&before, &measured, "figures");
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
