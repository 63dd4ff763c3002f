//! The seal of a trace file: what lets a reader trust bytes before decoding them.
//!
//! Arrow IPC carries no checksums. The seal puts them into the footer's custom
//! metadata, as text: for the file's head and for each record batch its row
//! count, the offset at which it ends, and the CRC-32 of its bytes; then the
//! total row count, the content hash, the CRC-32 of the file's tail, which is all
//! that follows the last batch, and a CRC-32 over these entries themselves. A
//! damaged block thus contradicts the footer, and a damaged tail itself: no bit of
//! a file can change unnoticed.
//!
//! The two last entries lie in the tail that the first of them covers: there their
//! digits are taken as zeros. Seals from before there was a checksum of the tail
//! leave parts of the footer uncovered and are read as they are.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::ops::Range;

use arrow_ipc::root_as_footer;

use crate::error::{Error, Result};
use crate::trace::layout::footer_range;

pub(crate) const ROWS: &str = "screendoor.rows";
pub(crate) const BLOCKS: &str = "screendoor.blocks";
pub(crate) const CONTENT: &str = "screendoor.content";
pub(crate) const TAIL: &str = "screendoor.tail";
pub(crate) const SEAL: &str = "screendoor.seal";
/// Their digits cannot be part of what they are computed from.
const MASKED: [&str; 2] = [TAIL, SEAL];
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
    /// CRC-32 of all bytes after the last block; older seals lack it.
    pub tail: Option<u32>,
}

impl Seal {
    /// Whether the footer holds any entry of a seal.
    pub(super) fn is_in(map: &BTreeMap<String, String>) -> bool {
        [ROWS, BLOCKS, CONTENT, TAIL, SEAL].iter().any(|key| map.contains_key(*key))
    }

    pub(super) fn to_metadata(&self) -> BTreeMap<String, String> {
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
        if let Some(tail) = self.tail {
            map.insert(TAIL.to_string(), digits(tail));
        }
        map.insert(SEAL.to_string(), digits(crc_of_entries(&map)));
        map
    }

    pub(super) fn from_metadata(map: &BTreeMap<String, String>, place: &str) -> Result<Self> {
        let bad = |key: &str| damaged(place, format_args!("its footer's '{key}' does not hold"));
        let text = |key: &str| map.get(key).map(String::as_str).ok_or_else(|| bad(key));
        let tail = match map.get(TAIL) {
            // One spelling only, or a changed digit could say the same.
            Some(tail) => {
                let crc = u32::from_str_radix(tail, 16).map_err(|_| bad(TAIL))?;
                if *tail != digits(crc) {
                    return Err(bad(TAIL));
                }
                if text(SEAL)? != digits(crc_of_entries(map)) {
                    return Err(bad(SEAL));
                }
                Some(crc)
            }
            None if u32::from_str_radix(text(SEAL)?, 16).ok() == Some(crc_of_entries(map)) => None,
            None => return Err(bad(SEAL)),
        };
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
        Ok(Seal { blocks, rows, content: text(CONTENT)?.to_string(), tail })
    }

    /// Holds `tail`, the bytes after the last block, to their checksum.
    pub(super) fn check_tail(&self, tail: &[u8], place: &str) -> Result<()> {
        let Some(stored) = self.tail else { return Ok(()) };
        let found = masked_places(tail).map(|places| crc_of_tail(tail, &places));
        if found == Some(stored) {
            return Ok(());
        }
        Err(damaged(place, "its footer's bytes are not those that its checksum was made of"))
    }
}

fn digits(crc: u32) -> String {
    format!("{crc:08x}")
}

