//! `docs/RESULTS.md`: the publications' figures beside ours. A section is a function that gives
//! it, and its entry in the list of its chapter.

mod account;
mod beyond;
mod claims;
mod comparison;
mod costs;
mod dial;
mod examples;
mod expectations;
mod figures;
mod front;
mod methods;
mod noise;
mod papers;
mod pixel_orders;
mod programs;
mod ratios;
mod screen_door;
mod shadows;
mod slab;
mod splats;
mod summary;
mod table_1;

use std::fmt::Write;
use std::path::PathBuf;

pub use figures::{FIGURES, Figure};
pub use summary::{check_marks, in_short};

use crate::document::{Against, Section, Text};
use crate::stability;
use screendoor_study::metrics::Estimate;
use screendoor_study::study::file::Publication;
use screendoor_study::study::publications::costs::Costs;
use screendoor_study::study::publications::methods::Methods;
use screendoor_study::study::publications::screen_door::ScreenDoors;
use screendoor_study::study::publications::shadows::Shadows;
use screendoor_study::study::publications::{Publications, Reproduced};
use screendoor_trace::error::Result;
use screendoor_trace::output::OutputFile;
use screendoor_trace::param::Options;
use screendoor_trace::picture::{Picture, write_png};

/// A publication's figures beside ours.
#[derive(Clone, Debug)]
pub struct Chapter {
    /// What is said.
    pub sections: Vec<Section>,
    /// What is told in short beside what is set against publications.
    in_short: Vec<Text>,
    /// What the sections show: file names without their endings.
    pub figures: Vec<(String, Drawn)>,
}

impl Chapter {
    /// What is printed, measured and found.
    pub fn against(&self) -> impl Iterator<Item = &Against> {
        self.sections.iter().flat_map(Section::against)
    }

