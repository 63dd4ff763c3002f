//! What is done to screendoor's tree and not by its users: `cargo run -p xtask -- --help`.

mod process;
mod same;
mod write;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(about = "What is done to screendoor's tree and not by its users")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    Same(same::Arguments),
    Write(write::Arguments),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Same(arguments) => same::run(&arguments),
        Task::Write(arguments) => write::run(&arguments),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(why) => {
            eprintln!("xtask: {why}");
            ExitCode::from(2)
        }
    }
}
