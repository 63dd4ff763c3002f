//! `docs/STABILITY.md`: hard cases, hostile input and faults.

mod cases;

use std::fmt::Write;

use crate::study::stress::Stability;

/// The document.
pub fn stability(found: &Stability) -> String {
    let mut text = PREAMBLE.to_string();
    cases::text(&mut text, found);
    text
}

const PREAMBLE: &str = "# Stability\n\n\
    Written by `screendoor stress`, figures within sentences too.\n\n";

/// A number in few digits.
fn short(value: f64) -> String {
    match value {
        v if v == 0.0 => "0".to_string(),
        v if (0.001..1000.0).contains(&v) => {
            let digits = (2 - v.log10().floor() as i32).clamp(0, 4) as usize;
            let text = format!("{v:.digits$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
                false => text,
            }
        }
        v => {
            let mut text = String::new();
            let _ = write!(text, "{v:.1e}");
            text
        }
    }
}
