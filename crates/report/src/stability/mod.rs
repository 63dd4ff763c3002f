//! `docs/STABILITY.md`: hard cases, hostile input and faults.

mod cases;
mod correlations;
mod fuzzing;
mod system;

use crate::document::Section;
use screendoor_study::study::stress::Stability;
use screendoor_trace::error::Result;

/// The document; of what was not tried it says nothing.
///
/// # Errors
/// [`Error::Invalid`](screendoor_trace::error::Error::Invalid) where the figures of fuzzing are damaged.
pub fn stability(found: &Stability, command: &str) -> Result<Section> {
    let mut document = Section::new("Stability");
    let broken = found.broken();
    let verdict = match broken.len() {
        0 => "Everything below keeps what is promised of it.".to_string(),
        n => format!("**{n} promises are broken:**"),
    };
    document.paragraph(format!("Written by `{command}`, figures within sentences too. {verdict}"));
    if !broken.is_empty() {
        document.list(broken);
    }
    document.parts = sections(found);
    if !found.faults.is_empty() {
        document.parts.push(fuzzing::section()?);
    }
    Ok(document)
}

/// Its sections.
pub(crate) fn sections(found: &Stability) -> Vec<Section> {
    let mut sections =
        vec![cases::section(found), cases::unfit(found), correlations::section(found)];
    if !found.claims.is_empty() {
        sections.push(system::claims(found));
    }
    if !found.faults.is_empty() {
        sections.push(system::faults(found));
    }
    sections
}

/// A number in three digits.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_string();
    }
    if !(0.001..1000.0).contains(&value.abs()) {
        return format!("{value:.1e}");
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 4) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::study::record::Promise;
    use screendoor_study::study::stress::{
        Agreement, Claim, Facts, Fault, Finding, Outcome, Series, cases,
    };

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.5, 0.03164, 12.34, 999.9, 1e4, 2.5e-7, -0.25].map(short);
        assert_eq!(shown, ["0", "0.5", "0.0316", "12.3", "1000", "1.0e4", "2.5e-7", "-0.25"]);
    }

    fn made_up(outcome: Outcome, broken: Option<&str>) -> Stability {
        let case: Facts = cases()[0].facts(0);
        let finding = Finding {
            case: case.name.clone(),
            design: "lk".to_string(),
            outcome,
            engines: vec![Agreement {
                engine: "fast".into(),
                difference: Some(0.0),
                refused: None,
            }],
            broken: broken.map(str::to_string),
        };
        let lk = Series { name: "lk".to_string(), unbiased: Promise::Never, seeded: true };
        Stability {
            seeds: 2,
            unfit: Vec::new(),
            cases: vec![case],
            series: vec![lk],
            engines: vec!["reference".to_string()],
            findings: vec![finding],
            hashes: Vec::new(),
            pictures: Vec::new(),
            claims: vec![Claim {
                file: "a.arrow".into(),
                what: "much".into(),
                message: "no".into(),
                seconds: 0.01,
                bytes: 1 << 20,
                held: true,
            }],
            faults: vec![Fault::new("a|fault", "what")],
        }
    }

    #[test]
    fn what_is_broken_stands_first_and_every_outcome_has_its_words() {
        let noise = 0.25;
        for (outcome, cell) in [
            (Outcome::Exact, "| `lk` | = |"),
            (Outcome::Within { error: 0.1, bound: 0.2, noise }, "| `lk` | ± 0.25 |"),
            (Outcome::Degraded { error: 0.5, bound: 0.2, noise }, "| `lk` | off 0.5 ± 0.25 |"),
            (Outcome::NotFinite { pixels: 7 }, "| `lk` | **not finite** |"),
            (Outcome::Undecided { error: 0.1, bound: 0.2, noise }, "| `lk` | ± 0.25 ? |"),
            (Outcome::Refused { message: "too much".into() }, "| `lk` | refused (1) |"),
        ] {
            let text = stability(&made_up(outcome, None), "c").unwrap().to_markdown(1, ".");
            assert!(text.contains(cell), "{text}");
            assert!(text.contains("keeps what is promised") && text.contains("a\\|fault"));
        }
        let text = stability(&made_up(Outcome::Exact, Some("it lies")), "c").unwrap();
        let text = text.to_markdown(1, ".");
        assert!(
            text.contains("**1 promises are broken:**\n\n- lk on 'alpha 0': it lies"),
            "{text}"
        );
    }
}
