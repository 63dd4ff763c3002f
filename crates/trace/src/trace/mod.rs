//! The trace: a recorded stream of fragments, and its file.
//!
//! A trace is what a rasteriser hands to the raster-operations unit, in API
//! order: one [`Fragment`] for each primitive and pixel, with its coverage, its
//! depth plane, its colour and its alpha. It lives in an Arrow IPC file
//! (`docs/TRACE_FORMAT.md`); [`TraceWriter`] and [`Trace`] stream it batch by
//! batch, so that neither side ever holds the whole.

#[cfg(target_endian = "big")]
compile_error!("traces are little-endian and are read without conversion");

mod batch;
mod bins;
mod block;
mod cells;
mod column;
mod columns;
mod content;
mod decompress;
mod fragment;
mod header;
mod layout;
mod metadata;
#[cfg(test)]
mod optional;
mod other;
mod read;
mod seal;
mod stats;
mod stored;
mod stored_file;
mod stream;
mod ties;
mod view;
mod write;

pub use batch::{Batch, MAX_BATCH_ROWS};
pub use bins::{Bins, RowPlace, TileRows, Tiles, TraceMark, Wanted};
pub use block::{BLOCK, Block};
pub use cells::{ChannelColumn, CoverageColumn};
pub use column::{Column, Native, Scalar, ValueType};
pub use columns::{ColumnId, ColumnKind, ColumnSet, OptionalValues};
pub use fragment::{DepthPlane, Fragment, MAX_SAMPLES, SampleMask, Unorm32};
pub use header::{ColourFormat, FORMAT_VERSION, Header, MAX_SIDE, SamplePattern};
pub use read::{Checksums, Trace};
pub use stats::{
    AlphaStatistics, Distribution, Objects, Statistics, statistics, statistics_within,
};
pub use ties::{tied_fragments, tied_fragments_within};
pub use view::{Projection, View};
pub use write::{Compression, TraceWriter, WriteOptions, Written};
