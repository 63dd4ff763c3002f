//! The statements of OBJ and MTL files.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result, one_line};
use crate::scene::file;

/// The longest statement, in bytes.
const MAX_BYTES: u64 = 1 << 24;
/// How much of a statement an error shows, in characters.
const SHOWN: usize = 60;

/// One statement: a line, with those that continue it.
pub(super) struct Statement {
    /// The number of its first line, from 1.
    pub line: usize,
    text: String,
}

impl Statement {
    /// Its first word.
    pub fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// What follows the first word, as a name: names may hold spaces and `#`.
    pub fn name(&self) -> &str {
        self.text.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// The words after the first, up to a comment.
    pub fn words(&self) -> impl Iterator<Item = &str> {
        self.text.split_whitespace().skip(1).take_while(|word| !word.starts_with('#'))
    }

    /// The finite number that a word is.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn number(word: &str) -> Result<f32, String> {
        match word.parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(number),
            Ok(_) => Err(format!("'{}' is no finite number", shown(word))),
            Err(_) => Err(format!("'{}' is no number", shown(word))),
        }
    }

    /// Where it stands in the file at `path`, and its beginning.
    pub fn place(&self, path: &Path) -> String {
        format!("{}, line {} ('{}')", path.display(), self.line, shown(&self.text))
    }
}

/// The beginning of a text, as messages show it.
pub(super) fn shown(text: &str) -> String {
    one_line(text.chars().take(SHOWN).collect::<String>())
}

/// Reads a file statement by statement.
pub(super) struct Lines {
    path: PathBuf,
    reader: BufReader<File>,
    line: usize,
}

impl Lines {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// As [`file::open`].
    pub fn open(path: &Path) -> Result<Self> {
        let (file, _) = file::open(path)?;
        Ok(Lines { path: path.to_path_buf(), reader: BufReader::new(file), line: 0 })
    }

    /// The next statement that is neither empty nor a comment; `None` at the end.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Invalid`] for a statement above 16 MiB.
    pub fn next(&mut self) -> Result<Option<Statement>> {
        loop {
            let Some(mut text) = self.read_line()? else { return Ok(None) };
            let line = self.line;
            // A comment that ends in a backslash (a folder, say) is a comment still.
            while !text.contains('#') && text.trim_end().ends_with('\\') {
                text.truncate(text.trim_end().len() - 1);
                text.push(' ');
                match self.read_line()? {
                    Some(next) => text += &next,
                    None => break,
                }
                self.check_length(text.len(), line)?;
            }
            let text = text.trim();
            if !text.is_empty() && !text.starts_with('#') {
                return Ok(Some(Statement { line, text: text.to_string() }));
            }
        }
    }

    fn read_line(&mut self) -> Result<Option<String>> {
        let mut bytes = Vec::new();
        let reader = self.reader.by_ref();
        let read = reader.take(MAX_BYTES + 1).read_until(b'\n', &mut bytes);
        if read.map_err(|e| Error::io("read", &self.path, e))? == 0 {
            return Ok(None);
        }
        self.line += 1;
        self.check_length(bytes.len(), self.line)?;
        if self.line == 1 && bytes.starts_with(b"\xef\xbb\xbf") {
            bytes.drain(..3);
        }
        // Older programs write names in Latin-1, in which any bytes are good.
        let latin = |e: std::string::FromUtf8Error| {
            e.as_bytes().iter().map(|byte| char::from(*byte)).collect()
        };
        Ok(Some(String::from_utf8(bytes).unwrap_or_else(latin)))
    }

    fn check_length(&self, bytes: usize, line: usize) -> Result<()> {
        if bytes as u64 <= MAX_BYTES {
            return Ok(());
        }
        let place = format!("{}, line {line}", self.path.display());
        Err(Error::invalid(place, "the statement is longer than 16 MiB", "divide it"))
    }
}

#[cfg(test)]
impl Statement {
    /// A statement of that text.
    pub fn of(text: &str) -> Self {
        Statement { line: 1, text: text.to_string() }
    }
}
