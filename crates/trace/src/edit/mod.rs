//! Traces made of traces: stored otherwise, cut, put together, in another order; and how two
//! differ.
//!
//! Each works in bounded memory, however long the traces are: fragments pass one by one, and
//! what has to be held together ([`Shuffle`], [`difference`]) is held in parts, for each of
//! which the trace is read again.

mod convert;
mod diff;
mod merge;
mod shuffle;
mod trim;

pub use convert::{Constants, Convert, ConvertOptions};
pub use diff::{
    ColumnDifference, Difference, FirstDifference, HeaderDifference, Kept, difference,
    header_differences,
};
pub use merge::{Merge, MergeOptions};
pub use shuffle::{Sequence, Shuffle, ShuffleOptions};
pub use trim::{Area, Trim, TrimOptions};

use std::io::Write;

use crate::error::Result;
use crate::trace::{Fragment, Header, Trace, TraceWriter};

/// Takes a fragment.
pub type Push<'a> = &'a mut dyn FnMut(&Fragment) -> Result<()>;
/// Is told how much is done, and of how much.
pub type Progress<'a> = &'a mut dyn FnMut(u64, u64);

/// A trace that is made of others.
pub trait Edit {
    /// What the new trace says of itself.
    fn header(&self) -> &Header;

    /// Hands the new trace's fragments to `push`, in their order.
    ///
    /// # Errors
    /// Those of reading the traces, and those of `push`.
    fn fragments(&self, push: Push<'_>, progress: Progress<'_>) -> Result<()>;

    /// How many of the fragments that were handed out last have colours that lose something in
    /// the new trace's precision, where the edit changes that.
    fn rounded(&self) -> u64 {
        0
    }
}

/// Hands the fragments of an edit to the writer of a trace with [`Edit::header`].
///
/// # Errors
/// As [`Edit::fragments`] and [`TraceWriter::push`].
pub fn write<W: Write>(
    edit: &dyn Edit,
    writer: &mut TraceWriter<W>,
    progress: Progress<'_>,
) -> Result<()> {
    edit.fragments(&mut |fragment| writer.push(fragment), progress)
}

/// Calls `each` with every fragment of `trace` and its row; `done` rows of `of` came before.
fn each_row(
    trace: &Trace,
    (mut done, of): (u64, u64),
    progress: Progress<'_>,
    mut each: impl FnMut(u64, Fragment) -> Result<()>,
) -> Result<()> {
    let mut row = 0;
    for batch in trace.batches() {
        let batch = batch?;
        for fragment in batch.iter() {
            each(row, fragment)?;
            row += 1;
        }
        done += batch.len() as u64;
        progress(done, of);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