/// Where the digits of each of [`MASKED`] lie in a file's tail.
fn masked_places(tail: &[u8]) -> Option<[Range<usize>; 2]> {
    let range = footer_range(tail)?;
    let footer = root_as_footer(&tail[range.clone()]).ok()?;
    let entries = footer.custom_metadata()?;
    let place = |key: &str| {
        let value = entries.iter().find(|entry| entry.key() == Some(key))?.value()?;
        // The value is a slice of the footer itself.
        let start = value.as_ptr() as usize - tail.as_ptr() as usize;
        (value.len() == 8).then_some(start..start + 8)
    };
    let [a, b] = [place(MASKED[0])?, place(MASKED[1])?];
    (a.end <= b.start || b.end <= a.start).then_some([a, b])
}

/// The CRC-32 of a tail with zeros at the masked places.
fn crc_of_tail(tail: &[u8], [a, b]: &[Range<usize>; 2]) -> u32 {
    let (first, second) = if a.start < b.start { (a, b) } else { (b, a) };
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&tail[..first.start]);
    hasher.update(&[b'0'; 8]);
    hasher.update(&tail[first.end..second.start]);
    hasher.update(&[b'0'; 8]);
    hasher.update(&tail[second.end..]);
    hasher.finalize()
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

/// Counts and checksums what passes through to `inner`, and seals the tail.
#[derive(Debug)]
pub(crate) struct SealingWriter<W> {
    inner: W,
    written: u64,
    crc: crc32fast::Hasher,
    blocks: Vec<SealedBlock>,
    /// The seal that is under way, and the tail's bytes, which are held back.
    tail: Option<(Seal, Vec<u8>)>,
}

impl<W: Write> SealingWriter<W> {
    pub(super) fn new(inner: W) -> Self {
        SealingWriter {
            inner,
            written: 0,
            crc: crc32fast::Hasher::new(),
            blocks: Vec::new(),
            tail: None,
        }
    }

    /// Ends a block of `rows` rows at the bytes written so far.
    pub(super) fn end_block(&mut self, rows: u64) {
        let crc = std::mem::take(&mut self.crc).finalize();
        self.blocks.push(SealedBlock { rows, end: self.written, crc });
    }

    /// Begins the tail; what is returned are the footer's entries, two of which
    /// [`SealingWriter::finish`] fills in.
    pub(super) fn begin_tail(&mut self, rows: u64, content: String) -> BTreeMap<String, String> {
        let blocks = std::mem::take(&mut self.blocks);
        let seal = Seal { blocks, rows, content, tail: Some(0) };
        let entries = seal.to_metadata();
        self.tail = Some((seal, Vec::new()));
        entries
    }

    /// Seals the tail and passes it on; the sink, and the bytes before the tail.
    pub(super) fn finish(mut self) -> io::Result<(W, u64)> {
        if let Some((mut seal, mut tail)) = self.tail {
            let places = masked_places(&tail).expect("the footer holds its own entries");
            seal.tail = Some(crc_of_tail(&tail, &places));
            let entries = seal.to_metadata();
            for (key, place) in MASKED.into_iter().zip(places) {
                tail[place].copy_from_slice(entries[key].as_bytes());
            }
            self.inner.write_all(&tail)?;
            self.inner.flush()?;
        }
        Ok((self.inner, self.written))
    }
}

impl<W: Write> Write for SealingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some((_, tail)) = &mut self.tail {
            tail.extend_from_slice(bytes);
            return Ok(bytes.len());
        }
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
            tail: Some(0x00ab_cdef),
        }
    }

    #[test]
    fn round_trip() {
        for tail in [Some(0x00ab_cdef), None] {
            let seal = Seal { tail, ..seal() };
            assert_eq!(Seal::from_metadata(&seal.to_metadata(), "t").unwrap(), seal);
        }
    }

    #[test]
    fn a_seal_has_one_spelling() {
        for key in MASKED {
            let mut map = seal().to_metadata();
            let spelt = map[key].to_uppercase();
            assert_ne!(spelt, map[key]);
            map.insert(key.into(), spelt);
            assert!(Seal::from_metadata(&map, "t").is_err(), "{key}");
        }
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
