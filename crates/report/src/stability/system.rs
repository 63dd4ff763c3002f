//! Hostile files and faults of the system.

use crate::document::Section;
use screendoor_study::study::stress::{Claim, Fault, MOST_BYTES, MOST_SECONDS, Stability};

pub(super) fn claims(found: &Stability) -> Section {
    let held = found.claims.iter().filter(|c| c.held).count();
    let mut section = Section::new("False claims");
    section.paragraph(format!(
        "Files that claim what they do not hold are refused with one error line within {:.0} ms and \
         {} MiB: {held} of {}. Times from the start of the process to its end, the quickest of five; \
         memory is its most at a time.",
        MOST_SECONDS * 1e3,
        MOST_BYTES >> 20,
        found.claims.len()
    ));
    let row = |c: &Claim| {
        [
            format!("`{}`", c.file),
            c.what.clone(),
            format!("{:.1}", c.seconds * 1e3),
            format!("{:.1}", c.bytes as f64 / f64::from(1 << 20)),
            c.message.clone(),
        ]
    };
    section.table(["file", "claims", "ms", "MiB", "the error says"], found.claims.iter().map(row));
    section.paragraph("More hostile files, each with its error: `traces/hostile/README.md`.");
    section
}

pub(super) fn faults(found: &Stability) -> Section {
    let mut section = Section::new("Faults");
    section.paragraph(
        "The program is run again and again (a panic and a lost GPU are brought about within one \
         process), and each time something fails. It held if no file \
         stands half written under its name, what stood there before is there still or a whole new \
         file, nothing hangs, and the program says what happened where it is left to.",
    );
    let row = |f: &Fault| {
        let failures = f.failures.len();
        let lost = if failures == 0 { "0".into() } else { format!("**{failures}**") };
        [
            f.name.to_string(),
            f.what.to_string(),
            f.tries.to_string(),
            f.done.to_string(),
            f.survived.to_string(),
            lost,
            f.said.clone(),
        ]
    };
    let head =
        ["fault", "what was done", "tries", "did its work", "ended otherwise", "lost", "last word"];
    section.table(head, found.faults.iter().map(row));
    section.paragraph(
        "Studies are killed 50 times at random moments by \
         `cargo test --test it killed_fifty`: no finished result is lost, and what comes out in the \
         end is what an undisturbed run gives, byte for byte.",
    );
    section
}
