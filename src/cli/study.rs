//! `screendoor study` and `screendoor merge`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::console::{Console, shown};
use crate::cli::files::{Json, JsonArgument, report};
use crate::cli::kind::{Kind, check_input, check_output};
use crate::cli::signals::on_interrupt;
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::param::Options;
use crate::report::html::{DesignText, answer};
use crate::report::{About, PAGE, chapter, write_report};
use crate::study::file::Study;
use crate::study::publications::experiment::Lab;
use crate::study::publications::{Effort, measure_publication};
use crate::study::results::{Missing, Results};
use crate::study::run::{Runner, Shard, Store, Task, agree, check};

/// Measure a study: what its file says, run by run, into a folder with a report; called
/// again it goes on where it was interrupted
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The study, a TOML file; or traces, on which the default study's designs are measured
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Where results and report go
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// Measure only the I-th of N parts of the list of runs; 'merge' puts parts together
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1")]
    shard: Shard,
    /// The GPU to use, where the study asks for one: a part of its name or of its driver's
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    json: JsonArgument,
}

/// Put parts of a study together that were measured with 'study --shard'
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// Where the whole goes
    output: PathBuf,
    /// The parts' folders
    #[arg(required = true)]
    parts: Vec<PathBuf>,
    #[command(flatten)]
    json: JsonArgument,
}

fn shard(text: &str) -> std::result::Result<Shard, String> {
    text.parse().map_err(|e: Error| e.to_string())
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let files = &arguments.files;
    // What it names is seen from a study file's folder; what is named here, from where we are.
    let (study, base) = match &files[..] {
        [file] if Kind::of(file) != Some(Kind::Trace) => {
            check_input(file, Kind::Study)?;
            (Study::read(file)?, file.parent().unwrap_or(Path::new("")))
        }
        traces => {
            traces.iter().try_for_each(|trace| check_input(trace, Kind::Trace))?;
            (Study::of_traces(traces)?, Path::new(""))
        }
    };
    let named: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    let place = Place {
        base,
        shard: arguments.shard,
        adapter: arguments.adapter.as_deref(),
        json: &arguments.json,
        command: format!("screendoor study {} -o {}", named.join(" "), arguments.output.display()),
    };
    measured(&arguments.output, &study, place, console)
}

pub(super) fn run_merge(arguments: &MergeArguments, console: &Console) -> Result<()> {
    check_output(&arguments.output, Kind::Folder)?;
    arguments.parts.iter().try_for_each(|part| check_input(part, Kind::Folder))?;
    let json = arguments.json.open()?;
    let parts = arguments.parts.iter().map(|part| Store::open(part)).collect::<Result<Vec<_>>>()?;
    // A refused merge leaves nothing behind.
    let agreed = agree(&parts)?;
    let store = Store::begin(&arguments.output, agreed.study())?;
    agreed.merge(&store)?;
    let results = reported(&store, None, json, console)?;
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
    /// Where its figures go too.
    pub json: &'a JsonArgument,
    /// The command that does this.
    pub command: String,
}

/// Measures what is missing of `study` in `folder` and writes the report. What can be found
/// out before is, and then no folder is made.
pub(super) fn measured(
    folder: &Path,
    study: &Study,
    place: Place<'_>,
    console: &Console,
) -> Result<()> {
    check_output(folder, Kind::Folder)?;
    check(study, folder, place.base, place.shard, place.adapter)?;
    let json = place.json.open()?;
    let store = &Store::begin(folder, study)?;
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
    let done = |task: &Task| match task {
        Task::Run(job) => store.record_file(&job.id),
        Task::Publication(publication) => store.document_file(*publication),
    };
    let files: Vec<PathBuf> = runner.tasks().iter().map(done).collect();
    on_interrupt(move || {
        let (kept, all) = (files.iter().filter(|file| file.exists()).count(), files.len());
        format!("{kept} of {all} runs are kept; the same command goes on with the others")
    });
    let outcome = runner.run()?;
    let unpublished = publications(&runner)?;
    drop(progress);
    for reason in Reason::all(&outcome.failed).iter().chain(&Reason::all(&unpublished)) {
        console.error(&Error::config(reason, "the report shows which as missing"));
    }
    reported(store, Some(place.command), json, console).map(|_| ())
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
        let lab =
            Lab { folder: &store.publication_folder(*publication), models: None, watch: &told };
        match measure_publication(*publication, &lab, Effort::brief()) {
            Ok(reproduced) => {
                let chapter = chapter(&reproduced);
                for (name, drawn) in &chapter.figures {
                    drawn.write(store.verification_file(&drawn.file(name)))?;
                }
                let markdown = chapter.to_markdown(".");
                OutputFile::put(store.markdown_file(*publication), markdown.as_bytes())?;
                Store::put(&store.document_file(*publication), &chapter.sections)?;
                lab.forget_traces();
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

/// What a study's commands write as JSON; the records are in the folder.
#[derive(Serialize)]
struct Document<'a> {
    study: &'a str,
    folder: String,
    report: String,
    runs: usize,
    measured: usize,
    missing: &'a [Missing],
    answer: Vec<String>,
}

/// Writes the report and prints its answer.
pub(super) fn reported(
    store: &Store,
    command: Option<String>,
    json: Option<Json>,
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
    for scene in &results.scenes {
        scene.warnings.iter().for_each(|w| console.warn(&format!("{}: {w}", scene.name)));
    }
    // Of a part there is no answer yet.
    let whole = results.missing.iter().all(|m| m.why.is_some());
    let document = Document {
        study: &study.name,
        folder: store.folder().display().to_string(),
        report: store.folder().join(PAGE).display().to_string(),
        runs: store.jobs().len(),
        measured: results.records.len(),
        missing: &results.missing,
        answer: if whole { answer(&results) } else { Vec::new() },
    };
    report(json, "screendoor.study", &document, console, || {
        for sentence in &document.answer {
            console.print(format_args!("{sentence}"))?;
        }
        console.print(format_args!(
            "{} of {} runs; the report is {}",
            document.measured,
            document.runs,
            shown(&document.report)
        ))
    })?;
    Ok(results)
}
