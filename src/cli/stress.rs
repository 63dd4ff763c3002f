//! `screendoor stress`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::console::{Console, shown};
use crate::cli::files::{Json, report};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::output::OutputFile;
use crate::report::stability;
use crate::study::stress::{Plan, stress};

/// Try every design and engine on hard cases, and write what comes of it
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Write the tables, as Markdown
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Seeds of each design that has any
    #[arg(long, default_value_t = 16, value_name = "K", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=1000))]
    seeds: u32,
    /// The GPU to use: a part of its name or of its driver's; without it any, if there is one
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Write the findings as JSON to a file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let gpu = match (Gpu::open(arguments.adapter.as_deref()), &arguments.adapter) {
        (Ok(gpu), _) => Some(gpu),
        (Err(error), Some(_)) => return Err(error),
        (Err(error), None) => {
            console.warn(&format!("no GPU is tried: {error}"));
            None
        }
    };
    let json = Json::open(&arguments.json)?;
    let progress = console.progress("trying", "cases");
    let plan = Plan {
        gpu: gpu.as_ref(),
        seeds: arguments.seeds,
        progress: &|what, done, total| {
            progress.name(what);
            progress.set(done, total);
        },
    };
    let found = stress(&plan)?;
    drop(progress);
    if let Some(path) = &arguments.output {
        OutputFile::put(path, stability(&found).as_bytes())?;
        console.print(format_args!("{}", shown(path.display())))?;
    }
    report(json, &found, console, || Ok(()))
}
