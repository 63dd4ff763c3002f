//! `screendoor reproduce`.

use std::io;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::cli::console::{Console, shown};
use crate::cli::files::{JsonArgument, report};
use crate::cli::kind::{Kind, check_output};
use crate::cli::signals::on_interrupt;
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::param::Options;
use crate::report::document::Against;
use crate::report::{Chapter, FIGURES_FOLDER, PARTS, chapter, check_marks, in_short, results};
use crate::study::file::Publication;
use crate::study::publications::experiment::Lab;
use crate::study::publications::programs::recorded_programs;
use crate::study::publications::{Effort, measure_publication};

/// Rerun the publications' experiments and write RESULTS.md with its figures: three quarters of an
/// hour on two cores with what is the default; --part, --side and --seeds make it shorter
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where RESULTS.md and the folder 'figures' go
    #[arg(long, short, default_value = "screendoor-results", value_name = "FOLDER")]
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
    #[arg(long, default_value_t = 640, value_name = "PIXELS", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(128..=4096))]
    side: u32,
    /// Frame side in pixels of what all scenes are tried for: the comparison of all designs,
    /// the views of table 1; claims about variants have half of it
    #[arg(long, default_value_t = 96, value_name = "PIXELS", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(32..=4096))]
    comparison_side: u32,
    /// Where runs are kept as they are measured; those that are there are not measured again.
    /// Without it they are kept in the output's folder until the results are written
    #[arg(long, value_name = "FOLDER")]
    runs: Option<PathBuf>,
    /// Measure only this part; the others stay in RESULTS.md as they are
    #[arg(long, value_name = "PART", value_parser = part)]
    part: Option<Publication>,
    /// Write the results in short between their marks in this file, too
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    #[command(flatten)]
    json: JsonArgument,
}

/// The folder within the output's for runs while the results are not written.
const OWN: &str = ".screendoor-runs";

#[derive(Serialize)]
struct Written<'a> {
    results: String,
    figures: Vec<String>,
    /// Scenes whose models are not in the models' folder.
    missing: &'a [String],
    parts: Vec<Part<'a>>,
}

#[derive(Serialize)]
struct Part<'a> {
    name: &'a str,
    against: Vec<&'a Against>,
}

/// Minutes on two processors that the parts take with the default effort, roughly: the tables
/// (their share grows with the pixels and the seeds), the expectations (with theirs), shadow maps, screen doors, costs, the
/// comparison of all designs, this project's own over many seeds, splats, and what programs drew.
const MINUTES: [f64; 9] = [15.0, 7.0, 0.2, 0.8, 1.0, 25.0, 12.0, 3.0, 1.0];

/// How long it takes on so many threads, roughly, in minutes.
fn minutes(effort: Effort, part: Option<Publication>, threads: usize) -> f64 {
    let square = |side: u32, usual: f64| (f64::from(side) / usual).powi(2);
    let seeds = f64::from(effort.seeds) / 4.0;
    let [tables, means, shadows, doors, costs, comparison, beyond, splats, programs] = MINUTES;
    let of = |own: Publication| part.is_none_or(|only| only == own);
    let mut minutes = 0.0;
    if of(Publication::LaineKarras) {
        minutes += tables * square(effort.side, 800.0) * seeds;
    }
    if of(Publication::Methods) {
        minutes += means * f64::from(effort.seeds_of_means) / 128.0;
    }
    if of(Publication::Shadows) {
        minutes += shadows * square(effort.comparison_side, 96.0) * seeds;
    }
    if of(Publication::ScreenDoor) {
        minutes += doors;
    }
    if of(Publication::Costs) {
        minutes += costs * square(effort.comparison_side, 96.0);
    }
    if of(Publication::Comparison) {
        minutes += comparison * square(effort.comparison_side, 128.0) * seeds;
    }
    if of(Publication::Beyond) {
        let seeds = f64::from(effort.seeds_of_means) / 128.0;
        minutes += beyond * square(effort.comparison_side, 96.0) * seeds;
    }
    if of(Publication::Splats) {
        let seeds = f64::from(effort.seeds_of_means) / 128.0;
        minutes += splats * square(effort.comparison_side, 96.0) * seeds;
    }
    if of(Publication::Programs) {
        minutes += programs;
    }
    minutes * 2.0 / threads as f64
}

/// A time for people, no finer than it is known.
fn about(minutes: f64) -> String {
    match minutes {
        m if m < 1.5 => "a minute".to_string(),
        m if m < 90.0 => format!("{m:.0} minutes"),
        m => format!("{:.0} hours", (m / 60.0).ceil()),
    }
}

fn part(text: &str) -> std::result::Result<Publication, String> {
    let names = PARTS.iter().map(|part| part.name());
    let found = PARTS.into_iter().find(|part| part.name() == text);
    found.ok_or_else(|| Error::unknown("part", text, names).to_string())
}

/// A document that repeats the results in short.
struct Readme {
    text: String,
    file: OutputFile,
}

