//! Correlations between surfaces, seeds and pixels.

use crate::document::Section;
use screendoor_study::study::stress::{
    Between, Correlation, CorrelationRow, SIGNIFICANCE, Stability,
};

pub(super) fn section(found: &Stability) -> Section {
    let promised = found.hashes.iter().filter(|h| h.promised);
    let promised: Vec<String> = promised.map(|h| format!("`{}`", h.name)).collect();
    let mut section = Section::new("Correlations");
    section.paragraph(format!(
        "Pearson's coefficient between the reference values of two surfaces, two seeds and two \
         neighbouring pixels, the same sample of both: over the pixels of an image, and within single \
         pixels over their surfaces or seeds; the largest over several distances and pixels. In bold \
         what chance alone gives anywhere in the table with a probability below {SIGNIFICANCE} \
         (Bonferroni). Pixels that follow each other on the curve share their strata, which is what \
         LK section 3.1 wants: there a correlation is meant. That surfaces and seeds are unrelated is \
         promised of: {}.",
        promised.join(", ")
    ));
    let columns: Vec<(Between, bool)> =
        Between::ALL.into_iter().flat_map(|b| [(b, true), (b, false)]).collect();
    table(&mut section, "hash", &found.hashes, &columns);
    section.paragraph(
        "The same of the pictures of designs that are random, one layer of alpha 0.3 at 8 samples: \
         drawn as the pixels' second and as their third surface, with two seeds, and pixels that lie \
         beside each other (— where pictures have no noise).",
    );
    table(&mut section, "design", &found.pictures, &Between::ALL.map(|b| (b, true)));
    section
}

fn table(section: &mut Section, what: &str, rows: &[CorrelationRow], columns: &[(Between, bool)]) {
    let names = columns.iter().map(|(between, image)| {
        let over = if *image { "over an image" } else { "in a pixel" };
        format!("{}, {over}", between.words())
    });
    let rows = rows.iter().map(|row| {
        let cells =
            columns.iter().map(|(b, image)| row.get(*b, *image).map_or(String::new(), cell));
        std::iter::once(format!("`{}`", row.name)).chain(cells)
    });
    section.table(std::iter::once(what.to_string()).chain(names), rows);
}

fn cell(c: &Correlation) -> String {
    // A minus as wide as a digit, and no sign where there is nothing.
    let Some(value) = c.r else { return "—".to_string() };
    let r = format!("{:.3}", value.abs());
    let sign = if value < 0.0 && r != "0.000" { "−" } else { "" };
    if c.correlated { format!("**{sign}{r}**") } else { format!("{sign}{r}") }
}
