//! `screendoor verify`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::console::{Console, grouped, shown};
use crate::cli::files::check;
use crate::error::Result;
use crate::trace::{Checksums, Trace};

/// Check traces: schema, checksums, values and content hash
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The traces
    #[arg(required = true)]
    traces: Vec<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    for path in &arguments.traces {
        match verify(path, console) {
            Ok(line) => console.print(format_args!("{line}"))?,
            // One bad file keeps no other from being checked.
            Err(error) => console.error(&error),
        }
    }
    Ok(())
}

/// Checks one trace; what to say of a good one.
fn verify(path: &Path, console: &Console) -> Result<String> {
    check(&[path], &[])?;
    let trace = Trace::open(path)?;
    let progress = console.progress("verifying", "fragments");
    let mut done = 0;
    let hash = trace.verify(|rows| {
        done += rows;
        progress.set(done, trace.rows());
    })?;
    let seal = match trace.checksums() {
        Checksums::All => "checksums of every byte and content hash hold",
        Checksums::Batches => {
            "checksums and content hash hold; of an older seal, which leaves parts of the footer open"
        }
        Checksums::None => "well formed; it carries no checksums to hold it against",
    };
    let (place, fragments) = (shown(trace.place()), grouped(trace.rows()));
    Ok(format!("{place}: {fragments} fragments, content {hash}: {seal}"))
}
