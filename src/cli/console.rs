//! What the user sees: output, progress, warnings, tables.

use std::fmt::Arguments;
use std::io::{self, Write};
use std::path::Path;

use comfy_table::{CellAlignment, Table, presets};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::error::{Error, Result};
use crate::output::OutputFile;

/// The user's terminal.
#[derive(Debug)]
pub(super) struct Console {
    quiet: bool,
}

impl Console {
    pub fn new(quiet: bool) -> Self {
        Console { quiet }
    }

    /// Prints a line to standard output.
    pub fn print(&self, line: Arguments<'_>) -> Result<()> {
        let written = writeln!(io::stdout().lock(), "{line}");
        written.map_err(|e| Error::io("write to", "standard output", e))
    }

    /// Prints a warning to standard error.
    pub fn warn(&self, text: &str) {
        if !self.quiet {
            // Where standard error is closed there is nobody to tell.
            let _ = writeln!(io::stderr().lock(), "screendoor: warning: {text}");
        }
    }

    /// A progress bar on standard error: none where that is no terminal.
    pub fn progress(&self, what: &str, unit: &str) -> Progress {
        let target =
            if self.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        let template = format!(
            "{{prefix}} [{{bar:30}}] {{percent:>3}} % of {{human_len}} {unit}, {{eta}} left"
        );
        bar.set_style(
            ProgressStyle::with_template(&template)
                .unwrap_or_else(|_| ProgressStyle::default_bar())
                .progress_chars("=> "),
        );
        bar.set_prefix(what.to_string());
        Progress { bar }
    }

    /// Writes `value` as JSON to `path`, or to standard output for `-`.
    pub fn json(&self, path: &str, value: &impl Serialize) -> Result<()> {
        let text = serde_json::to_string_pretty(value)
            .map_err(|e| Error::io("write", path, io::Error::other(e)))?;
        if path == "-" {
            return self.print(format_args!("{text}"));
        }
        OutputFile::put(Path::new(path), format!("{text}\n").as_bytes())
    }
}

/// A progress bar that vanishes when it is dropped.
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Shows that `done` of `total` is done.
    pub fn set(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.bar.set_position(done);
    }

    /// Shows another name for what is done.
    pub fn name(&self, what: &str) {
        self.bar.set_prefix(what.to_string());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A table of text: the first column to the left, the others to the right.
pub(super) fn table(header: &[&str], rows: Vec<Vec<String>>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header.to_vec()).add_rows(rows);
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        if i > 0 {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// A number with its thousands apart: 1 234 567.
pub(super) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_stand_apart() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1_234_567), "1 234 567");
    }
}
