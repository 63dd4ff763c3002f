//! What fuzzing found.

use serde::Deserialize;

use crate::document::Section;
use screendoor_trace::error::{Error, Result};

const FIGURES: &str = include_str!("../../../../docs/fuzzing/figures.toml");
const FOUND: &str = include_str!("../../../../docs/fuzzing/found.toml");

/// What `fuzz/run.sh` has written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Figures {
    target: Vec<Target>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Target {
    name: String,
    executions: u64,
    seconds: u64,
    covered: u64,
    corpus: u64,
    failures: u64,
}

/// What was found over time.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Findings {
    #[serde(default)]
    found: Vec<Finding>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Finding {
    target: String,
    what: String,
    mended: String,
    kept: String,
}

fn parsed<'a, T: Deserialize<'a>>(text: &'a str, name: &str) -> Result<T> {
    toml::from_str(text)
        .map_err(|e| Error::invalid(format_args!("docs/fuzzing/{name}"), e, "mend it"))
}

/// # Errors
/// [`Error::Invalid`] where the figures of the tree are damaged.
pub(super) fn section() -> Result<Section> {
    let figures: Figures = parsed(FIGURES, "figures.toml")?;
    let findings: Findings = parsed(FOUND, "found.toml")?;
    let executions: u64 = figures.target.iter().map(|t| t.executions).sum();
    let failures: u64 = figures.target.iter().map(|t| t.failures).sum();
    let mut section = Section::new("Fuzzing");
    section.paragraph(format!(
        "Coverage-guided, libFuzzer through cargo-fuzz: `fuzz/run.sh` builds the targets of `fuzz/`, \
         runs them and writes the figures. {:.1} million executions in all, {failures} failures left. \
         A failure is a panic, an arithmetic overflow, an error of more than one line, a picture that \
         is not finite, an allocation of more than 256 MiB, 5 s without an answer. What is kept of \
         the corpus (`fuzz/seeds`) is taken by the same functions in every `cargo test`.",
        executions as f64 / 1e6
    ));
    let row = |t: &Target| {
        let numbers = [t.executions, t.seconds, t.covered, t.corpus, t.failures];
        std::iter::once(format!("`{}`", t.name)).chain(numbers.map(|n| n.to_string()))
    };
    let head =
        ["target", "executions", "seconds", "edges covered", "inputs that cover more", "failures"];
    section.table(head, figures.target.iter().map(row));
    section.paragraph("Found, mended and kept:");
    let row = |f: Finding| [format!("`{}`", f.target), f.what, f.mended, f.kept];
    section.table(["target", "what", "mended", "kept"], findings.found.into_iter().map(row));
    Ok(section)
}
