//! Reading the metadata of a trace's schema.

use std::collections::BTreeMap;

use crate::error::{Error, Result};

/// Reads entries by their keys; errors name the key.
pub(super) struct MetadataReader<'a> {
    /// The entries.
    pub map: &'a BTreeMap<String, String>,
    /// Whose they are.
    pub place: &'a str,
}

impl MetadataReader<'_> {
    pub(super) fn text(&self, key: &str) -> Result<&str> {
        self.map.get(key).map(String::as_str).ok_or_else(|| {
            Error::invalid(
                self.place,
                format_args!("the metadata '{key}' is missing"),
                "this is not a screendoor trace, or it was written without its schema metadata",
            )
        })
    }

    /// The error for an entry whose text is not what is `wanted`.
    pub(super) fn bad(&self, key: &str, wanted: &str) -> Error {
        let text = self.map.get(key).map_or("", String::as_str);
        let text: String = text.chars().take(40).collect();
        self.wrong(key, format_args!("'{text}' is not {wanted}"))
    }

    /// The error for an entry of which `what` is wrong.
    pub(super) fn wrong(&self, key: &str, what: impl std::fmt::Display) -> Error {
        let place = format_args!("{}, metadata '{key}'", self.place).to_string();
        Error::invalid(place, what, "correct the writer of the trace (docs/TRACE_FORMAT.md)")
    }

    pub(super) fn parse<T: std::str::FromStr>(&self, key: &str, wanted: &str) -> Result<T> {
        self.text(key)?.parse().map_err(|_| self.bad(key, wanted))
    }

    pub(super) fn list<T>(
        &self,
        key: &str,
        wanted: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<Vec<T>> {
        let items = self.text(key)?.split_whitespace().map(parse).collect::<Option<Vec<_>>>();
        items.ok_or_else(|| self.bad(key, wanted))
    }
}
