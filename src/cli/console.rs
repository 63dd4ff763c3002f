//! What the user sees: output, progress, warnings, tables.

use std::cell::Cell;
use std::fmt::{Arguments, Display};
use std::io::{self, Write};

use comfy_table::{CellAlignment, Table, presets};

use crate::cli::progress::Progress;
use crate::error::{Error, Result};

/// The user's terminal.
#[derive(Debug)]
pub(super) struct Console {
    quiet: bool,
    failed: Cell<bool>,
    differs: Cell<bool>,
}

const TO_OUTPUT: &str = "write to";

/// Whether the reader of our output has seen enough: no error.
pub(super) fn nobody_reads(error: &Error) -> bool {
    matches!(error, Error::Io { action: TO_OUTPUT, source, .. }
        if source.kind() == io::ErrorKind::BrokenPipe)
}

impl Console {
    pub fn new(quiet: bool) -> Self {
        Console { quiet, failed: Cell::new(false), differs: Cell::new(false) }
    }

    /// Prints text to standard output, and a line's end. Of control characters
    /// only line ends are obeyed.
    pub fn print(&self, text: Arguments<'_>) -> Result<()> {
        let lines: String = text.to_string().split('\n').map(|l| shown(l) + "\n").collect();
        self.write(lines.as_bytes())
    }

    /// Writes bytes to standard output as they are.
    pub fn write(&self, bytes: &[u8]) -> Result<()> {
        let written = io::stdout().lock().write_all(bytes);
        written.map_err(|e| Error::io(TO_OUTPUT, "standard output", e))
    }

    /// Prints an error to standard error; the program will end with a failure.
    pub fn error(&self, error: &Error) {
        self.failed.set(true);
        // Where standard error is closed there is nobody to tell.
        let _ = writeln!(io::stderr().lock(), "screendoor: error: {}", shown(error));
    }

    /// The program will say by how it ends that two things differ.
    pub fn differ(&self) {
        self.differs.set(true);
    }

    /// Whether it will.
    pub fn has_differed(&self) -> bool {
        self.differs.get()
    }

    /// Whether an error has been printed.
    pub fn has_failed(&self) -> bool {
        self.failed.get()
    }

    /// Prints a warning to standard error.
    pub fn warn(&self, text: &str) {
        if !self.quiet {
            let _ = writeln!(io::stderr().lock(), "screendoor: warning: {}", shown(text));
        }
    }

    /// Prints warnings about `source`.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where there are any, and with `strict` none may be.
    pub fn warn_all(&self, warnings: &[String], strict: bool, source: &str) -> Result<()> {
        warnings.iter().for_each(|warning| self.warn(warning));
        let Some(first) = warnings.first().filter(|_| strict) else { return Ok(()) };
        let what = match warnings.len() {
            1 => format!("there is a warning, and none may be ({first})"),
            n => format!("there are {n} warnings, and none may be (the first: {first})"),
        };
        let hint = "nothing is written: mend the scene, or leave --strict out";
        Err(Error::unsupported(source, what, hint))
    }

    /// Tells what is to be known beforehand, to standard error.
    pub fn note(&self, text: Arguments<'_>) {
        if !self.quiet {
            let _ = writeln!(io::stderr().lock(), "screendoor: {}", shown(text));
        }
    }

    /// What a long command shows of itself on standard error: a bar where that is a
    /// terminal, and else a line now and then. Nothing of either with --quiet.
    pub fn progress(&self, what: &str, unit: &str) -> Progress {
        Progress::new(self.quiet, what, unit)
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

/// `text` with control characters shown, not obeyed: names of files and what a
/// trace says of itself come from others.
pub(super) fn shown(text: impl Display) -> String {
    let mut out = String::new();
    for c in text.to_string().chars() {
        if c.is_control() { out.extend(c.escape_debug()) } else { out.push(c) }
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

    #[test]
    fn control_characters_are_shown() {
        assert_eq!(shown("a\u{1b}[31m\nb\u{9b}é…"), "a\\u{1b}[31m\\nb\\u{9b}é…");
    }
}