impl Readme {
    fn open(path: &PathBuf) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io("read", path, e))?;
        check_marks(&text)?;
        Ok(Readme { text, file: OutputFile::create(path)? })
    }

    fn write(mut self, results: &str) -> Result<()> {
        self.file.write_bytes(in_short(&self.text, results)?.as_bytes())?;
        self.file.commit()
    }
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    if let Some(models) = arguments.models.as_ref().filter(|m| !m.is_dir()) {
        let why = "there is no such folder; name the one that holds the models";
        return Err(Error::io("read", models, io::Error::new(io::ErrorKind::NotFound, why)));
    }
    let mut parts = PARTS.to_vec();
    parts.retain(|part| arguments.part.is_none_or(|only| only == *part));
    // Of all parts, this one alone needs a checkout.
    if let (true, Err(error)) = (parts.contains(&Publication::Programs), recorded_programs()) {
        if arguments.part.is_some() {
            return Err(error);
        }
        console.warn(&format!("{error}; the part 'programs' is left out"));
        parts.retain(|part| *part != Publication::Programs);
    }
    check_output(&arguments.output, Kind::Folder)?;
    let folder = arguments.output.join(FIGURES_FOLDER);
    std::fs::create_dir_all(&folder).map_err(|e| Error::io("create", &folder, e))?;
    let path = arguments.output.join("RESULTS.md");
    // The work takes long: that it can be written is found out before.
    let json = arguments.json.open()?;
    let mut file = OutputFile::create(&path)?;
    drop(OutputFile::create(folder.join("figure.png"))?);
    let before = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => String::new(),
        Err(e) => return Err(Error::io("read", &path, e)),
    };
    let readme = arguments.readme.as_ref().map(Readme::open).transpose()?;
    let effort = Effort {
        seeds: arguments.seeds,
        seeds_of_means: arguments.seeds_of_means,
        side: arguments.side,
        comparison_side: arguments.comparison_side,
        brief: false,
    };
    let threads = rayon::current_num_threads();
    console.note(format_args!(
        "this takes about {} with {threads} threads, very roughly; {} is written at the end",
        about(minutes(effort, arguments.part, threads)),
        path.display()
    ));
    let own = arguments.output.join(OWN);
    let runs = arguments.runs.as_deref().unwrap_or(&own);
    on_interrupt({
        let runs = runs.display().to_string();
        move || format!("the runs that are done are kept in {runs}; the same command goes on")
    });
    let progress = console.progress("reproducing", "steps");
    let watch = |what: &str, done, total| {
        progress.name(what);
        progress.set(done, total);
    };
    let lab = Lab { folder: runs, models: arguments.models.as_deref(), watch: &watch };
    let mut chapters: Vec<(Publication, Chapter)> = Vec::new();
    let mut missing = Vec::new();
    for part in parts {
        let measured = measure_publication(part, &lab, effort)?;
        missing.extend_from_slice(measured.missing());
        chapters.push((part, chapter(&measured)));
    }
    drop(progress);
    for missing in &missing {
        console.warn(&format!("{missing}: not in the models' folder; its table is left out"));
    }
    let text = results(&before, &chapters);
    let figures: Vec<_> = chapters.iter().flat_map(|(_, c)| &c.figures).collect();
    let save = || {
        for (name, drawn) in figures.iter().copied() {
            drawn.write(folder.join(drawn.file(name)))?;
        }
        file.write_bytes(text.as_bytes())?;
        file.commit()?;
        readme.map_or(Ok(()), |readme| readme.write(&text))
    };
    if let Err(error) = save() {
        // What has been measured is not lost.
        console.print(format_args!("{text}"))?;
        return Err(error);
    }
    if arguments.runs.is_none() {
        // What stays is taken up by the next call of the same version with the same settings.
        let _ = std::fs::remove_dir_all(&own);
    }
    let written = Written {
        results: path.display().to_string(),
        figures: figures
            .iter()
            .map(|(name, drawn)| format!("{FIGURES_FOLDER}/{}", drawn.file(name)))
            .collect(),
        missing: &missing,
        parts: chapters
            .iter()
            .map(|(part, c)| Part { name: part.name(), against: c.against().collect() })
            .collect(),
    };
    report(json, "screendoor.reproduce", &written, console, || {
        console.print(format_args!("{} and {} figures", shown(&written.results), figures.len()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_follows_the_effort() {
        let usual =
            Effort { seeds: 4, seeds_of_means: 128, side: 800, comparison_side: 128, brief: false };
        assert_eq!(about(minutes(usual, None, 2)), "78 minutes");
        let parts: f64 = PARTS.iter().map(|part| minutes(usual, Some(*part), 2)).sum();
        assert_eq!(parts, minutes(usual, None, 2));
        let small = Effort { side: 128, seeds_of_means: 2, comparison_side: 32, seeds: 2, ..usual };
        assert!(minutes(small, None, 2) < 10.0);
        assert!(minutes(usual, None, 64) < minutes(usual, None, 2) / 10.0);
        assert_eq!([about(0.2), about(12.4), about(95.0)], ["a minute", "12 minutes", "2 hours"]);
    }
}
