//! Numbers as people read them.

use screendoor_study::metrics::Estimate;

/// A count with thin spaces between thousands.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A number with this many decimals and a proper minus.
pub(crate) fn fixed(v: f64, decimals: usize) -> String {
    let text = format!("{v:.decimals$}");
    // What rounds to nothing has no sign.
    let zero = text.chars().all(|c| "-0.".contains(c));
    let text = if zero { text.replace('-', "") } else { text };
    text.replace('-', "−")
}

/// A number with three digits that count.
pub(crate) fn figures(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return if v.is_infinite() { "∞".into() } else { fixed(v, 0) };
    }
    let whole = v.abs().log10().floor() as i32 + 1;
    match whole {
        4.. => grouped_rounded(v),
        -3..4 => fixed(v, (3 - whole).clamp(0, 6) as usize),
        _ => format!("{v:.2e}").replace('-', "−"),
    }
}

fn grouped_rounded(v: f64) -> String {
    let sign = if v < 0.0 { "−" } else { "" };
    format!("{sign}{}", grouped(v.abs().round() as u64))
}

/// An estimate with its interval, in three digits that count.
pub(super) fn estimated(e: Estimate) -> String {
    if e.low == e.high {
        return figures(e.value);
    }
    let decimals = decimals_of(e.value);
    format!("{} ({} to {})", figures(e.value), fixed(e.low, decimals), fixed(e.high, decimals))
}

fn decimals_of(v: f64) -> usize {
    if v == 0.0 { 2 } else { (2 - v.abs().log10().floor() as i32).clamp(0, 6) as usize }
}

/// What is said of how many there are: `1 scene`, `3 scenes`.
pub(crate) fn counted(n: usize, one: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") }
}

/// Names as a list in a sentence.
pub(super) fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A word as a shell takes it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(grouped(12), "12");
        assert_eq!(figures(0.8734), "0.873");
        assert_eq!(figures(12.34), "12.3");
        assert_eq!(figures(123_456.0), "123\u{202f}456");
        assert_eq!(figures(0.0), "0");
        assert_eq!(figures(-0.5), "−0.500");
        assert_eq!(figures(1e-9), "1.00e−9");
        assert_eq!(fixed(-0.0001, 2), "0.00");
        let e = Estimate { value: 0.873, low: 0.861, high: 0.886 };
        assert_eq!(estimated(e), "0.873 (0.861 to 0.886)");
    }

    #[test]
    fn words_reach_the_shell_whole() {
        assert_eq!(quoted("kbuffer:layers=8"), "kbuffer:layers=8");
        assert_eq!(quoted("my trace's.arrow"), "'my trace'\\''s.arrow'");
    }
}
