//! The command line: one file a subcommand, each of which only calls.

mod arguments;
mod capture;
mod compare;
mod console;
mod demo;
mod designs;
mod diff;
mod edit;
mod explain;
mod files;
mod info;
mod kind;
mod progress;
mod replay;
mod report;
mod reproduce;
mod scenes;
mod shade;
mod signals;
mod stress;
mod study;
mod throughput;
mod verify;
mod vulkan;

use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser, Subcommand};

use crate::cli::console::Console;
use crate::error::{Error, Result};

/// Replay captured fragment traces through models of a raster-operations unit
/// for order-independent transparency, and see what each costs and how far its
/// picture is from the exact one.
#[derive(Debug, Parser)]
#[command(name = "screendoor", version, propagate_version = true, subcommand_required = true)]
struct Arguments {
    /// Threads to use; all processors where not given
    #[arg(long, global = true, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// No progress bars and no warnings
    #[arg(long, short, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Report(report::Arguments),
    Study(study::Arguments),
    Merge(study::MergeArguments),
    Demo(demo::Arguments),
    Capture(Box<capture::Arguments>),
    Info(info::Arguments),
    Replay(replay::Arguments),
    Compare(compare::Arguments),
    Explain(explain::Arguments),
    Designs(designs::Arguments),
    Scenes(scenes::Arguments),
    Throughput(throughput::Arguments),
    Verify(verify::Arguments),
    Diff(diff::Arguments),
    Convert(edit::ConvertArguments),
    Trim(edit::TrimArguments),
    Join(edit::JoinArguments),
    Shuffle(edit::ShuffleArguments),
    Shade(shade::Arguments),
    Reproduce(reproduce::Arguments),
    Stress(stress::Arguments),
}

/// Parses the process's arguments and runs the command.
///
/// Exit codes: 0 for success; 1 where something could not be done or a file is
/// bad; 2 where the command line asks for what cannot be; 3 where `diff` finds a difference.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => match command_in_another_case(&error) {
            Some(error) => {
                Console::new(false).error(&error);
                return ExitCode::from(2);
            }
            None => return told(&error),
        },
    };
    quiet_drivers();
    let console = Console::new(arguments.quiet);
    signals::clean_up(arguments.quiet);
    match run(&arguments, &console) {
        Ok(()) => {}
        Err(error) if console::nobody_reads(&error) => {}
        Err(error) => {
            console.error(&error);
            return ExitCode::from(if error.is_config() { 2 } else { 1 });
        }
    }
    ExitCode::from(match (console.has_failed(), console.has_differed()) {
        (true, _) => 1,
        (_, true) => 3,
        _ => 0,
    })
}

/// Prints what clap has to say: help and the version to standard output, which may be full,
/// errors to standard error. Returns how the program ends.
fn told(said: &clap::Error) -> ExitCode {
    let code = ExitCode::from(u8::try_from(said.exit_code()).unwrap_or(2));
    let written = said.print().and_then(|()| io::stdout().flush());
    match written {
        Err(e) if !said.use_stderr() && e.kind() != io::ErrorKind::BrokenPipe => {
            Console::new(false).error(&Error::io("write to", "standard output", e));
            ExitCode::FAILURE
        }
        _ => code,
    }
}

/// Keeps a library below Vulkan's drivers (libwayland, which a layer of Mesa asks for its
/// display) from complaining to standard error about a variable that only display servers
/// need: it is set to a folder that is not there, which says as much and is no complaint.
fn quiet_drivers() {
    #[cfg(target_os = "linux")]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: no other thread runs yet that could read the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", "/nonexistent") };
    }
}

/// The error about a command whose letters are of another case, of which clap suggests none.
fn command_in_another_case(error: &clap::Error) -> Option<Error> {
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidSubcommand) else {
        return None;
    };
    let command = Arguments::command();
    let mut names = command.get_subcommands().map(clap::Command::get_name);
    let found = names.find(|name| name.eq_ignore_ascii_case(given))?;
    Some(Error::unknown("command", given, [found]))
}

fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    // Now, since threads that cannot be had are an error here and a panic later.
    let threads = arguments.threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.map_err(|e| Error::config(e, "ask for fewer threads with --threads, or free memory"))?;
    match &arguments.command {
        Command::Report(a) => report::run(a, console),
        Command::Study(a) => study::run(a, console),
        Command::Merge(a) => study::run_merge(a, console),
        Command::Demo(a) => demo::run(a, console),
        Command::Capture(a) => capture::run(a, console),
        Command::Info(a) => info::run(a, console),
        Command::Replay(a) => replay::run(a, console),
        Command::Compare(a) => compare::run(a, console),
        Command::Explain(a) => explain::run(a, console),
        Command::Designs(a) => designs::run(a, console),
        Command::Scenes(a) => scenes::run(a, console),
        Command::Throughput(a) => throughput::run(a, console),
        Command::Verify(a) => verify::run(a, console),
        Command::Diff(a) => diff::run(a, console),
        Command::Convert(a) => edit::run_convert(a, console),
        Command::Trim(a) => edit::run_trim(a, console),
        Command::Join(a) => edit::run_join(a, console),
        Command::Shuffle(a) => edit::run_shuffle(a, console),
        Command::Shade(a) => shade::run(a, console),
        Command::Reproduce(a) => reproduce::run(a, console),
        Command::Stress(a) => stress::run(a, console),
    }
}
