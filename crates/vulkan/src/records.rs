//! The records of fragments: read as a stream, counted by draw, and put into API order in
//! bounded memory.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use screendoor_trace::error::{Error, Result};
use screendoor_vulkan_layer::log::{RECORD_BYTES, Record, Submission};

use crate::folder::DeviceCapture;

/// Records read at a time.
const CHUNK: u64 = 1 << 14;

/// What a record takes while it is held.
pub(crate) const HELD: u64 = size_of::<Record>() as u64;

/// The records of one submission.
#[derive(Clone, Copy)]
pub(crate) struct Records<'a> {
    capture: &'a DeviceCapture,
    submission: &'a Submission,
}

impl<'a> Records<'a> {
    pub(crate) fn of(capture: &'a DeviceCapture, submission: &'a Submission) -> Self {
        Records { capture, submission }
    }

    /// Calls `each` with all of them as they stand in the file.
    pub(crate) fn each(&self, mut each: impl FnMut(Record) -> Result<()>) -> Result<()> {
        let path = &self.capture.files.records;
        let fail = |e| Error::io("read", path, e);
        let mut left = self.submission.records;
        if left == 0 {
            return Ok(());
        }
        let mut file = File::open(path).map_err(fail)?;
        let start = self.submission.first * RECORD_BYTES as u64;
        file.seek(SeekFrom::Start(start)).map_err(fail)?;
        let mut buffer = vec![0; left.min(CHUNK) as usize * RECORD_BYTES];
        while left > 0 {
            let n = left.min(CHUNK);
            let bytes = &mut buffer[..n as usize * RECORD_BYTES];
            file.read_exact(bytes).map_err(fail)?;
            for bytes in bytes.chunks_exact(RECORD_BYTES) {
                // A chunk has the length of one.
                each(Record::from_bytes(bytes).unwrap_or_default())?;
            }
            left -= n;
        }
        Ok(())
    }

    /// How many each event of the submission has: 0 for what is no draw.
    ///
    /// # Errors
    /// [`Error::Invalid`] for one of a draw that the log does not have.
    pub(crate) fn counts(&self) -> Result<Vec<u64>> {
        let slots = DeviceCapture::slots(self.submission);
        let mut counts = vec![0; self.submission.events.len()];
        // Records of a draw lie together.
        let mut last = None;
        self.each(|record| {
            let event = match last {
                Some((slot, event)) if slot == record.slot => event,
                _ => *slots.get(&record.slot).ok_or_else(|| self.unknown(&record))?,
            };
            last = Some((record.slot, event));
            counts[event] += 1;
            Ok(())
        })?;
        Ok(counts)
    }

    fn unknown(&self, record: &Record) -> Error {
        Error::invalid(
            self.capture.files.records.display(),
            format_args!(
                "submission {} has a record of draw {}, which its log does not have",
                self.submission.number, record.slot
            ),
            "capture anew",
        )
    }

    /// Calls `each` with the records of the draws that `ordinals` gives a place by their slots, in
    /// the order of the places, then by instance, primitive and pixel. [`Record::slot`] is the
    /// place. At most `memory` bytes of records are held at a time: for each part of the order
    /// that fits, the file is read again.
    pub(crate) fn in_order(
        &self,
        ordinals: &HashMap<u32, u32>,
        memory: u64,
        each: &mut dyn FnMut(Record) -> Result<()>,
    ) -> Result<()> {
        let sort = Sort { records: *self, ordinals, most: (memory / HELD).max(1) };
        let all = Keys { first: 0, last: u128::MAX };
        if self.submission.records <= sort.most {
            return sort.gather(all, self.submission.records, each);
        }
        let mut bin = Bin::default();
        sort.among(all, |key, _| {
            bin.add(key);
            Ok(())
        })?;
        sort.hand(bin, each)
    }
}

/// Keys from the first to the last, both included.
#[derive(Clone, Copy)]
struct Keys {
    first: u128,
    last: u128,
}

/// Records of a range of keys: how many there are, and their least and greatest key.
#[derive(Clone, Copy)]
struct Bin {
    count: u64,
    keys: Keys,
}

