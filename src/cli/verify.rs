//! `screendoor verify`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::console::{Console, grouped};
use crate::error::Result;
use crate::trace::Trace;

/// Check a trace: schema, checksums, values and content hash
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The traces
    #[arg(required = true)]
    traces: Vec<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    for path in &arguments.traces {
        let trace = Trace::open(path)?;
        let progress = console.progress("verifying", "fragments");
        let mut done = 0;
        let hash = trace.verify(|rows| {
            done += rows;
            progress.set(done, trace.rows());
        })?;
        drop(progress);
        let seal = if trace.is_sealed() {
            "checksums and content hash hold"
        } else {
            "well formed; it carries no checksums to hold it against"
        };
        console.print(format_args!(
            "{}: {} fragments, content {hash}: {seal}",
            trace.place(),
            grouped(trace.rows())
        ))?;
    }
    Ok(())
}
