//! `docs/RESULTS.md`: the publications' figures beside ours.

mod account;
mod against;
mod claims;
mod comparison;
mod dial;
mod examples;
mod expectations;
mod figures;
mod methods;
mod noise;
mod ratios;
mod slab;
mod summary;
mod table_1;

use std::fmt::Write;
use std::path::PathBuf;

pub use against::{Against, Agreement};
pub use figures::{FIGURES, Figure};
pub use summary::{check_marks, in_short};

use crate::{markdown_table, stability};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::comparison::Comparison;
use screendoor_study::study::file::Publication;
use screendoor_study::study::publications::methods::Methods;
use screendoor_study::study::publications::{Publications, Reproduced, RowDifference};
use screendoor_trace::error::Result;
use screendoor_trace::output::OutputFile;
use screendoor_trace::param::Options;
use screendoor_trace::picture::{Picture, write_png};

/// A publication's figures beside ours.
#[derive(Clone, Debug)]
pub struct Document {
    /// The text, in sections headed by `##`.
    pub markdown: String,
    /// What is printed, measured and found, of each section that has such.
    pub against: Vec<Against>,
    /// What the text shows: file names without their endings.
    pub figures: Vec<(&'static str, Drawn)>,
}

/// What a file of a document shows.
#[derive(Clone, Debug)]
pub enum Drawn {
    /// A picture, as PNG.
    Picture(Picture),
    /// A chart, as SVG.
    Chart(String),
}

impl Drawn {
    /// The name of its file.
    pub fn file(&self, name: &str) -> String {
        match self {
            Drawn::Picture(_) => format!("{name}.png"),
            Drawn::Chart(_) => format!("{name}.svg"),
        }
    }

    /// Writes it.
    ///
    /// # Errors
    /// As [`write_png`] and [`OutputFile::put`].
    pub fn write(&self, path: PathBuf) -> Result<()> {
        match self {
            Drawn::Picture(picture) => write_png(path, picture),
            Drawn::Chart(svg) => OutputFile::put(path, svg.as_bytes()),
        }
    }
}

/// The document of what was measured. `folder` is where the figures lie, as seen from it.
pub fn document(measured: &Reproduced, folder: &str) -> Document {
    let (markdown, against, figures) = match measured {
        Reproduced::LaineKarras(p) => {
            let against = vec![
                table_1::against(p),
                table_1::fewer_samples(p),
                noise::figure_1(p),
                noise::figure_3b(p),
                noise::figure_5(p),
                noise::figure_6(p),
            ];
            (laine_karras(p, folder), against, figures::figures(p))
        }
        Reproduced::Methods(m) => {
            let mut against = vec![examples::against(m), methods::figure_8_against(m)];
            against.extend(claims::against(&m.claims));
            (methods_text(m, folder), against, figures::of(&m.pictures))
        }
        Reproduced::Slab(c) => (slab::text(c, folder), slab_against(c), dial::figures(&c.dial)),
        Reproduced::Comparison(c) => {
            (comparison::text(c, folder), slab_against(c), dial::figures(&c.dial))
        }
        Reproduced::Stability(s) => (stability::sections(s), Vec::new(), Vec::new()),
    };
    let others = match measured {
        Reproduced::Comparison(c) => comparison::in_short(c),
        _ => Vec::new(),
    };
    let in_short = match against.is_empty() {
        true => String::new(),
        false => summary::of(&against, &others),
    };
    Document { markdown: in_short + &markdown, against, figures }
}

/// The parts of RESULTS.md, each of which can be measured on its own.
pub const PARTS: [Publication; 3] =
    [Publication::LaineKarras, Publication::Methods, Publication::Comparison];

/// RESULTS.md: what was `measured`, and of the other parts what the document said
/// `before`.
pub fn results(before: &str, measured: &[(Publication, Document)]) -> String {
    let mut text = PREAMBLE.to_string();
    for part in PARTS {
        let name = part.name();
        let [start, end] = ["begin", "end"].map(|edge| format!("<!-- {edge} of part {name} -->\n"));
        let new = measured.iter().find(|(p, _)| *p == part).map(|(_, d)| d.markdown.clone());
        let old = || {
            let from = before.find(&start)? + start.len();
            let length = before[from..].find(&end)?;
            Some(before[from..from + length].to_string())
        };
        if let Some(part) = new.or_else(old) {
            let _ = write!(text, "{start}{part}{end}");
        }
    }
    text
}

const PREAMBLE: &str = "# Results\n\n\
    Written by `screendoor reproduce`, the figures within sentences too; `--part` measures one part \
    and leaves the others as they are. Errors are in 8-bit units (1/255 of the range from black to \
    white), on linear values where nothing else is said. ± and [ ] are 95 % intervals over seeds: \
    Student's t on the mean square, and for ratios both sides' relative widths in quadrature.\n\n\
    LK is Laine and Karras, *Stratified Sampling for Stochastic Transparency*, EGSR 2011. To rerun: \
    `screendoor reproduce --models FOLDER`, where the folder holds the models named below (without \
    it the built-in scenes are measured).\n\n";

fn laine_karras(p: &Publications, folder: &str) -> String {
    let mut text = String::new();
    table_1::text(&mut text, p);
    table_1::fewer_samples_text(&mut text, p);
    account::text(&mut text, p);
    expectations::text(&mut text, p);
    noise::figure_1_text(&mut text, p, folder);
    noise::figure_3b_text(&mut text, p, folder);
    noise::figure_5_text(&mut text, p);
    noise::figure_6_text(&mut text, p, folder);
    pixel_orders(&mut text, p);
    figures::pictures(&mut text, p, folder);
    text
}

fn slab_against(c: &Comparison) -> Vec<Against> {
    vec![slab::against(c), dial::against(&c.dial)]
}

fn methods_text(m: &Methods, folder: &str) -> String {
    let mut text = String::new();
    examples::text(&mut text, m);
    methods::text(&mut text, m);
    figures::show(&mut text, &m.pictures, folder, |_| true);
    claims::text(&mut text, &m.claims);
    text
}

fn pixel_orders(text: &mut String, p: &Publications) {
    if p.pixel_orders.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "## Pixel orders\n\n\
         LK section 3.1: a Morton curve gives even and odd rows different expectations. Difference \
         of the means of even and odd rows of one surface, alpha 0.1 to 0.6, 4 samples, 128 × 128 \
         pixels, root mean square over seeds and alphas, in 8-bit units. {}\n",
        morton(&p.pixel_orders)
    );
    let rows: Vec<Vec<String>> = p
        .pixel_orders
        .iter()
        .map(|o| vec![format!("`{}`", o.design), format!("{:.3}", o.difference)])
        .collect();
    text.push_str(&markdown_table(&["design", "difference"], &rows));
    text.push('\n');
}

