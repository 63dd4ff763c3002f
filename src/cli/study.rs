//! `screendoor study` and `screendoor merge`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::console::{Console, shown};
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::param::Options;
use crate::picture::write_png;
use crate::report::html::{DesignText, answer};
use crate::report::{About, PAGE, document, write_report};
use crate::study::file::Study;
use crate::study::publications::{Effort, measure_publication};
use crate::study::results::Results;
use crate::study::run::{Runner, Shard, Store, merge};

/// Measure a study: what its file says, run by run, into a folder with a report; called
/// again it goes on where it was interrupted
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The study, a TOML file
    file: PathBuf,
    /// Where results and report go
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// Measure only the I-th of N parts of the list of runs; 'merge' puts parts together
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1")]
    shard: Shard,
    /// The GPU to use, where the study asks for one: a part of its name or of its driver's
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

/// Put parts of a study together that were measured with 'study --shard'
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// Where the whole goes
    output: PathBuf,
    /// The parts' folders
    #[arg(required = true)]
    parts: Vec<PathBuf>,
}

fn shard(text: &str) -> std::result::Result<Shard, String> {
    text.parse().map_err(|e: Error| e.to_string())
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let study = Study::read(&arguments.file)?;
    let base = arguments.file.parent().unwrap_or(Path::new(""));
    let store = Store::begin(&arguments.output, &study)?;
    let place = Place {
        base,
        shard: arguments.shard,
        adapter: arguments.adapter.as_deref(),
        command: format!(
            "screendoor study {} -o {}",
            arguments.file.display(),
            arguments.output.display()
        ),
    };
    measured(&store, place, console)
}

pub(super) fn run_merge(arguments: &MergeArguments, console: &Console) -> Result<()> {
    let parts = arguments.parts.iter().map(|part| Store::open(part)).collect::<Result<Vec<_>>>()?;
    let Some(first) = parts.first() else { return Ok(()) };
    let store = Store::begin(&arguments.output, first.study())?;
    merge(&store, &parts)?;
    let results = reported(&store, None, console)?;
    let missing = results.missing.len();
    if missing > 0 {
        console.warn(&format!("{missing} runs of the study are in none of the parts"));
    }
    Ok(())
}

/// Where a study is measured, beside its folder.
pub(super) struct Place<'a> {
    /// The folder that its paths are seen from.
    pub base: &'a Path,
    /// Which part.
    pub shard: Shard,
    /// The GPU's name.
    pub adapter: Option<&'a str>,
    /// The command that does this.
    pub command: String,
}

/// Measures what is missing and writes the report.
pub(super) fn measured(store: &Store, place: Place<'_>, console: &Console) -> Result<()> {
    let progress = console.progress("measuring", "runs");
    let runner = Runner {
        store,
        base: place.base,
        shard: place.shard,
        adapter: place.adapter,
        watch: &|what, done, total| {
            progress.name(what);
            progress.set(done, total);
        },
    };
    let outcome = runner.run()?;
    let unpublished = publications(&runner)?;
    drop(progress);
    for reason in Reason::all(&outcome.failed).iter().chain(&Reason::all(&unpublished)) {
        console.error(&Error::config(reason, "the report shows which as missing"));
    }
    reported(store, Some(place.command), console).map(|_| ())
}

/// Measures the part's publications that are not there yet. Returns which could not be, and
/// why.
fn publications(runner: &Runner<'_>) -> Result<Vec<(String, String)>> {
    let store = runner.store;
    let mut failed = Vec::new();
    let pending = runner.publications();
    let total = runner.tasks().len();
    for (i, publication) in pending.iter().enumerate() {
        let done = (total - pending.len() + i) as u64;
        let told = |what: &str, _, _| {
            (runner.watch)(&format!("{}: {what}", publication.name()), done, total as u64);
        };
        match measure_publication(*publication, None, Effort::brief(), told) {
            Ok(reproduced) => {
                let document = document(&reproduced, ".");
                for (name, picture) in &document.figures {
                    write_png(store.verification_file(&format!("{name}.png")), picture)?;
                }
                Store::put(&store.against_file(*publication), &document.against)?;
                let path = store.document_file(*publication);
                OutputFile::put(path, document.markdown.as_bytes())?;
            }
            Err(error) => failed.push((publication.name().to_string(), error.to_string())),
        }
    }
    Ok(failed)
}

/// Why runs could not be done, with the first of them and how many others.
struct Reason<'a> {
    why: &'a str,
    first: &'a str,
    others: usize,
}

impl<'a> Reason<'a> {
    fn all(failed: &'a [(String, String)]) -> Vec<Self> {
        let mut reasons: Vec<Reason<'a>> = Vec::new();
        for (id, why) in failed {
            match reasons.iter_mut().find(|r| r.why == why) {
                Some(reason) => reason.others += 1,
                None => reasons.push(Reason { why, first: id, others: 0 }),
            }
        }
        reasons
    }
}

impl std::fmt::Display for Reason<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.first)?;
        if self.others > 0 {
            write!(f, " and {} more runs", self.others)?;
        }
        write!(f, " could not be done: {}", self.why)
    }
}

/// Writes the report and prints its answer.
pub(super) fn reported(
    store: &Store,
    command: Option<String>,
    console: &Console,
) -> Result<Results> {
    let study = store.study();
    let command = command
        .unwrap_or_else(|| format!("screendoor study study.toml -o {}", store.folder().display()));
    let mut about = About { designs: Vec::new(), command };
    for series in &study.designs {
        let design = study.design(series, 8)?;
        about.designs.push(DesignText {
            series: series.clone(),
            summary: design.info().summary.to_string(),
            citation: design.info().citation.to_string(),
            promises: design.promises().words(),
        });
    }
    let results = write_report(store, about)?;
    // Of a part there is no answer yet.
    if results.missing.iter().all(|m| m.why.is_some()) {
        for sentence in answer(&results) {
            console.print(format_args!("{sentence}"))?;
        }
    }
    console.print(format_args!(
        "{} of {} runs; the report is {}",
        results.records.len(),
        store.jobs().len(),
        shown(store.folder().join(PAGE).display())
    ))?;
    Ok(results)
}
