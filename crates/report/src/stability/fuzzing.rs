//! What fuzzing found.

use std::fmt::Write;

use serde::Deserialize;

use crate::markdown_table;
use crate::stability::in_cell;
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
pub(super) fn text(text: &mut String) -> Result<()> {
    let figures: Figures = parsed(FIGURES, "figures.toml")?;
    let findings: Findings = parsed(FOUND, "found.toml")?;
    let executions: u64 = figures.target.iter().map(|t| t.executions).sum();
    let failures: u64 = figures.target.iter().map(|t| t.failures).sum();
    let _ = writeln!(
        text,
        "## Fuzzing\n\n\
         Coverage-guided, libFuzzer through cargo-fuzz: `fuzz/run.sh` builds the targets of `fuzz/`, \
         runs them and writes the figures. {:.1} million executions in all, {failures} failures left. \
         A failure is a panic, an arithmetic overflow, an error of more than one line, a picture that \
         is not finite, an allocation of more than 256 MiB, 5 s without an answer. What is kept of \
         the corpus (`fuzz/seeds`) is taken by the same functions in every `cargo test`.\n",
        executions as f64 / 1e6
    );
    let rows: Vec<Vec<String>> = figures
        .target
        .iter()
        .map(|t| {
            let numbers = [t.executions, t.seconds, t.covered, t.corpus, t.failures];
            std::iter::once(format!("`{}`", t.name)).chain(numbers.map(|n| n.to_string())).collect()
        })
        .collect();
    let head =
        ["target", "executions", "seconds", "edges covered", "inputs that cover more", "failures"];
    text.push_str(&markdown_table(&head, &rows));
    text.push_str("\nFound, mended and kept:\n\n");
    let rows: Vec<Vec<String>> = findings
        .found
        .iter()
        .map(|f| {
            vec![format!("`{}`", f.target), in_cell(&f.what), in_cell(&f.mended), f.kept.clone()]
        })
        .collect();
    text.push_str(&markdown_table(&["target", "what", "mended", "kept"], &rows));
    text.push('\n');
    Ok(())
}