/// How much further apart a Morton curve puts even and odd rows than a Hilbert curve.
fn morton(found: &[RowDifference]) -> String {
    let of = |design: &str| found.iter().find(|o| o.design == design).map(|o| o.difference);
    let times = |morton, hilbert| Some(of(morton)? / of(hilbert)?);
    let bare =
        times("lk:pixel-order=morton,reference=radical-inverse", "lk:reference=radical-inverse");
    let hashed = times("lk:pixel-order=morton", "lk");
    let Some((bare, hashed)) = bare.zip(hashed) else { return "Not measured.".to_string() };
    // Twice as far is no chance: the figures are over hundreds of frames.
    let there = |times: f64| if times > 2.0 { "the effect is there" } else { "no effect is seen" };
    format!(
        "Morton's difference ÷ Hilbert's is {bare:.1} in the unscrambled sequence ({}) and \
         {hashed:.1} with figure 4's hash ({}).",
        there(bare),
        there(hashed)
    )
}

fn plain(e: Estimate) -> String {
    format!("{:.2} ± {:.2}", e.value, e.half_width())
}

fn ratio(a: Estimate, b: Estimate) -> String {
    let r = a.ratio(b);
    if !r.high.is_finite() {
        // The runs scatter so much that the interval reaches 0.
        return format!("{:.3} [?]", r.value);
    }
    format!("{:.3} [{:.3}, {:.3}]", r.value, r.low, r.high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html::verification::{sections, summary};
    use screendoor_study::study::publications::experiment::Quiet;
    use screendoor_study::study::publications::{Effort, measure_publication};

    #[test]
    fn a_curve_that_parts_rows_is_told_from_one_that_does_not() {
        let of = |design: &str, difference| RowDifference { design: design.into(), difference };
        let list = |bare| {
            [
                of("lk", 0.4),
                of("lk:pixel-order=morton", 0.4),
                of("lk:reference=radical-inverse", 0.5),
                of("lk:pixel-order=morton,reference=radical-inverse", bare),
            ]
        };
        let [found, none] = [15.5, 0.5].map(|bare| morton(&list(bare)));
        assert!(
            found.contains("31.0 in the unscrambled sequence (the effect is there)"),
            "{found}"
        );
        assert!(none.contains("1.0 in the unscrambled sequence (no effect is seen)"), "{none}");
        assert_eq!(morton(&[]), "Not measured.");
    }

    #[test]
    fn every_claim_has_its_section_and_every_picture_is_there() {
        let effort = Effort { seeds: 2, side: 64, comparison_side: 32, ..Effort::brief() };
        let (mut named, quiet) = (Vec::new(), Quiet::new());
        for part in [Publication::LaineKarras, Publication::Methods, Publication::Slab] {
            let measured = measure_publication(part, &quiet.lab(), effort).unwrap();
            assert_eq!((measured.publication(), measured.missing().len()), (part, 0));
            let document = document(&measured, "verification");
            let table = summary(&document.against).body.0;
            let asked = std::cell::RefCell::new(Vec::new());
            let found = sections(&document.markdown, &|file| {
                asked.borrow_mut().push(file.to_string());
                None
            });
            for against in &document.against {
                let own = found.iter().find(|s| s.title == against.section).unwrap();
                assert!(table.contains(&format!("href=\"#{}\"", own.anchor)), "{}", own.anchor);
                let verdict = format!("<strong>Verdict</strong>: {}", against.agreement.word());
                assert!(own.body.0.contains(&verdict), "{}", own.body.0);
                named.push(against.section.clone());
            }
            let made = document.figures.iter().map(|(name, drawn)| drawn.file(name));
            let (mut made, mut asked) = (made.collect::<Vec<_>>(), asked.into_inner());
            made.sort();
            asked.sort();
            assert_eq!(made, asked);
        }
        assert_eq!(
            named,
            [
                "LK table 1",
                "LK's 16 samples and 64",
                "LK figure 1",
                "LK figure 3b",
                "LK figure 5",
                "LK figure 6",
                "Enderton's examples",
                "LK figure 8",
                "Enderton's table of masks",
                "Dithered numbers of samples",
                "Rounds stratified together",
                "Rounds of hashing",
                "Wyman's claim",
                "SLAB's dial",
            ]
        );
    }
}
