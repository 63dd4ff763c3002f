//! The integration tests: one binary, one file a subject.

mod trace_file;
mod util;
