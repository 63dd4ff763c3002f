//! Draws a small picture in one of many ways, to test a capturing layer against each.
//!
//! `raw CASE OUT [NUMBER]` writes the finished target's bytes to OUT: rows of texels of the
//! target's format, of RGBA8 where a case does not say otherwise; where several images or layers
//! are drawn to, one after the other. `raw --list` names the cases. What the device cannot do ends
//! with status 3. Cases with frames present them where there is a surface without a window or an X
//! display, in BGRA8 if that is the surface's format, and submit them otherwise.

mod cases;
mod chain;
mod failure;
mod gpu;
mod host;
mod memory;
mod pass;
mod pipeline;
mod record;
mod scene;
mod shader;
mod surface;
mod target;
mod window;

use std::path::PathBuf;
use std::process::ExitCode;

use cases::{CASES, Way};
use failure::{Failure, Result};

/// What a case is told.
pub(crate) struct Call {
    pub(crate) out: PathBuf,
    pub(crate) number: Option<u32>,
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let (case, out, number) = match words[..] {
        ["--list"] => {
            CASES.iter().for_each(|case| println!("{:28} {}", case.name, case.says));
            return ExitCode::SUCCESS;
        }
        [case, out] => (case, out, None),
        [case, out, number] => (case, out, number.parse().ok()),
        _ => {
            eprintln!("usage: raw CASE OUT [NUMBER], or raw --list");
            return ExitCode::from(2);
        }
    };
    match draw(case, &Call { out: out.into(), number }) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Unsupported(why)) => {
            println!("unsupported: {why}");
            ExitCode::from(3)
        }
        Err(Failure::Failed(why)) => {
            eprintln!("raw {case}: {why}");
            ExitCode::FAILURE
        }
    }
}

pub(crate) fn draw(name: &str, call: &Call) -> Result<()> {
    let case = CASES.iter().find(|case| case.name == name);
    let case = case.ok_or_else(|| Failure::Failed("no such case".into()))?;
    match case.way {
        Way::Picture(picture) => Ok(std::fs::write(&call.out, picture()?)?),
        Way::Program(program) => program(call),
    }
}
