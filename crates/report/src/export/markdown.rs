//! Results as Markdown: for people, and for notes and issues.

use crate::document::{Section, Text};
use crate::html::words::{counted, figures, fixed};
use crate::{filters, visibility};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::record::Record;
use screendoor_study::study::results::{Missing, Results};

/// What has no figure.
const NONE: &str = "—";

/// The study, a table for each scene and sample count, the machine, and what is missing.
pub fn markdown(results: &Results) -> String {
    let study = &results.study;
    let mut document = Section::new(Text::plain(&study.name));
    let description = study.description.trim();
    if !description.is_empty() {
        document.paragraph(Text::plain(description));
    }
    document.paragraph(format!(
        "{} from {}, where a seed changes anything. Errors are over the covered pixels, against \
         the exact picture of the same samples, {} in units of 1/255, ± half of \
         the 95 % interval; the mean error is picture minus exact picture, with its sign. Everything but times is the same on every machine.",
        counted(study.seeds as usize, "seed"),
        study.first_seed,
        results.values()
    ));
    for scene in &study.scenes {
        document.parts.extend(study.samples.iter().map(|n| table(results, &scene.name, *n)));
    }
    document.parts.extend(visibility::section(results));
    document.parts.extend(filters::section(results));
    let mut machine = Section::new("Machine");
    let facts = results.machine.facts();
    machine.table(["", ""], facts.iter().map(|(name, value)| [*name, value].map(Text::plain)));
    document.parts.extend([machine, missing(&results.missing)]);
    format!("{}\n", document.to_markdown(1, ".").trim_end())
}

/// A column's cell for a record; `None` where it has no figure.
type Figure = fn(&Record) -> Option<String>;

/// The columns between the design and the times.
const COLUMNS: &[(&str, Figure)] = &[
    ("RMSE", |r| with_error(r.covered.rmse)),
    ("mean error", |r| with_error(r.covered.mean).filter(|_| !r.is_one_draw())),
    ("FLIP", |r| with_error(r.flip?.mean)),
    ("RMSE after Gaussian of 1 pixel", |r| filtered(r, 1.0)),
    ("of 2 pixels", |r| filtered(r, 2.0)),
    ("blueness, dB", |r| with_error(r.spectrum.as_ref()?.blueness?)),
    ("state, bytes/pixel", |r| Some(r.state_bytes().map_or("grows".into(), figures))),
    ("passes", |r| Some(r.passes.to_string())),
    ("moved, bytes/fragment", |r| r.bytes_moved_per_fragment().map(figures)),
    ("hashes/fragment", |r| r.hashes_per_fragment().map(figures)),
    ("comparators/fragment", |r| r.comparators_per_fragment().map(figures)),
    ("products/fragment", |r| r.multiplications_per_fragment().map(figures)),
];

fn table(results: &Results, scene: &str, samples: u32) -> Section {
    let engines = results.engines();
    let times = engines.iter().map(|e| Text::plain(format!("{e}, ns/fragment")));
    let names = COLUMNS.iter().map(|(name, _)| Text::plain(*name));
    let header: Vec<Text> = std::iter::once("design".into()).chain(names).chain(times).collect();
    let row = |series: &String| -> Vec<Text> {
        let Some(record) = results.record(scene, series, samples) else {
            let of = |m: &&Missing| m.scene == scene && m.series == *series && m.samples == samples;
            let why = results.missing.iter().find(of).map_or("not run yet", Missing::reason);
            let mut cells = vec![Text::plain(format!("{series} (missing: {why})"))];
            cells.resize(header.len(), NONE.into());
            return cells;
        };
        let time = |engine| Some(figures(record.nanoseconds_per_fragment(engine)?.median));
        let mut cells = vec![Some(series.clone())];
        cells.extend(COLUMNS.iter().map(|(_, of)| of(record)));
        cells.extend(engines.iter().map(|e| time(e)));
        cells.into_iter().map(|cell| cell.map_or(NONE.into(), Text::plain)).collect()
    };
    let rows: Vec<_> = results.study.designs.iter().map(row).collect();
    let title = format!("{scene}, {}", counted(samples as usize, "sample"));
    let mut section = Section::new(Text::plain(title));
    section.table(header, rows);
    section
}

