//! The command line of screendoor.

use std::process::ExitCode;

fn main() -> ExitCode {
    screendoor::cli::main()
}
