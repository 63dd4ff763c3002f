//! What publications print or say, each beside what is measured here, with a verdict.

use serde::{Deserialize, Serialize};

use crate::document::Text;

/// One thing that a publication prints or says, beside what is measured here.
///
/// Each has its own [`Section`](super::Section), whose heading is [`Against::section`]. Its texts
/// are lines of CommonMark.
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
    /// What is printed, what is measured, the verdict: a paragraph each.
    pub(crate) fn paragraphs(&self) -> [Text; 3] {
        let Against { source, printed, measured, remark, .. } = self;
        let verdict = self.agreement.word();
        [
            format!("**Printed** ({source}): {printed}").into(),
            format!("**Measured**: {measured}").into(),
            format!("**Verdict**: {verdict}. {remark}").into(),
        ]
    }

    /// The verdict and what was measured, in a line.
    pub fn in_short(&self) -> Text {
        let Against { section, source, measured, agreement, .. } = self;
        format!("**{section}** ({source}): {}. {measured}", agreement.word()).into()
    }
}
