//! What designs and engines make of hard cases.

use std::fmt::Write;

use crate::param::Options;
use crate::report::markdown_table;
use crate::report::stability::short;
use crate::study::stress::{Facts, Finding, Group, Outcome, SIGNIFICANCE, Series, Stability};

pub(super) fn text(text: &mut String, found: &Stability) {
    let results = found.findings.len();
    let count = |of: fn(&Outcome) -> bool| found.findings.iter().filter(|f| of(&f.outcome)).count();
    let _ = writeln!(
        text,
        "## Hard cases\n\n\
         {} designs on {} cases: {} exact, {} within the stated bound, {} degraded, {} refused, {} \
         with pixels that are not finite, which the replay announces. {} promises are broken.\n",
        found.series.len(),
        found.cases.len(),
        count(|o| matches!(o, Outcome::Exact)),
        count(|o| matches!(o, Outcome::Within { .. })),
        count(|o| matches!(o, Outcome::Degraded { .. })),
        count(|o| matches!(o, Outcome::Refused { .. })),
        count(|o| matches!(o, Outcome::NotFinite { .. })),
        found.broken().count()
    );
    let _ = results;
    let _ = writeln!(
        text,
        "Engines: {}. Every picture is held against the plain text's of the same seed.\n",
        found.engines.join(", ")
    );
    let _ = SIGNIFICANCE;
    let mut messages = Vec::new();
    for (group, choice) in Group::ALL.iter().zip(Group::CHOICES) {
        let cases: Vec<&Facts> = found.cases.iter().filter(|c| c.group == *group).collect();
        let _ = writeln!(text, "### {}: {}\n", choice.name, choice.help);
        for case in &cases {
            let _ = writeln!(text, "- **{}**: {}", case.name, case.what);
        }
        text.push('\n');
        let head: Vec<&str> =
            std::iter::once("design").chain(cases.iter().map(|c| c.name.as_str())).collect();
        let rows: Vec<Vec<String>> =
            found.series.iter().map(|s| row(found, s, &cases, &mut messages)).collect();
        text.push_str(&markdown_table(&head, &rows));
        text.push('\n');
    }
    for (i, message) in messages.iter().enumerate() {
        let _ = writeln!(text, "{}. {message}", i + 1);
    }
    for (finding, why) in found.broken() {
        let _ = writeln!(text, "- broken: {} on {}: {why}", finding.design, finding.case);
    }
}

fn row(
    found: &Stability,
    series: &Series,
    cases: &[&Facts],
    messages: &mut Vec<String>,
) -> Vec<String> {
    let mut row = vec![format!("`{}`", series.name)];
    for case in cases {
        let finding = found.finding(&case.name, &series.name);
        row.push(finding.map_or_else(String::new, |f| cell(f, series.seeded, messages)));
    }
    row
}

fn cell(finding: &Finding, seeded: bool, messages: &mut Vec<String>) -> String {
    match &finding.outcome {
        Outcome::Exact => "=".to_string(),
        Outcome::Within { noise, .. } if seeded => format!("± {}", short(*noise)),
        Outcome::Within { error, .. } => format!("≤ {}", short(*error)),
        Outcome::Degraded { error, noise, .. } if seeded => {
            format!("off {} ± {}", short(*error), short(*noise))
        }
        Outcome::Degraded { error, .. } => format!("off {}", short(*error)),
        Outcome::NotFinite { pixels } => format!("{pixels} not finite"),
        Outcome::Refused { message } => {
            let known = messages.iter().position(|m| m == message);
            let number = known.unwrap_or_else(|| {
                messages.push(message.clone());
                messages.len() - 1
            });
            format!("refused ({})", number + 1)
        }
    }
}
