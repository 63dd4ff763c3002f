//! The four papers line by line: every mechanism, figure, table and claim, where it is here, and the
//! verdict of the section of RESULTS.md that measures it.

use serde::Deserialize;

use crate::document::{Agreement, Section, Text};
use crate::html::verification::anchor;
use crate::html::words::counted;

/// A paper.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Paper {
    title: String,
    row: Vec<Row>,
}

/// A thing that it describes, shows or says.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    /// Where in the paper.
    at: String,
    kind: Kind,
    what: String,
    /// What of it is here; empty where nothing is.
    #[serde(default)]
    here: String,
    /// The section of RESULTS.md whose verdict it has.
    section: Option<String>,
    /// What is lacking, and why.
    #[serde(default)]
    lacks: String,
    /// What else there is to say.
    #[serde(default)]
    note: String,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Mechanism,
    Figure,
    Table,
    Claim,
}

/// How a row stands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Standing {
    /// Measured, with this verdict.
    Measured(Agreement),
    /// Its section is not in this document.
    Unmeasured,
    /// There, without a verdict of its own.
    There,
    /// Some of it is.
    InPart,
    Lacking,
}

impl Standing {
    const ALL: [Standing; 7] = [
        Standing::Measured(Agreement::Confirmed),
        Standing::Measured(Agreement::InPart),
        Standing::Measured(Agreement::Differs),
        Standing::There,
        Standing::InPart,
        Standing::Unmeasured,
        Standing::Lacking,
    ];

    fn word(self) -> &'static str {
        match self {
            Standing::Measured(agreement) => agreement.word(),
            Standing::Unmeasured => "not measured here",
            Standing::There => "there, no verdict",
            Standing::InPart => "there in part",
            Standing::Lacking => "not there",
        }
    }
}

const PAPERS: [&str; 4] = [
    include_str!("papers/enderton.toml"),
    include_str!("papers/wyman.toml"),
    include_str!("papers/object_space.toml"),
    include_str!("papers/laine_karras.toml"),
];

fn papers() -> impl Iterator<Item = Paper> {
    PAPERS.iter().map(|text| toml::from_str(text).expect("the papers' rows are tested"))
}

/// The verdict of a section of the document.
fn verdict(document: &str, section: &str) -> Option<Agreement> {
    let (_, own) = document.split_once(&format!("\n## {section}\n"))?;
    let own = own.split("\n## ").next()?;
    let (_, said) = own.split_once("**Verdict**: ")?;
    let word = said.split('.').next()?;
    use Agreement::{Confirmed, Differs, InPart};
    [Confirmed, InPart, Differs].into_iter().find(|agreement| agreement.word() == word)
}

fn standing(document: &str, row: &Row) -> Standing {
    match &row.section {
        Some(section) => {
            verdict(document, section).map_or(Standing::Unmeasured, Standing::Measured)
        }
        None if row.here.is_empty() => Standing::Lacking,
        None if row.lacks.is_empty() => Standing::There,
        None => Standing::InPart,
    }
}

fn cells(document: &str, row: &Row) -> [Text; 5] {
    let kind = match row.kind {
        Kind::Mechanism => "mechanism",
        Kind::Figure => "figure",
        Kind::Table => "table",
        Kind::Claim => "claim",
    };
    let lacks = if row.lacks.is_empty() { String::new() } else { format!("*{}*", row.lacks) };
    let said = [row.here.as_str(), row.note.as_str(), lacks.as_str()];
    let here = said.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ");
    let standing = standing(document, row);
    let verdict = match (&row.section, standing) {
        (Some(section), Standing::Measured(_)) => {
            format!("[{}](#{})", standing.word(), anchor(section))
        }
        _ => standing.word().to_string(),
    };
    [row.at.as_str().into(), kind.into(), row.what.as_str().into(), here.into(), verdict.into()]
}

/// The section on all four, with the verdicts of `document`; `None` where that has none yet.
pub(super) fn section(document: &str) -> Option<Section> {
    if !document.contains("**Verdict**: ") {
        return None;
    }
    let mut section = Section::new("The four papers line by line");
    section.paragraph(
        "Every mechanism, figure, table and claim of the papers that this project is built on, where it is \
         here, and the verdict of the section that measures it. *There, no verdict*: it is built, and held \
         by the tests that are named or shown by the section that is, which sets nothing against print. What \
         is lacking is said in italics. Models of the papers are not public; milliseconds and frame \
         rates of hardware of their day cannot be measured again.",
    );
    for paper in papers() {
        let mut part = Section::new(Text::plain(&paper.title));
        let standings: Vec<Standing> =
            paper.row.iter().map(|row| standing(document, row)).collect();
        let count = |wanted: Standing| standings.iter().filter(|s| **s == wanted).count();
        let counts = Standing::ALL.into_iter().map(|s| (count(s), s.word()));
        let counts: Vec<String> =
            counts.filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}")).collect();
        part.paragraph(format!("{}: {}.", counted(paper.row.len(), "row"), counts.join("; ")));
        let rows: Vec<[Text; 5]> = paper.row.iter().map(|row| cells(document, row)).collect();
        part.table(["where", "kind", "what", "here", "verdict"], rows);
        section.parts.push(part);
    }
    Some(section)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCUMENT: &str = include_str!("../../../../docs/RESULTS.md");

    #[test]
    fn every_section_that_is_named_has_a_verdict_and_every_lack_its_reason() {
        let mut rows = 0;
        for paper in papers() {
            assert!(paper.row.len() > 10, "{}", paper.title);
            for row in &paper.row {
                let place = format!("{}, {}: {}", paper.title, row.at, row.what);
                if let Some(section) = &row.section {
                    assert!(verdict(DOCUMENT, section).is_some(), "{place}: {section}");
                } else {
                    assert!(!row.here.is_empty() || !row.lacks.is_empty(), "{place}");
                }
                let long = [&row.what, &row.lacks, &row.note].iter().any(|s| s.len() > 200);
                assert!(!long, "{place}");
                rows += 1;
            }
        }
        assert!(rows >= 250, "{rows}");
    }

    #[test]
    fn the_document_has_the_table_as_it_is() {
        let section = section(DOCUMENT).unwrap().to_markdown(2, "figures");
        assert!(
            DOCUMENT.ends_with(&section),
            "docs/RESULTS.md lacks it; `screendoor reproduce --part shadows -o docs` writes it"
        );
    }

    #[test]
    fn verdicts_are_the_documents() {
        let document = "# R\n\n## A\n\n**Verdict**: confirmed in part. So.\n\n## B\n\nNone.\n\n\
                        ## C\n\n**Verdict**: differs. No.\n";
        assert_eq!(verdict(document, "A"), Some(Agreement::InPart));
        assert_eq!((verdict(document, "B"), verdict(document, "D")), (None, None));
        assert_eq!(verdict(document, "C"), Some(Agreement::Differs));
        assert!(section("# R\n").is_none());
        let text = section(document).unwrap().to_markdown(2, ".");
        assert!(text.contains("not measured here") && text.contains("not there"), "{text}");
    }
}
