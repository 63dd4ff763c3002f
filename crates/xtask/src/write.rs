//! The files of the tree that the program writes itself, written again.

use std::path::PathBuf;
use std::process::Command;

use clap::{Args, ValueEnum};

use crate::process::{Result, call};

/// Write the tree's files that the program makes: in what they differ then is to be looked at
#[derive(Args)]
pub(crate) struct Arguments {
    /// Which; all where none is named
    what: Vec<What>,
    /// The folder with the models that docs/RESULTS.md names; without it that file is left
    #[arg(long)]
    models: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// traces/golden.txt: hashes of all designs' pictures; seconds once it is built
    Golden,
    /// docs/STABILITY.md: hard cases, false claims, faults; minutes
    Stability,
    /// docs/RESULTS.md, docs/figures and the results in short in README.md; three quarters of an hour
    Results,
    /// docs/fuzzing/figures.toml, from which the next STABILITY.md is written; an hour
    Fuzzing,
}

impl What {
    /// The command that does it.
    fn command(self, models: Option<&PathBuf>) -> Option<Command> {
        let cargo = |arguments: &[&str]| {
            let mut command = Command::new("cargo");
            command.args(arguments);
            command
        };
        let program = ["run", "--locked", "--release", "--"];
        Some(match self {
            What::Golden => {
                cargo(&["test", "--locked", "--test", "it", "write_golden", "--", "--ignored"])
            }
            What::Stability => {
                cargo(&[&program[..], &["stress", "-o", "docs/STABILITY.md"]].concat())
            }
            What::Results => {
                let reproduce = ["reproduce", "-o", "docs", "--readme", "README.md", "--models"];
                let mut command = cargo(&[&program[..], &reproduce].concat());
                command.arg(models?);
                command
            }
            What::Fuzzing => Command::new("fuzz/run.sh"),
        })
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<bool> {
    let named = |what: &What| arguments.what.is_empty() || arguments.what.contains(what);
    let mut all = true;
    for what in What::value_variants().iter().filter(|what| named(what)) {
        match what.command(arguments.models.as_ref()) {
            Some(mut command) => drop(call(&mut command)?),
            None => {
                all = false;
                eprintln!("xtask: docs/RESULTS.md is left as it is: name --models");
            }
        }
    }
    Ok(all)
}
