//! The errors of the library, sorted by whose fault they are.
//!
//! Every message says what is wrong, where, and what to do about it, in one
//! line: the command line prints it as it stands.

use std::any::Any;
use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// The library's result type.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why an operation failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused: a missing file, a full disk, no permission.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried, as a verb: `read`, `write`, `create`.
        action: &'static str,
        /// The file it was tried on.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A file is not what it claims to be: damaged, truncated, or inconsistent.
    #[error("{place}: {what}; {hint}")]
    Invalid {
        /// The file and, where known, the part of it.
        place: String,
        /// What is wrong there.
        what: String,
        /// What its owner can do.
        hint: String,
    },
    /// A file is well formed but asks for something this version does not do.
    #[error("{place}: {what}; {hint}")]
    Unsupported {
        /// The file and, where known, the part of it.
        place: String,
        /// What is asked for.
        what: String,
        /// What its owner can do.
        hint: String,
    },
    /// A GPU is missing, has failed, or cannot do what it is asked for.
    #[error("{adapter}: {what}; {hint}")]
    Gpu {
        /// Which one.
        adapter: String,
        /// What is wrong with it.
        what: String,
        /// What to install or to choose.
        hint: String,
    },
    /// The caller asked for something that does not exist or cannot be.
    #[error("{what}; {hint}")]
    Config {
        /// What is wrong with the request.
        what: String,
        /// What would be right.
        hint: String,
    },
}

impl Error {
    /// An [`Error::Io`] for `action` on `path`.
    pub fn io(action: &'static str, path: impl AsRef<Path>, source: io::Error) -> Self {
        Error::Io { action, path: path.as_ref().to_path_buf(), source }
    }

    /// An [`Error::Invalid`] at `place`.
    pub fn invalid(place: impl Display, what: impl Display, hint: impl Display) -> Self {
        Error::Invalid { place: place.to_string(), what: one_line(what), hint: one_line(hint) }
    }

    /// An [`Error::Unsupported`] at `place`.
    pub fn unsupported(place: impl Display, what: impl Display, hint: impl Display) -> Self {
        Error::Unsupported { place: place.to_string(), what: one_line(what), hint: one_line(hint) }
    }

    /// An [`Error::Gpu`] of `adapter`.
    pub fn gpu(adapter: impl Display, what: impl Display, hint: impl Display) -> Self {
        Error::Gpu { adapter: adapter.to_string(), what: one_line(what), hint: one_line(hint) }
    }

    /// An [`Error::Config`].
    pub fn config(what: impl Display, hint: impl Display) -> Self {
        Error::Config { what: what.to_string(), hint: hint.to_string() }
    }

    /// An [`Error::Config`] about a name that is not among `known`, naming the
    /// nearest one, whatever the case of its letters, or all of them where none is near.
    pub fn unknown<'a>(kind: &str, name: &str, known: impl IntoIterator<Item = &'a str>) -> Self {
        let known: Vec<&str> = known.into_iter().collect();
        let hint = match nearest(name, known.iter().copied()) {
            Some(k) => format!("did you mean '{k}'?"),
            _ if known.is_empty() => "there are none".to_string(),
            _ => format!("known: {}", known.join(", ")),
        };
        Error::config(format_args!("unknown {kind} '{name}'"), hint)
    }

    /// Whether the caller's request, rather than a file or the system, is at fault.
    pub fn is_config(&self) -> bool {
        matches!(self, Error::Config { .. })
    }
}

/// The name among `known` that is nearest to `name`, whatever the case of its letters, where
/// one is near.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let scored = known.into_iter().map(|k| (strsim::jaro_winkler(&name, &k.to_lowercase()), k));
    let (score, known) = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (score > 0.75).then_some(known)
}

/// What libraries and files say, fit for one line: each run of line breaks, tabs and other
/// control characters becomes a space.
pub fn one_line(text: impl Display) -> String {
    let text = text.to_string();
    let words: Vec<&str> = text.split(char::is_control).filter(|w| !w.is_empty()).collect();
    if words.len() < 2 { words.concat() } else { words.join(" ") }
}

/// What a panic said, in one line.
pub fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    one_line(text.unwrap_or("no reason is given"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_libraries_say_in_several_lines_becomes_one() {
        let error = Error::invalid("a.arrow", "unaligned.\n\twhile verifying\n\n", "replace it");
        assert_eq!(error.to_string(), "a.arrow: unaligned. while verifying; replace it");
        assert_eq!(one_line("as  it is"), "as  it is");
    }

    #[test]
    fn an_unknown_name_suggests_the_nearest() {
        let error = Error::unknown("design", "endertn", ["exact", "lk", "enderton"]);
        assert_eq!(error.to_string(), "unknown design 'endertn'; did you mean 'enderton'?");
        for (name, nearest) in [("LK", "lk"), ("Enderton", "enderton"), ("EXCAT", "exact")] {
            let error = Error::unknown("design", name, ["exact", "lk", "enderton"]).to_string();
            assert!(error.ends_with(&format!("did you mean '{nearest}'?")), "{error}");
        }
        let error = Error::unknown("design", "zzz", ["exact", "lk"]);
        assert_eq!(error.to_string(), "unknown design 'zzz'; known: exact, lk");
    }
}
