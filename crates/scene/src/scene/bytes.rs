//! Reading little-endian numbers from bytes that may end too early.

use std::fmt::Display;

use screendoor_trace::error::{Error, Result};

/// The bytes of a file from some place on.
pub(super) struct Bytes<'a> {
    /// The file, for errors.
    place: &'a str,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bytes<'a> {
    pub(super) fn new(place: &'a str, bytes: &'a [u8]) -> Self {
        Bytes { place, bytes, at: 0 }
    }

    /// The file, for errors.
    pub(super) fn place(&self) -> &'a str {
        self.place
    }

    /// How many bytes come before the next.
    pub(super) fn at(&self) -> usize {
        self.at
    }

    /// How many bytes are left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Goes to where `at` bytes come before the next.
    pub(super) fn seek(&mut self, at: u64) -> Result<()> {
        match usize::try_from(at) {
            Ok(at) if at <= self.bytes.len() => {
                self.at = at;
                Ok(())
            }
            _ => Err(self.bad(format_args!("it points at byte {at}, beyond its end"))),
        }
    }

    /// The next bytes.
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        if count > self.left() {
            let (at, left) = (self.at, self.left());
            let what = format_args!("it has {left} bytes from byte {at} on and needs {count}");
            return Err(self.bad(what));
        }
        let taken = &self.bytes[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        Ok(self.take(N)?.try_into().expect("as many as were asked for"))
    }

    pub(super) fn u8(&mut self) -> Result<u8> {
        Ok(self.array::<1>()?[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn i32(&mut self) -> Result<i32> {
        self.array().map(i32::from_le_bytes)
    }

    pub(super) fn i64(&mut self) -> Result<i64> {
        self.array().map(i64::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Result<f32> {
        self.array().map(f32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Result<f64> {
        self.array().map(f64::from_le_bytes)
    }

    /// The error that the file is not what it claims to be.
    pub(super) fn bad(&self, what: impl Display) -> Error {
        Error::invalid(self.place, what, "it is truncated or damaged: export it again")
    }

    /// The error that the file asks for what is not read.
    pub(super) fn unsupported(&self, what: impl Display, hint: impl Display) -> Error {
        Error::unsupported(self.place, what, hint)
    }
}
