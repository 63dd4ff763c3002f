//! Tests of bins.
