//! Enderton's examples and what the paper says of bias.

use crate::document::{Against, Agreement, Section};
use screendoor_study::study::publications::examples::{ExampleRow, Moments};
use screendoor_study::study::publications::methods::Methods;

fn deviations(values: [f64; 3]) -> String {
    let [r, g, b] = values;
    if r == g && g == b {
        return format!("{r:.3}");
    }
    format!("{r:.3} {g:.3} {b:.3}")
}

/// Whether a row's printed numbers are those of enumeration.
fn as_printed(row: &ExampleRow) -> bool {
    row.printed.is_none_or(|p| !off(p, row.exact.deviation))
}

/// A row's method and example, in short.
fn short(row: &ExampleRow) -> String {
    let example = row.example.split(':').next().unwrap_or(row.example);
    format!("{} of {example}", row.method)
}

/// The examples beside the paper's.
fn against(m: &Methods) -> Against {
    let printed: Vec<bool> = m.examples.iter().map(as_printed).collect();
    let holding = printed.iter().filter(|holds| **holds).count();
    // The design agrees with enumeration to what 65 536 draws tell.
    let worst = m
        .examples
        .iter()
        .flat_map(|row| row.exact.deviation.into_iter().zip(row.measured.deviation))
        .map(|(exact, measured)| (exact - measured).abs())
        .fold(0.0, f64::max);
    let differ: Vec<String> = m.examples.iter().filter(|row| !as_printed(row)).map(short).collect();
    Against {
        section: "Enderton's examples".to_string(),
        source: "Enderton et al. 2011, sections 3, 4 and 6".to_string(),
        printed: format!(
            "Standard deviations of two pixels by {} methods, and what is said of bias.",
            m.examples.len() / 2
        ),
        measured: format!(
            "Enumeration of every mask gives {holding} of {} rows as printed; the design's \
             deviations are within {worst:.3} of enumeration.",
            printed.len()
        ),
        agreement: Agreement::of(&printed),
        remark: match differ.is_empty() {
            true => "All rows are as printed.".to_string(),
            false => format!("Printed and enumerated differ for: {}.", differ.join("; ")),
        },
    }
}

/// The section.
pub(super) fn section(m: &Methods) -> Option<Section> {
    let mut section = Section::answering(against(m));
    section.paragraph(
        "Standard deviation of a pixel of 4 samples, for red, green and blue where they differ: as \
         printed by Enderton et al. (TVCG 2011, section 3), by enumeration of every mask, and as \
         `enderton` gives it with masks drawn among all covered samples, over 65 536 pixels and \
         seeds; beside it the same method with the samples that `lk` and `systematic` choose, \
         which the paper could not have.",
    );
    let header = ["example", "method", "printed", "enumerated", "enderton", "lk", "systematic"];
    section.table(header, m.examples.iter().map(example_row));
    section.paragraph(format!(
        "Printed and enumerated are called different by more than 0.01. Naive sampling in example 2 is \
         printed for a single sample, which has {:.3}. {}",
        // One sample of a white or 0.25 gray pixel.
        single_sample_deviation(),
        corrected(&m.examples),
    ));
    section.paragraph("What the paper says of bias (sections 4 and 6):");
    let rows = m.bias_cases.iter().map(|c| [&*c.name, c.printed, &c.exact, &c.measured]);
    section.table(["case", "printed", "enumerated", "measured"], rows);
    Some(section)
}

/// Where the correction of the depth-based method makes less noise, and where more.
fn corrected(rows: &[ExampleRow]) -> String {
    let of = |example: &str, method: &str| {
        let row = rows.iter().find(|r| r.example == example && r.method == method)?;
        Some(row.exact.deviation.into_iter().map(|d| d * d).sum::<f64>().sqrt())
    };
    let first = rows.iter().filter(|r| r.method == "depth-based");
    let each = first.filter_map(|row| {
        let (plain, corrected) =
            (of(row.example, "depth-based")?, of(row.example, "depth-based, corrected")?);
        let word = if corrected < plain { "less" } else { "no less" };
        let name = row.example.split(':').next().unwrap_or(row.example);
        Some(format!("{word} noise in {name} ({corrected:.3} after {plain:.3}, all channels)"))
    });
    let each: Vec<String> = each.collect();
    format!("By enumeration the correction of the depth-based method leaves {}.", each.join("; "))
}

/// Whether values as printed, to two digits, are others than the exact ones.
fn off(printed: [f64; 3], exact: [f64; 3]) -> bool {
    printed.iter().zip(exact).any(|(p, e)| (p - e).abs() > 0.0105)
}

/// Example 2 with one sample: white with the probability 1 − 0.75⁴, or 0.25 gray.
fn single_sample_deviation() -> f64 {
    let behind = 0.75_f64.powi(4);
    0.75 * (behind * (1.0 - behind)).sqrt()
}

fn example_row(row: &ExampleRow) -> [String; 7] {
    let other = |name: &str| {
        let found: Option<&(&str, Moments)> = row.others.iter().find(|(n, _)| *n == name);
        found.map_or("—".to_string(), |(_, m)| deviations(m.deviation))
    };
    [
        row.example.to_string(),
        row.method.to_string(),
        row.printed.map_or("—".to_string(), |p| {
            let [r, g, b] = p;
            if r == g && g == b { format!("{r:.2}") } else { format!("{r:.2} {g:.2} {b:.2}") }
        }),
        deviations(row.exact.deviation),
        deviations(row.measured.deviation),
        other("lk"),
        other("systematic"),
    ]
}