fn filtered(record: &Record, sigma: f64) -> Option<String> {
    with_error(record.filtered.iter().find(|f| f.sigma == sigma)?.rmse)
}

/// An estimate and half of its interval; `None` where it is not known.
fn with_error(e: Estimate) -> Option<String> {
    let half = (e.high - e.low) / 2.0;
    if e.value.is_nan() {
        return None;
    }
    if !half.is_finite() || half == 0.0 {
        return Some(figures(e.value));
    }
    // As many decimals as the half-width needs for two digits that count.
    let decimals = (1 - half.log10().floor() as i32).clamp(0, 6) as usize;
    Some(format!("{} ± {}", fixed(e.value, decimals), fixed(half, decimals)))
}

fn missing(list: &[Missing]) -> Section {
    let mut section = Section::new("Missing");
    if list.is_empty() {
        section.paragraph("None: every run of the study has a result.");
        return section;
    }
    let row = |m: &Missing| {
        let samples = m.samples.to_string();
        [m.scene.as_str(), &m.series, &samples, m.reason()].map(Text::plain)
    };
    section.table(["scene", "design", "samples", "why"], list.iter().map(row));
    section
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_study::study::analysis::made_up::plausible;

    /// A table row's cells.
    fn cells(line: &str) -> Vec<String> {
        let line = line.replace("\\|", "");
        line.trim_matches('|').split('|').map(|cell| cell.trim().to_string()).collect()
    }

    #[test]
    fn every_run_has_its_row_and_every_row_its_cells() {
        let results = plausible(8, 16, &[8, 16]);
        let text = markdown(&results);
        let mut rows = 0;
        for part in text.split("\n## ").filter(|p| p.contains("| design | RMSE |")) {
            let (heading, _) = part.split_once('\n').unwrap();
            let (scene, samples) = heading.split_once(", ").unwrap();
            let samples = samples.split(' ').next().unwrap().parse().unwrap();
            let lines: Vec<&str> = part.lines().filter(|l| l.starts_with('|')).collect();
            for (line, series) in lines[2..].iter().zip(&results.study.designs) {
                let cells = cells(line);
                assert_eq!(cells.len(), 1 + COLUMNS.len() + 2, "{line}");
                match results.record(scene, series, samples) {
                    Some(r) => {
                        assert_eq!(&cells[0], series);
                        assert_eq!(cells[1], with_error(r.covered.rmse).unwrap());
                        assert_eq!(cells[8], r.passes.to_string());
                    }
                    None => {
                        assert!(cells[0].starts_with(&format!("{series} (missing: ")), "{line}");
                        assert_eq!(cells[1], NONE);
                    }
                }
                rows += 1;
            }
        }
        assert_eq!(rows, 8 * 2 * 16);
        assert!(text.contains("(missing: ran out of memory)"));
        assert!(text.contains("| oak | hybrid:layers={n} | 8 | not run yet |"), "{text}");
        assert!(text.contains("| Processor | a processor |"));
    }

    #[test]
    fn files_cannot_break_the_tables() {
        let mut results = plausible(8, 16, &[8]);
        results.study.name = "a\n# b".into();
        for missing in &mut results.missing {
            missing.why = Some("a | b\\|\r\n| c | <i>".into());
        }
        let text = markdown(&results);
        assert!(text.starts_with("# a # b\n"));
        let lines = text.lines().filter(|l| l.contains("b&#92;\\|  \\| c")).count();
        assert_eq!(lines, 2 * results.missing.len());
        let per_row: Vec<usize> =
            text.lines().filter(|l| l.starts_with('|')).map(|l| cells(l).len()).collect();
        assert!(per_row.iter().all(|n| [2, 4, 1 + COLUMNS.len() + 2].contains(n)), "{per_row:?}");
        assert!(!text.contains("<i>"));
    }

    #[test]
    fn errors_have_their_half_width() {
        let e = |value, low, high| with_error(Estimate { value, low, high });
        assert_eq!(e(12.345, 12.2, 12.5).unwrap(), "12.35 ± 0.15");
        assert_eq!(e(12.345, 12.345, 12.345).unwrap(), "12.3");
        assert_eq!(e(-1.0, f64::NEG_INFINITY, f64::INFINITY).unwrap(), "−1.00");
        assert_eq!(e(f64::NAN, 0.0, 1.0), None);
    }
}
