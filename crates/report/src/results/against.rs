//! What publications print or say, each beside what is measured here, with a verdict.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use screendoor_study::metrics::Estimate;

/// One thing that a publication prints or says, beside what is measured here.
///
/// Each has its own section in a [`Document`](super::Document), under the heading
/// [`Against::section`]. Serialises to JSON, so that it can be stored beside the document.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Against {
    /// The section's heading.
    pub section: String,
    /// The publication, and where in it.
    pub source: String,
    /// What it prints or says.
    pub printed: String,
    /// What is measured here, in a line.
    pub measured: String,
    /// Whether the two agree.
    pub agreement: Agreement,
    /// In what they do, or do not.
    pub remark: String,
}

/// How what is measured agrees with what is printed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Agreement {
    /// All that is printed or said is found.
    Confirmed,
    /// Some of it is found.
    InPart,
    /// It is not found.
    Differs,
}

impl Agreement {
    /// How many of some statements hold: all, none, or some.
    pub fn of(statements: &[bool]) -> Self {
        match statements.iter().filter(|holds| **holds).count() {
            n if n == statements.len() => Agreement::Confirmed,
            0 => Agreement::Differs,
            _ => Agreement::InPart,
        }
    }

    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            Agreement::Confirmed => "confirmed",
            Agreement::InPart => "confirmed in part",
            Agreement::Differs => "differs",
        }
    }
}

impl Against {
    /// Opens the section: its heading, what is printed, what is measured, the verdict.
    pub(super) fn open(&self, text: &mut String) {
        let Against { section, source, printed, measured, remark, .. } = self;
        let verdict = self.agreement.word();
        let _ = writeln!(
            text,
            "## {section}\n\n\
             **Printed** ({source}): {printed}\n\n\
             **Measured**: {measured}\n\n\
             **Verdict**: {verdict}. {remark}\n"
        );
    }
}

/// Whether an estimate lies below a bound by more than its interval.
pub(super) fn below(e: Estimate, bound: f64) -> bool {
    e.high < bound
}

/// The same above it.
pub(super) fn above(e: Estimate, bound: f64) -> bool {
    e.low > bound
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_agree_wholly_in_part_or_not() {
        assert_eq!(Agreement::of(&[true, true]), Agreement::Confirmed);
        assert_eq!(Agreement::of(&[true, false]), Agreement::InPart);
        assert_eq!(Agreement::of(&[false, false]), Agreement::Differs);
    }
}