impl Default for Bin {
    fn default() -> Self {
        Bin { count: 0, keys: Keys { first: u128::MAX, last: 0 } }
    }
}

impl Bin {
    fn add(&mut self, key: u128) {
        self.join(&Bin { count: 1, keys: Keys { first: key, last: key } });
    }

    fn join(&mut self, other: &Bin) {
        self.count += other.count;
        self.keys.first = self.keys.first.min(other.keys.first);
        self.keys.last = self.keys.last.max(other.keys.last);
    }
}

/// Into how many ranges keys are counted at a time.
const RANGES: u128 = 1 << 14;

struct Sort<'a> {
    records: Records<'a>,
    ordinals: &'a HashMap<u32, u32>,
    /// Records that are held at a time.
    most: u64,
}

/// API order, and by pixels within a primitive.
fn key(record: &Record) -> u128 {
    let word = |value: u32, place: u32| u128::from(value) << (32 * place);
    word(record.slot, 3)
        | word(record.instance, 2)
        | word(record.primitive, 1)
        | word(record.place, 0)
}

/// What tells pieces of one primitive in one pixel apart: the one that covers most comes first,
/// and nothing depends on the order of recording.
fn rest(record: &Record) -> [u32; 9] {
    let [r, g, b, a] = record.colour.map(f32::to_bits);
    let covered = 32 - (record.coverage & !FRONT).count_ones();
    let [z, dx, dy] = [record.z, record.dzdx, record.dzdy].map(f32::to_bits);
    [covered, record.coverage, z, dx, dy, r, g, b, a]
}

/// The bit of [`Record::coverage`] that says that the front shows.
pub(crate) const FRONT: u32 = 1 << 31;

impl Sort<'_> {
    /// Calls `each` with the records whose keys are among `keys`, and their keys.
    fn among(&self, keys: Keys, mut each: impl FnMut(u128, Record) -> Result<()>) -> Result<()> {
        let mut last = None;
        self.records.each(|mut record| {
            let ordinal = match last {
                Some((slot, ordinal)) if slot == record.slot => ordinal,
                _ => self.ordinals.get(&record.slot).copied(),
            };
            last = Some((record.slot, ordinal));
            let Some(ordinal) = ordinal else { return Ok(()) };
            record.slot = ordinal;
            let key = key(&record);
            if (keys.first..=keys.last).contains(&key) { each(key, record) } else { Ok(()) }
        })
    }

    /// Hands on at most `count` records of these keys, which fit into memory.
    fn gather(
        &self,
        keys: Keys,
        count: u64,
        each: &mut dyn FnMut(Record) -> Result<()>,
    ) -> Result<()> {
        let mut held: Vec<Record> = Vec::new();
        held.reserve_exact(count as usize);
        self.among(keys, |_, record| {
            held.push(record);
            Ok(())
        })?;
        held.sort_unstable_by(|a, b| key(a).cmp(&key(b)).then_with(|| rest(a).cmp(&rest(b))));
        held.into_iter().try_for_each(each)
    }

    /// Hands on the records of a bin.
    fn hand(&self, bin: Bin, each: &mut dyn FnMut(Record) -> Result<()>) -> Result<()> {
        let Bin { count, keys } = bin;
        if count == 0 {
            return Ok(());
        }
        if count <= self.most {
            return self.gather(keys, count, each);
        }
        if keys.first == keys.last {
            // No program leaves so many pieces of one primitive in one pixel.
            return self.among(keys, |_, record| each(record));
        }
        let step = (keys.last - keys.first) / RANGES + 1;
        let bins = ((keys.last - keys.first) / step + 1) as usize;
        let mut bins = vec![Bin::default(); bins];
        self.among(keys, |key, _| {
            bins[((key - keys.first) / step) as usize].add(key);
            Ok(())
        })?;
        let mut together = Bin::default();
        for bin in bins {
            if together.count > 0 && together.count + bin.count > self.most {
                self.hand(std::mem::take(&mut together), each)?;
            }
            together.join(&bin);
        }
        self.hand(together, each)
    }
}
