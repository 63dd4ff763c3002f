//! Hostile files and faults of the system.

use std::fmt::Write;

use crate::markdown_table;
use crate::stability::in_cell;
use screendoor_study::study::stress::{MOST_BYTES, MOST_SECONDS, Stability};

pub(super) fn claims(text: &mut String, found: &Stability) {
    let held = found.claims.iter().filter(|c| c.held).count();
    let _ = writeln!(
        text,
        "## False claims\n\n\
         Files that claim what they do not hold are refused with one error line within {:.0} ms and \
         {} MiB: {held} of {}. Times from the start of the process to its end, the quickest of five; \
         memory is its most at a time.\n",
        MOST_SECONDS * 1e3,
        MOST_BYTES >> 20,
        found.claims.len()
    );
    let rows: Vec<Vec<String>> = found
        .claims
        .iter()
        .map(|c| {
            vec![
                format!("`{}`", c.file),
                c.what.clone(),
                format!("{:.1}", c.seconds * 1e3),
                format!("{:.1}", c.bytes as f64 / f64::from(1 << 20)),
                in_cell(&c.message),
            ]
        })
        .collect();
    text.push_str(&markdown_table(&["file", "claims", "ms", "MiB", "the error says"], &rows));
    text.push_str("\nMore hostile files, each with its error: `traces/hostile/README.md`.\n\n");
}

pub(super) fn faults(text: &mut String, found: &Stability) {
    text.push_str(
        "## Faults\n\n\
         The program is run again and again (a panic and a lost GPU are brought about within one \
         process), and each time something fails. It held if no file \
         stands half written under its name, what stood there before is there still or a whole new \
         file, nothing hangs, and the program says what happened where it is left to.\n\n",
    );
    let rows: Vec<Vec<String>> = found
        .faults
        .iter()
        .map(|f| {
            let failures = f.failures.len();
            let lost = if failures == 0 { "0".into() } else { format!("**{failures}**") };
            vec![
                in_cell(f.name),
                in_cell(f.what),
                f.tries.to_string(),
                f.done.to_string(),
                f.survived.to_string(),
                lost,
                in_cell(&f.said),
            ]
        })
        .collect();
    let head =
        ["fault", "what was done", "tries", "did its work", "ended otherwise", "lost", "last word"];
    text.push_str(&markdown_table(&head, &rows));
    text.push_str(
        "\nStudies are killed 50 times at random moments by \
         `cargo test --test it killed_fifty`: no finished result is lost, and what comes out in the \
         end is what an undisturbed run gives, byte for byte.\n\n",
    );
}
