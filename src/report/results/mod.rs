//! `docs/RESULTS.md`: the publications' figures beside ours.

mod comparison;
mod figures;
mod methods;
mod table_1;

use std::fmt::Write;

pub use figures::{FIGURES, Figure};

use crate::metrics::{Estimate, student_t};
use crate::param::Options;
use crate::picture::Picture;
use crate::report::markdown_table;
use crate::study::comparison::Comparison;
use crate::study::publications::methods::Methods;
use crate::study::publications::{BLOCKS, DESIGNS, MeanError, Publications};

crate::options! {
    /// A part of the document that can be measured on its own.
    pub enum Part {
        LaineKarras = "lk": "Laine and Karras: table 1, expectations, figures",
        Methods = "methods": "Enderton's examples, Wyman's probabilities, hashes, LK figure 8",
        Comparison = "comparison": "all designs over the same fragments",
    }
}

/// What was measured for one part.
#[derive(Debug)]
pub enum Measured<'a> {
    /// [`Part::LaineKarras`].
    LaineKarras(&'a Publications),
    /// [`Part::Methods`].
    Methods(&'a Methods),
    /// [`Part::Comparison`].
    Comparison(&'a Comparison),
}

impl Measured<'_> {
    /// Which part it is.
    pub fn part(&self) -> Part {
        match self {
            Measured::LaineKarras(_) => Part::LaineKarras,
            Measured::Methods(_) => Part::Methods,
            Measured::Comparison(_) => Part::Comparison,
        }
    }

    /// The part's text. `folder` is where the figures lie, as seen from the document.
    fn text(&self, folder: &str) -> String {
        match self {
            Measured::LaineKarras(p) => laine_karras(p, folder),
            Measured::Methods(m) => {
                let mut text = methods::text(m);
                figures::show(&mut text, &m.pictures, folder);
                text
            }
            Measured::Comparison(c) => comparison::text(c),
        }
    }

    /// The part's figures by file name.
    pub fn figures(&self) -> Vec<(&'static str, Picture)> {
        match self {
            Measured::LaineKarras(p) => figures::figures(p),
            Measured::Methods(m) => figures::of(&m.pictures),
            Measured::Comparison(_) => Vec::new(),
        }
    }
}

/// The document: what was `measured`, and of the other parts what the document said
/// `before`. `folder` is where the figures lie, as seen from it.
pub fn results(before: &str, measured: &[Measured<'_>], folder: &str) -> String {
    let mut text = PREAMBLE.to_string();
    for (part, choice) in Part::ALL.iter().zip(Part::CHOICES) {
        let [start, end] =
            ["begin", "end"].map(|edge| format!("<!-- {edge} of part {} -->\n", choice.name));
        let new = measured.iter().find(|m| m.part() == *part).map(|m| m.text(folder));
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
    preamble(&mut text, p);
    for (i, table) in p.table_1.iter().enumerate() {
        table_1::table_1(&mut text, i, table);
    }
    for missing in &p.missing {
        let _ = writeln!(text, "`{missing}`: the model was not given, so there is no table.\n");
    }
    table_1::account(&mut text, p);
    expectations(&mut text, p);
    figure_5(&mut text, p);
    figures::pictures(&mut text, p, folder);
    text
}

fn preamble(text: &mut String, p: &Publications) {
    let _ = writeln!(
        text,
        "## LK table 1\n\n\
         RMSE over the covered pixels against the exact picture of all 64 samples, so that \
         missing antialiasing counts as it does against the paper's reference of thousands of \
         samples; {} × {} pixels, {} seeds. `naive` is `enderton:mask=naive`, which tests every \
         sample on its own. The paper's models are not public: ours stand in for them.\n",
        p.effort.side, p.effort.side, p.effort.seeds
    );
}

fn expectations(text: &mut String, p: &Publications) {
    if p.means.is_empty() {
        return;
    }
    let seeds = p.effort.seeds_of_means as usize;
    let deviation = |m: &MeanError| m.mean.standard_errors(seeds);
    let lk = p.means.iter().filter(|m| m.design == DESIGNS[0]).map(deviation);
    let deviations: Vec<f64> = p.means.iter().filter(|m| m.unbiased).map(deviation).collect();
    let _ = writeln!(
        text,
        "## Is it unbiased?\n\n\
         Mean of picture minus exact over the covered pixels of the first CLOTH scene at 256 × 256 \
         pixels, over {} seeds. The paper takes LK figure 7 to be unbiased. It is not quite: \
         where primitives' edges share pixels in mixed order, chance decides which fragments \
         belong to one surface. A fragment that covers samples A and B of the current surface's \
         pixel, of which that surface holds A: if the surface was *written* to A and is nearer, A \
         fails the depth test, no conflict is seen, and B is numbered into the same surface, with \
         a reference value complementary to A's low one, thus rather high. If it was not written, \
         the conflict is seen and B gets a fresh value. On average B passes too rarely. Below \
         `lk` is off by up to {:.1} standard errors.\n\n\
         Where the tracking sees all covered samples, before the depth test (`track=covered`: a \
         counter of log2(N)+1 bits more per pixel), and in every other variant in which chance \
         does not decide the surface, there is no such bias: the largest deviation of a design \
         declared unbiased is {:.1} standard errors, where chance alone would exceed {:.1} in \
         one of a hundred such tables.\n",
        p.effort.seeds_of_means,
        lk.fold(0.0, f64::max),
        deviations.iter().copied().fold(0.0, f64::max),
        student_t(1.0 - 0.01 / deviations.len().max(1) as f64, seeds)
    );
    let rows: Vec<Vec<String>> = p
        .means
        .iter()
        .map(|m| {
            let outside = m.mean.low > 0.0 || m.mean.high < 0.0;
            vec![
                format!("`{}`", m.design),
                m.samples.to_string(),
                format!("{:+.4} ± {:.4}", m.mean.value, m.mean.half_width()),
                if outside { format!("{:.1} σ", deviation(m)) } else { "within".to_string() },
                plain(m.rmse),
                if m.unbiased { "unbiased" } else { "biased" }.to_string(),
            ]
        })
        .collect();
    let header = ["design", "samples", "mean error", "off 0", "RMSE", "declared"];
    text.push_str(&markdown_table(&header, &rows));
    let _ = writeln!(
        text,
        "\n(σ: standard errors; 'within' is within the 95 % interval, one of twenty is expected \
         outside by chance.)\n"
    );
}

fn figure_5(text: &mut String, p: &Publications) {
    let _ = writeln!(
        text,
        "## LK figure 5\n\n\
         Samples that a surface of alpha 0.5 keeps under another one of alpha 0.5, of 16: fewest \
         and most over 64 × 64 pixels. The right number is 4.\n"
    );
    let rows: Vec<Vec<String>> = p
        .far_samples
        .iter()
        .map(|f| {
            let order = if f.near_first { "near to far" } else { "far to near" };
            vec![
                if f.part.is_empty() { String::new() } else { format!("({})", f.part) },
                format!("`{}`", f.design),
                order.to_string(),
                format!("{} to {}", f.range[0], f.range[1]),
            ]
        })
        .collect();
    text.push_str(&markdown_table(&["part", "design", "drawn", "samples"], &rows));
    let _ = writeln!(
        text,
        "\n## Pixel orders\n\n\
         LK section 3.1: a Morton curve gives even and odd rows different expectations. Difference \
         of the means of even and odd rows of one surface, alpha 0.1 to 0.6, 4 samples, 128 × 128 \
         pixels, root mean square over seeds and alphas, in 8-bit units. The effect is plain in \
         the unscrambled sequence; figure 4's hash leaves little of it:\n"
    );
    let rows: Vec<Vec<String>> = p
        .pixel_orders
        .iter()
        .map(|o| vec![format!("`{}`", o.design), format!("{:.3}", o.difference)])
        .collect();
    text.push_str(&markdown_table(&["design", "difference"], &rows));
    let _ = writeln!(
        text,
        "\n## Dithering\n\n\
         The noise of figure 1 averaged over blocks of pixels: RMSE in 8-bit units. Noise without \
         spatial stratification halves as the block's side doubles; dithered noise falls faster.\n"
    );
    let mut header = vec!["design".to_string()];
    header.extend(BLOCKS.iter().map(|b| format!("{b}×{b}")));
    let rows: Vec<Vec<String>> = p
        .dithering
        .iter()
        .map(|d| {
            let mut row = vec![format!("`{}`", d.design)];
            row.extend(d.rmse.iter().map(|e| format!("{e:.2}")));
            row
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    text.push_str(&markdown_table(&header, &rows));
    text.push('\n');
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
