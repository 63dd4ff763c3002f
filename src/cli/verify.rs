//! `screendoor verify`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::console::{Console, grouped, shown};
use crate::cli::files::{JsonArgument, check, report};
use crate::cli::kind::{Kind, check_input};
use crate::error::Result;
use crate::trace::{Checksums, Trace};

/// Check traces: schema, checksums, values and content hash
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The traces
    #[arg(required = true)]
    traces: Vec<PathBuf>,
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(Serialize)]
struct Document {
    traces: Vec<Checked>,
}

/// What was found of one trace.
#[derive(Serialize)]
struct Checked {
    trace: String,
    #[serde(flatten)]
    found: Found,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Found {
    Good { fragments: u64, content: String, checksums: Checksums },
    Bad { error: String },
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let inputs: Vec<&Path> = arguments.traces.iter().map(|path| &**path).collect();
    if let Some(output) = arguments.json.path() {
        inputs.iter().try_for_each(|input| check(&[input], &[output]))?;
    }
    let json = arguments.json.open()?;
    let aloud = json.is_none();
    let mut document = Document { traces: Vec::new() };
    for path in inputs {
        let found = match verify(path, console) {
            Ok(found) => found,
            // One bad file keeps no other from being checked.
            Err(error) => {
                console.error(&error);
                Found::Bad { error: error.to_string() }
            }
        };
        let checked = Checked { trace: path.display().to_string(), found };
        if aloud {
            print(&checked, console)?;
        }
        document.traces.push(checked);
    }
    report(json, "screendoor.verify", &document, console, || Ok(()))
}

fn print(checked: &Checked, console: &Console) -> Result<()> {
    let Found::Good { fragments, content, checksums } = &checked.found else { return Ok(()) };
    let seal = match checksums {
        Checksums::All => "checksums of every byte and content hash hold",
        Checksums::Batches => {
            "checksums and content hash hold; of an older seal, which leaves parts of the footer open"
        }
        Checksums::None => "well formed; it carries no checksums to hold it against",
    };
    let (place, fragments) = (shown(&checked.trace), grouped(*fragments));
    console.print(format_args!("{place}: {fragments} fragments, content {content}: {seal}"))
}

/// Checks one trace.
fn verify(path: &Path, console: &Console) -> Result<Found> {
    check(&[path], &[])?;
    check_input(path, Kind::Trace)?;
    let trace = Trace::open(path)?;
    let progress = console.progress("verifying", "fragments");
    let mut done = 0;
    let content = trace.verify(|rows| {
        done += rows;
        progress.set(done, trace.rows());
    })?;
    Ok(Found::Good { fragments: trace.rows(), content, checksums: trace.checksums() })
}
