//! The seal of a trace file: what lets a reader trust bytes before decoding them.
//!
//! Arrow IPC carries no checksums. The seal puts them into the footer's custom
//! metadata, as text: for the file's head and for each record batch its row
//! count, the offset at which it ends, and the CRC-32 of its bytes; then the
//! total row count, the content hash, and a CRC-32 over these entries
//! themselves. A damaged footer thus contradicts itself, and a damaged block
//! contradicts the footer.

use std::collections::BTreeMap;
use std::io::{self, Write};

use crate::error::{Error, Result};

pub(crate) const ROWS: &str = "screendoor.rows";
pub(crate) const BLOCKS: &str = "screendoor.blocks";
pub(crate) const CONTENT: &str = "screendoor.content";
pub(crate) const SEAL: &str = "screendoor.seal";
/// Stands in the schema's metadata, thus at the file's head as well as in its
/// footer, so that losing the seal cannot make a file look unsealed.
pub(crate) const CHECKSUMS: &str = "screendoor.checksums";
pub(crate) const CHECKSUMS_KIND: &str = "crc32";

/// One sealed stretch of a file: from the end of the one before to `end`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct SealedBlock {
    pub rows: u64,
    pub end: u64,
    pub crc: u32,
}

/// The footer's entries of a sealed file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Seal {
    /// The head first, then the record batches in order.
    pub blocks: Vec<SealedBlock>,
    pub rows: u64,
    /// BLAKE3 of the content, in hexadecimal.
    pub content: String,
}

impl Seal {
    pub fn to_metadata(&self) -> BTreeMap<String, String> {
        let blocks: Vec<String> =
            self.blocks.iter().map(|b| format!("{}:{}:{:08x}", b.rows, b.end, b.crc)).collect();
        let mut map: BTreeMap<String, String> = [
            (ROWS, self.rows.to_string()),
            (BLOCKS, blocks.join(" ")),
            (CONTENT, self.content.clone()),
        ]
        .into_iter()
        .map(|(k, v)| (k.to_string(), v))
        .collect();
        map.insert(SEAL.to_string(), format!("{:08x}", crc_of_entries(&map)));
        map
    }

    pub fn from_metadata(map: &BTreeMap<String, String>, place: &str) -> Result<Self> {
        let bad = |key: &str| damaged(place, format_args!("its footer's '{key}' does not hold"));
        let text = |key: &str| map.get(key).map(String::as_str).ok_or_else(|| bad(key));
        if u32::from_str_radix(text(SEAL)?, 16).ok() != Some(crc_of_entries(map)) {
            return Err(bad(SEAL));
        }
        let block = |text: &str| {
            let mut parts = text.split(':');
            let rows = parts.next()?.parse().ok()?;
            let end = parts.next()?.parse().ok()?;
            let crc = u32::from_str_radix(parts.next()?, 16).ok()?;
            parts.next().is_none().then_some(SealedBlock { rows, end, crc })
        };
        let blocks = text(BLOCKS)?.split(' ').map(block).collect::<Option<Vec<_>>>();
        let blocks = blocks.ok_or_else(|| bad(BLOCKS))?;
        let rows = text(ROWS)?.parse().map_err(|_| bad(ROWS))?;
        let sum = blocks.iter().try_fold(0_u64, |sum, b| sum.checked_add(b.rows));
        if sum != Some(rows) {
            return Err(bad(ROWS));
        }
        Ok(Seal { blocks, rows, content: text(CONTENT)?.to_string() })
    }
}

fn crc_of_entries(map: &BTreeMap<String, String>) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for (key, value) in map.iter().filter(|(key, _)| *key != SEAL) {
        hasher.update(key.as_bytes());
        hasher.update(b"=");
        hasher.update(value.as_bytes());
        hasher.update(b"\n");
    }
    hasher.finalize()
}

/// The error for a file whose bytes are not those that were written.
pub(crate) fn damaged(place: impl std::fmt::Display, what: impl std::fmt::Display) -> Error {
    Error::invalid(place, what, "the file is damaged: capture it again or restore a copy")
}

/// Counts and checksums what passes through to `inner`.
#[derive(Debug)]
pub(crate) struct SealingWriter<W> {
    inner: W,
    written: u64,
    crc: crc32fast::Hasher,
    blocks: Vec<SealedBlock>,
}

impl<W: Write> SealingWriter<W> {
    pub fn new(inner: W) -> Self {
        SealingWriter { inner, written: 0, crc: crc32fast::Hasher::new(), blocks: Vec::new() }
    }

    /// Ends a block of `rows` rows at the bytes written so far.
    pub fn end_block(&mut self, rows: u64) {
        let crc = std::mem::take(&mut self.crc).finalize();
        self.blocks.push(SealedBlock { rows, end: self.written, crc });
    }

    pub fn blocks(&self) -> &[SealedBlock] {
        &self.blocks
    }

    pub fn into_inner(self) -> W {
        self.inner
    }
}

impl<W: Write> Write for SealingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.inner.write(bytes)?;
        self.crc.update(&bytes[..n]);
        self.written += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seal() -> Seal {
        Seal {
            blocks: vec![
                SealedBlock { rows: 0, end: 512, crc: 0xdead_beef },
                SealedBlock { rows: 70, end: 4096, crc: 1 },
            ],
            rows: 70,
            content: "abc".into(),
        }
    }

    #[test]
    fn round_trip() {
        let seal = seal();
        assert_eq!(Seal::from_metadata(&seal.to_metadata(), "t").unwrap(), seal);
    }

    #[test]
    fn any_changed_entry_breaks_it() {
        let good = seal().to_metadata();
        for key in good.keys() {
            let mut map = good.clone();
            let value = map.get_mut(key).unwrap();
            let last = value.pop().unwrap();
            value.push(if last == '1' { '2' } else { '1' });
            assert!(Seal::from_metadata(&map, "t").is_err(), "{key}");
            map.remove(key);
            assert!(Seal::from_metadata(&map, "t").is_err(), "{key}");
        }
        let mut map = good.clone();
        map.insert("screendoor.extra".into(), "1".into());
        assert!(Seal::from_metadata(&map, "t").is_err());
    }
}
