//! The results in short: a line for each claim, which RESULTS.md holds in its parts and
//! README.md repeats.

use crate::document::{List, Text};
use screendoor_trace::error::{Error, Result};

/// The marks around what is in short, in RESULTS.md's parts and in README.md.
const BEGIN: &str = "<!-- begin of the results in short, written by `screendoor reproduce` -->\n";
const END: &str = "<!-- end of the results in short -->\n";

/// A part in short, where it has anything to tell.
pub(super) fn of(items: Vec<Text>) -> String {
    match items.is_empty() {
        true => String::new(),
        false => format!("{BEGIN}{}{END}", List { first: None, items }.to_markdown()),
    }
}

/// What lies between the marks, where they are.
fn between(text: &str) -> Option<(usize, usize)> {
    let from = text.find(BEGIN)? + BEGIN.len();
    Some((from, from + text[from..].find(END)?))
}

/// The lines of all parts of RESULTS.md.
fn lines(mut results: &str) -> String {
    let mut all = String::new();
    while let Some((from, to)) = between(results) {
        all.push_str(&results[from..to]);
        results = &results[to + END.len()..];
    }
    all
}

/// Where the marks of a document are.
fn place(document: &str) -> Result<(usize, usize)> {
    between(document).ok_or_else(|| {
        let (begin, end) = (BEGIN.trim_end(), END.trim_end());
        let hint = format!("put '{begin}' and '{end}', each in its line, where they should stand");
        Error::config("the document has no marks around the results in short", hint)
    })
}

/// Whether [`in_short`] knows where to write in a document.
///
/// # Errors
/// Where the document has no marks.
pub fn check_marks(document: &str) -> Result<()> {
    place(document).map(|_| ())
}

/// A document whose marks hold what RESULTS.md, `results`, says in short.
///
/// # Errors
/// Where the document has no such marks, or RESULTS.md has nothing in short.
pub fn in_short(document: &str, results: &str) -> Result<String> {
    let (from, to) = place(document)?;
    let lines = lines(results);
    if lines.is_empty() {
        let hint = "write it anew with `screendoor reproduce`";
        return Err(Error::invalid("RESULTS.md", "nothing in it is in short", hint));
    }
    Ok(format!("{}{lines}{}", &document[..from], &document[to..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{Against, Agreement};

    fn against(section: &str, measured: &str, agreement: Agreement) -> Text {
        let text = |t: &str| t.to_string();
        let against = Against {
            section: text(section),
            source: text("A 2000, section 1"),
            printed: text("So."),
            measured: text(measured),
            agreement,
            remark: text("Hm."),
        };
        against.in_short()
    }

    #[test]
    fn a_document_repeats_every_line_of_every_part() {
        let lk = of(vec![against("One", "0.99 to 1.09.", Agreement::InPart)]);
        let others = of(vec![against("Two", "6.5.", Agreement::Differs), "**Three**: 3.".into()]);
        let results = format!("# Results\n{lk}## One\ntext\n{others}## Two\n");
        let document = format!("# It\n\n{BEGIN}old\n{END}\nmore\n");
        let written = in_short(&document, &results).unwrap();
        let expected = "- **One** (A 2000, section 1): confirmed in part. 0.99 to 1.09.\n\
                        - **Two** (A 2000, section 1): differs. 6.5.\n- **Three**: 3.\n";
        assert_eq!(written, format!("# It\n\n{BEGIN}{expected}{END}\nmore\n"));
        // Written once more it stays; a figure that was changed by hand does not.
        assert_eq!(in_short(&written, &results).unwrap(), written);
        let planted = written.replace("1.09", "1.08");
        assert_ne!(in_short(&planted, &results).unwrap(), planted);
    }

    #[test]
    fn marks_and_results_that_are_missing_are_named() {
        let results = of(vec![against("One", "1.", Agreement::Confirmed)]);
        let error = in_short("# It\n", &results).unwrap_err().to_string();
        assert!(error.contains("begin of the results in short"), "{error}");
        assert!(check_marks("# It\n").is_err() && check_marks(&results).is_ok());
        let error = in_short(&results, "# Results\n").unwrap_err().to_string();
        assert!(error.contains("RESULTS.md: nothing in it is in short"), "{error}");
    }
}
