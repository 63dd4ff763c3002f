//! The statements of OBJ and MTL files.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use screendoor_trace::error::{Error, Result, one_line};

/// The longest statement, in bytes.
const MAX_BYTES: u64 = 1 << 24;
/// The longest file in UTF-16, which is taken whole, in bytes.
const MAX_UTF16: u64 = 1 << 30;
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
    pub(super) fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// What follows the first word, as a name: names may hold spaces and `#`.
    pub(super) fn name(&self) -> &str {
        self.text.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// The words after the first, up to a comment.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        self.text.split_whitespace().skip(1).take_while(|word| !word.starts_with('#'))
    }

    /// The finite number that a word is.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn number(word: &str) -> Result<f64, String> {
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            Ok(_) => Err(format!("'{}' is no finite number", shown(word))),
            Err(_) => Err(format!("'{}' is no number", shown(word))),
        }
    }

    /// Where it stands in the file at `path`, and its beginning.
    pub(super) fn place(&self, path: &Path) -> String {
        format!("{}, line {} ('{}')", path.display(), self.line, shown(&self.text))
    }
}

/// The beginning of a text, as messages show it.
pub(super) fn shown(text: &str) -> String {
    one_line(text.chars().take(SHOWN).collect::<String>())
}

/// Reads a file statement by statement. Lines end as on Unix, Windows or old Macs; text is
/// UTF-8, Latin-1, or UTF-16 in either order of bytes.
pub(super) struct Lines {
    path: PathBuf,
    reader: Box<dyn BufRead>,
    line: usize,
    /// Whether the line before ended in a carriage return: a line feed is part of that end.
    returned: bool,
}

impl Lines {
    /// Reads an open file, which lies at `path`.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Unsupported`] for UTF-16 of more than 1 GiB.
    pub(super) fn of(file: File, path: &Path) -> Result<Self> {
        let fail = |e| Error::io("read", path, e);
        let mut reader = BufReader::new(file);
        let start = reader.fill_buf().map_err(fail)?;
        // ASCII in UTF-16 has a zero in every other byte.
        let order: Option<fn([u8; 2]) -> u16> = match *start {
            [0xff, 0xfe, ..] | [1..=255, 0, 1..=255, 0, ..] => Some(u16::from_le_bytes),
            [0xfe, 0xff, ..] | [0, 1..=255, 0, 1..=255, ..] => Some(u16::from_be_bytes),
            _ => None,
        };
        let reader: Box<dyn BufRead> = match order {
            None => Box::new(reader),
            Some(unit) => Box::new(Cursor::new(utf16(reader, unit, path)?)),
        };
        Ok(Lines { path: path.to_path_buf(), reader, line: 0, returned: false })
    }

    /// The next statement that is neither empty nor a comment; `None` at the end.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Invalid`] for a statement above 16 MiB.
    pub(super) fn next(&mut self) -> Result<Option<Statement>> {
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
        let mut begun = false;
        loop {
            let part = self.reader.fill_buf().map_err(|e| Error::io("read", &self.path, e))?;
            if part.is_empty() {
                break;
            }
            if std::mem::take(&mut self.returned) && part[0] == b'\n' {
                self.reader.consume(1);
                continue;
            }
            begun = true;
            let end = part.iter().position(|b| matches!(b, b'\n' | b'\r'));
            bytes.extend_from_slice(&part[..end.unwrap_or(part.len())]);
            self.returned = end.is_some_and(|end| part[end] == b'\r');
            let used = end.map_or(part.len(), |end| end + 1);
            self.reader.consume(used);
            if end.is_some() {
                break;
            }
            self.check_length(bytes.len(), self.line + 1)?;
        }
        if !begun {
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

/// The text of a file in UTF-16, as UTF-8. What is no UTF-16 becomes a mark of its own.
fn utf16(reader: impl Read, unit: fn([u8; 2]) -> u16, path: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    let read = reader.take(MAX_UTF16 + 1).read_to_end(&mut bytes);
    read.map_err(|e| Error::io("read", path, e))?;
    if bytes.len() as u64 > MAX_UTF16 {
        let what = "it is text in UTF-16 of more than 1 GiB";
        return Err(Error::unsupported(path.display(), what, "save it as UTF-8"));
    }
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    let text = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
    // A byte order mark is none of the text.
    Ok(text.skip_while(|c| *c == '\u{feff}').collect())
}

#[cfg(test)]
impl Statement {
    /// A statement of that text.
    pub(super) fn of(text: &str) -> Self {
        Statement { line: 1, text: text.to_string() }
    }
}
