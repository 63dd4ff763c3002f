//! `screendoor scenes`.

use clap::Args;

use crate::cli::console::Console;
use crate::cli::designs::print_params;
use crate::cli::files::{JsonArgument, report};
use crate::error::Result;
use crate::param::Param;
use crate::scene::builtin::{BUILTINS, Builtin};

/// List the built-in scenes and their parameters
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(serde::Serialize)]
struct List<'a> {
    scenes: &'a [Document],
}

#[derive(serde::Serialize)]
struct Document {
    name: &'static str,
    summary: &'static str,
    params: &'static [Param],
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let json = arguments.json.open()?;
    let document = |s: &Builtin| Document { name: s.name, summary: s.summary, params: s.params };
    let documents: Vec<Document> = BUILTINS.iter().map(document).collect();
    let list = List { scenes: &documents };
    report(json, "screendoor.scenes", &list, console, || {
        for scene in BUILTINS {
            console.print(format_args!("builtin:{}\n  {}", scene.name, scene.summary))?;
            print_params(scene.params, console)?;
        }
        Ok(())
    })
}