    /// As Markdown, what is in short first. `folder` is where the figures lie, as seen from it.
    pub fn to_markdown(&self, folder: &str) -> String {
        let lines = self.against().map(Against::in_short).chain(self.in_short.iter().cloned());
        let sections = self.sections.iter().map(|section| section.to_markdown(2, folder));
        std::iter::once(summary::of(lines.collect())).chain(sections).collect()
    }
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

/// The chapter of what was measured.
pub fn chapter(measured: &Reproduced) -> Chapter {
    let (mut in_short, mut figures, mut views) = (Vec::new(), Vec::new(), Vec::new());
    let sections = match measured {
        Reproduced::LaineKarras(p) => {
            figures = figures::figures(p);
            LAINE_KARRAS.iter().filter_map(|section| section(p)).collect()
        }
        Reproduced::Methods(m) => {
            figures = figures::of(&m.pictures);
            METHODS.iter().filter_map(|section| section(m)).collect()
        }
        Reproduced::Slab(c) => {
            figures = dial::figures(&c.dial);
            vec![slab::section(c), dial::section(&c.dial)]
        }
        Reproduced::Comparison(c) => {
            in_short = comparison::in_short(c);
            figures = dial::figures(&c.dial);
            figures.extend(front::figures(c));
            vec![comparison::section(c), slab::section(c), dial::section(&c.dial)]
        }
        Reproduced::Beyond(b) => {
            in_short = beyond::in_short(b);
            vec![beyond::section(b)]
        }
        Reproduced::Splats(b) => {
            in_short = splats::in_short(b);
            vec![splats::section(b)]
        }
        Reproduced::Programs(results) => {
            in_short = programs::in_short(results);
            vec![programs::section(results)]
        }
        Reproduced::Shadows(s) => {
            in_short = shadows::in_short(s);
            figures = shadows::figures(s);
            views = shadows::view_charts(s);
            SHADOWS.iter().filter_map(|section| section(s)).collect()
        }
        Reproduced::ScreenDoor(s) => {
            figures = figures::of(&s.pictures);
            SCREEN_DOOR.iter().filter_map(|section| section(s)).collect()
        }
        Reproduced::Costs(c) => COSTS.iter().filter_map(|section| section(c)).collect(),
        Reproduced::Stability(s) => stability::sections(s),
    };
    let figures = figures.into_iter().map(|(name, drawn)| (name.to_string(), drawn));
    let figures = figures.chain(views).collect();
    Chapter { sections, in_short, figures }
}

/// A section of a chapter; none where nothing of it was measured.
type Of<T> = fn(&T) -> Option<Section>;

const LAINE_KARRAS: [Of<Publications>; 9] = [
    table_1::section,
    table_1::fewer_samples_section,
    expectations::section,
    noise::figure_1_section,
    noise::figure_3b_section,
    noise::figure_5_section,
    noise::figure_6_section,
    pixel_orders::section,
    figures::section,
];

const METHODS: [Of<Methods>; 8] = [
    examples::section,
    methods::probabilities,
    methods::hashes,
    methods::figure_8,
    claims::masks_section,
    claims::dither_section,
    claims::rounds_section,
    claims::hashing_section,
];

const SHADOWS: [Of<Shadows>; 3] = [shadows::figure_3, shadows::figure_5, shadows::designs];

const SCREEN_DOOR: [Of<ScreenDoors>; 3] =
    [screen_door::by_angle, screen_door::layers, screen_door::distances];

const COSTS: [Of<Costs>; 4] = [costs::multiples, costs::peeling, costs::views, costs::wyman];

/// The parts of RESULTS.md, each of which can be measured on its own.
pub const PARTS: [Publication; 9] = [
    Publication::LaineKarras,
    Publication::Methods,
    Publication::Shadows,
    Publication::ScreenDoor,
    Publication::Costs,
    Publication::Comparison,
    Publication::Beyond,
    Publication::Splats,
    Publication::Programs,
];

/// Where its figures lie, as seen from RESULTS.md.
pub const FIGURES_FOLDER: &str = "figures";

/// RESULTS.md: what was `measured`, and of the other parts what the document said
/// `before`; at its end the papers line by line.
pub fn results(before: &str, measured: &[(Publication, Chapter)]) -> String {
    let mut text = preamble().to_markdown(1, FIGURES_FOLDER);
    for part in PARTS {
        let name = part.name();
        let [start, end] = ["begin", "end"].map(|edge| format!("<!-- {edge} of part {name} -->\n"));
        let own = measured.iter().find(|(p, _)| *p == part);
        let new = own.map(|(_, chapter)| chapter.to_markdown(FIGURES_FOLDER));
        let old = || {
            let from = before.find(&start)? + start.len();
            let length = before[from..].find(&end)?;
            Some(before[from..from + length].to_string())
        };
        if let Some(part) = new.or_else(old) {
            let _ = write!(text, "{start}{part}{end}");
        }
    }
    if let Some(papers) = papers::section(&text) {
        text.push_str(&papers.to_markdown(2, FIGURES_FOLDER));
    }
    text
}

fn preamble() -> Section {
    let mut preamble = Section::new("Results");
    preamble.paragraph(
        "Written by `screendoor reproduce`, the figures within sentences too; `--part` measures one part \
         and leaves the others as they are. Errors are in 8-bit units (1/255 of the range from black to \
         white), on linear values where nothing else is said. ± and [ ] are 95 % intervals over seeds: \
         Student's t on the mean square, and for ratios both sides' relative widths in quadrature.",
    );
    preamble.paragraph(
        "LK is Laine and Karras, *Stratified Sampling for Stochastic Transparency*, EGSR 2011. To rerun: \
         `screendoor reproduce --models FOLDER`, where the folder holds the models named below (without \
         it the built-in scenes are measured).",
    );
    preamble
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
    fn the_document_of_the_tree_begins_with_what_is_said_of_all() {
        assert!(include_str!("../../../../docs/RESULTS.md").starts_with(&results("", &[])));
    }

    #[test]
    fn every_claim_has_its_section_and_every_picture_is_there() {
        let effort = Effort { seeds: 2, side: 64, comparison_side: 32, ..Effort::brief() };
        let (mut named, quiet) = (Vec::new(), Quiet::new());
        for part in [Publication::LaineKarras, Publication::Methods, Publication::Slab] {
            let measured = measure_publication(part, &quiet.lab(), effort).unwrap();
            assert_eq!((measured.publication(), measured.missing().len()), (part, 0));
            let chapter = chapter(&measured);
            let list: Vec<Against> = chapter.against().cloned().collect();
            let table = summary(&list).body.0;
            let asked = std::cell::RefCell::new(Vec::new());
            let found = sections(&chapter.sections, &|file| {
                asked.borrow_mut().push(file.to_string());
                None
            });
            for against in &list {
                let own = found.iter().find(|s| s.title == against.section).unwrap();
                assert!(table.contains(&format!("href=\"#{}\"", own.anchor)), "{}", own.anchor);
                let verdict = format!("<strong>Verdict</strong>: {}", against.agreement.word());
                assert!(own.body.0.contains(&verdict), "{}", own.body.0);
                named.push(against.section.clone());
            }
            let made = chapter.figures.iter().map(|(name, drawn)| drawn.file(name));
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
