//! `screendoor stress`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::console::{Console, shown, table};
use crate::cli::files::{JsonArgument, check, report};
use crate::cli::kind::{Kind, check_output};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::output::OutputFile;
use crate::param::Options;
use crate::report::stability;
use crate::study::stress::{Group, Outcome, Plan, Stability, stress};

/// Try every design and engine on hard cases, and write what comes of it
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Write the tables, as Markdown
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Only the designs: no hostile files and no faults, for which the program is run again
    /// and again
    #[arg(long)]
    designs_only: bool,
    /// Seeds of each design that has any
    #[arg(long, default_value_t = 32, value_name = "K", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(8..=1000))]
    seeds: u32,
    /// The GPU to use: a part of its name or of its driver's; without it any, if there is one
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    json: JsonArgument,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let open = || match (Gpu::open(arguments.adapter.as_deref()), &arguments.adapter) {
        (Ok(gpu), _) => Ok(Some(gpu)),
        (Err(error), Some(_)) => Err(error),
        (Err(error), None) => {
            console.warn(&format!("no GPU is tried: {error}"));
            Ok(None)
        }
    };
    let outputs: Vec<&Path> =
        arguments.output.as_deref().into_iter().chain(arguments.json.path()).collect();
    check(&[], &outputs)?;
    if let Some(path) = &arguments.output {
        check_output(path, Kind::Markdown)?;
    }
    let json = arguments.json.open()?;
    let progress = console.progress("trying", "cases");
    let program = std::env::current_exe().map_err(|e| Error::io("find", "this program", e))?;
    let output = arguments.output.as_ref().map(OutputFile::create).transpose()?;
    let plan = Plan {
        program: (!arguments.designs_only).then_some(&program),
        gpu: &open,
        seeds: arguments.seeds,
        progress: &|what, done, total| {
            progress.name(what);
            progress.set(done, total);
        },
    };
    let found = stress(&plan)?;
    drop(progress);
    if let Some(mut file) = output {
        let command = "cargo run --release -- stress -o docs/STABILITY.md";
        file.write_bytes(stability(&found, command)?.to_markdown(1, ".").as_bytes())?;
        file.commit()?;
    }
    report(json, "screendoor.stress", &found, console, || print(&found, arguments, console))?;
    for broken in found.broken() {
        console.error(&Error::config(broken, "this is a fault of screendoor: report it"));
    }
    Ok(())
}

/// What came of it, in a table of groups.
fn print(found: &Stability, arguments: &Arguments, console: &Console) -> Result<()> {
    let mut rows = Vec::new();
    for (group, choice) in Group::ALL.iter().zip(Group::CHOICES) {
        let of_group = |case: &str| found.cases.iter().any(|c| c.name == case && c.group == *group);
        let own = found.findings.iter().filter(|f| of_group(&f.case)).map(|f| &f.outcome);
        let counts = Outcome::count(own);
        let numbers = std::iter::once(counts.iter().sum()).chain(counts);
        let numbers = numbers.map(|n: usize| n.to_string());
        rows.push(std::iter::once(choice.name.to_string()).chain(numbers).collect());
    }
    let head: Vec<&str> = ["cases", "results"].into_iter().chain(Outcome::KINDS).collect();
    console.print(format_args!("{}", table(&head, rows)))?;
    for claim in &found.claims {
        let held = if claim.held { "refused" } else { "NOT HELD" };
        console.print(format_args!(
            "{held} in {:.0} ms and {:.0} MiB: {}",
            claim.seconds * 1e3,
            claim.bytes as f64 / f64::from(1 << 20),
            claim.what
        ))?;
    }
    for fault in &found.faults {
        console.print(format_args!(
            "{}: {} tries, {} times the work was done, {} times it ended otherwise with nothing \
             lost, {} failures",
            fault.name,
            fault.tries,
            fault.done,
            fault.survived,
            fault.failures.len()
        ))?;
    }
    if let Some(path) = &arguments.output {
        console.print(format_args!("the tables are in {}", shown(path.display())))?;
    }
    Ok(())
}
