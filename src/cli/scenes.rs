//! `screendoor scenes`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::console::Console;
use crate::cli::designs::print_params;
use crate::cli::files::{Json, report};
use crate::error::Result;
use crate::param::Param;
use crate::scene::builtin::{BUILTINS, Builtin};

/// List the built-in scenes and their parameters
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Write the list as JSON to a file, or to standard output for -
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
}

#[derive(serde::Serialize)]
struct Document {
    name: &'static str,
    summary: &'static str,
    params: &'static [Param],
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let json = Json::open(&arguments.json)?;
    let document = |s: &Builtin| Document { name: s.name, summary: s.summary, params: s.params };
    let documents: Vec<Document> = BUILTINS.iter().map(document).collect();
    report(json, &documents, console, || {
        for scene in BUILTINS {
            console.print(format_args!("builtin:{}\n  {}", scene.name, scene.summary))?;
            print_params(scene.params, console)?;
        }
        Ok(())
    })
}
