//! `docs/RESULTS.md`: the publications' figures beside ours.

use std::fmt::Write;

use crate::metrics::Estimate;
use crate::picture::Picture;
use crate::report::{Panel, markdown_table, montage};
use crate::study::Run;
use crate::study::publications::{BLOCKS, COUNTS, DESIGNS, Publications, Published, Table1};

/// A figure of the document: its file and what it is made of.
#[derive(Clone, Copy, Debug)]
pub struct Figure {
    /// The file's name, without its ending.
    pub file: &'static str,
    /// Names of its panels among the publications' pictures.
    pub panels: &'static [&'static str],
    /// Panels in a row.
    columns: u32,
    /// Magnification of each pixel.
    enlarge: u32,
    /// The panels' part that is shown, in sixteenths of their side: left, top,
    /// side; all of it where not given.
    part: Option<[u32; 3]>,
    caption: &'static str,
}

/// All figures.
pub const FIGURES: &[Figure] = &[
    Figure {
        file: "figure-1",
        panels: &["figure-1-enderton", "figure-1-lk"],
        columns: 2,
        enlarge: 2,
        part: None,
        caption: "LK figure 1, left of each pair: `builtin:ramps` at 16 samples, `enderton` \
                  and `lk`. From the top: alpha from 0 to 1; alpha 0.61; alpha 0.75 drawn as five \
                  quads, whose edges show on the left and leave no trace on the right.",
    },
    Figure {
        file: "figure-1-cloth",
        panels: &["figure-1-cloth-enderton", "figure-1-cloth-lk"],
        columns: 2,
        enlarge: 3,
        part: None,
        caption: "LK figure 1, right of each pair: a detail of `builtin:cloth` at 64 samples, \
                  `enderton` and `lk`.",
    },
    Figure {
        file: "figure-3",
        panels: &[
            "figure-3-lk2011",
            "figure-3-sobol",
            "figure-3-white",
            "figure-3-lk2011-static",
            "figure-3-sobol-static",
            "figure-3-radical-inverse",
        ],
        columns: 3,
        enlarge: 2,
        part: None,
        caption: "LK figure 3: eight white layers of alpha 0.1 at 8 samples. Upper row, samples \
                  compacted and sorted: `lk2011`, `sobol`, `white`. Lower row, reference values \
                  fixed to samples as in section 3 of the paper (`sort=false,compact=false`): \
                  `lk2011`, `sobol`, `radical-inverse`. With fixed values the Sobol' sequence \
                  leaves the correlations of the paper's figure 3b, and the radical inverse lets \
                  the nearest layer hide the others; the hash leaves neither.",
    },
    Figure {
        file: "figure-6",
        panels: &["figure-6-unsorted", "figure-6-sorted"],
        columns: 2,
        enlarge: 3,
        part: None,
        caption: "LK figure 6: a detail of `builtin:cloth`, triangles in random order, 16 \
                  samples, without and with the sort.",
    },
    Figure {
        file: "figure-9",
        panels: &["figure-9-enderton", "figure-9-lk"],
        columns: 2,
        enlarge: 1,
        part: Some([4, 4, 8]),
        caption: "LK figure 9: a detail of `builtin:engine`, white, alpha 0.3, 16 samples, \
                  `enderton` and `lk`.",
    },
    Figure {
        file: "figure-10",
        panels: &["figure-10-enderton", "figure-10-lk"],
        columns: 2,
        enlarge: 1,
        part: Some([4, 4, 8]),
        caption: "LK figure 10: a detail of `builtin:cloth`, alpha 0.4, 16 samples, `enderton` \
                  and `lk`.",
    },
];

/// The file of the picture of all built-in scenes.
const GALLERY: &str = "scenes";

/// The document's figures: file names and pictures.
pub fn figures(publications: &Publications) -> Vec<(&'static str, Picture)> {
    let scenes: Vec<Panel<'_>> = publications
        .gallery
        .iter()
        .map(|(_, picture)| Panel { picture, crop: None, enlarge: 1 })
        .collect();
    let mut list = vec![(GALLERY, montage(&scenes, 4))];
    list.extend(paper_figures(publications));
    list
}

fn paper_figures(publications: &Publications) -> Vec<(&'static str, Picture)> {
    let find = |name: &str| publications.pictures.iter().find(|(n, _)| *n == name);
    FIGURES
        .iter()
        .filter_map(|figure| {
            let pictures: Option<Vec<&Picture>> =
                figure.panels.iter().map(|n| find(n).map(|(_, p)| p)).collect();
            let panel = |picture| {
                let crop = figure.part.map(|part| {
                    let side = Picture::width(picture);
                    let [left, top, size] = part.map(|p| p * side / 16);
                    [left, top, size, size]
                });
                Panel { picture, crop, enlarge: figure.enlarge }
            };
            let panels: Vec<Panel<'_>> = pictures?.into_iter().map(panel).collect();
            Some((figure.file, montage(&panels, figure.columns)))
        })
        .collect()
}

/// The document. `figure_folder` is where the figures lie, as seen from it.
pub fn results(p: &Publications, figure_folder: &str) -> String {
    let mut text = String::new();
    preamble(&mut text, p);
    for (i, table) in p.table_1.iter().enumerate() {
        table_1(&mut text, i, table);
    }
    for missing in &p.missing {
        let _ = writeln!(text, "`{missing}`: the model was not given, so there is no table.\n");
    }
    account(&mut text, p);
    expectations(&mut text, p);
    figure_5(&mut text, p);
    pictures(&mut text, p, figure_folder);
    text
}

fn preamble(text: &mut String, p: &Publications) {
    let _ = writeln!(
        text,
        "# Results\n\n\
         Written by `screendoor reproduce`; nothing here is typed by hand. Errors are in 8-bit \
         units (1/255 of the range from black to white), on linear values where nothing else is \
         said. ± and [ ] are 95 % intervals over seeds: Student's t on the mean square, and \
         for ratios both sides' relative widths in quadrature.\n\n\
         LK is Laine and Karras, *Stratified Sampling for Stochastic Transparency*, EGSR 2011. \
         To rerun: `screendoor reproduce --models FOLDER`, where the folder holds the models \
         named below (without it the built-in scenes are measured).\n\n\
         ## LK table 1\n\n\
         RMSE over the covered pixels against the exact picture of all 64 samples, so that \
         missing antialiasing counts as it does against the paper's reference of thousands of \
         samples; {} × {} pixels, {} seeds. `naive` is `enderton:mask=naive`, which tests every \
         sample on its own. The paper's models are not public: ours stand in for them.\n",
        p.effort.side, p.effort.side, p.effort.seeds
    );
}

fn table_1(text: &mut String, index: usize, table: &Table1) {
    let s = &table.statistics;
    let paper = match table.stands_for {
        Published::Motor => "MOTOR",
        Published::Cloth => "CLOTH",
    };
    let _ = writeln!(
        text,
        "### `{}`, beside {paper}\n\n{}. {:.2} million fragments, {:.1} per covered pixel (95 % of them have \
         at most {}), an edge in {:.0} % of the covered pixels.\n",
        table.name,
        table.origin,
        s.fragments as f64 / 1e6,
        s.depth_complexity.mean,
        s.depth_complexity.p95,
        100.0 * (1.0 - s.interior_pixels as f64 / s.covered_pixels.max(1) as f64),
    );
    let rows: Vec<Vec<String>> = COUNTS
        .iter()
        .zip(table.stands_for.rmse())
        .map(|(n, [paper_lk, paper_e])| {
            let [lk, e, naive] = runs(table, *n).map(|r| r.rmse_fine);
            vec![
                n.to_string(),
                plain(lk),
                plain(e),
                plain(naive),
                ratio(lk, e),
                ratio(lk, naive),
                format!("{paper_lk}"),
                format!("{paper_e}"),
                format!("{:.2}", paper_lk / paper_e),
            ]
        })
        .collect();
    let header = [
        "samples",
        "lk",
        "enderton",
        "naive",
        "lk ÷ enderton",
        "lk ÷ naive",
        "paper LK",
        "paper comp.",
        "paper ratio",
    ];
    text.push_str(&markdown_table(&header, &rows));

    let _ = writeln!(
        text,
        "\nThe same against the exact picture of the same samples (noise alone), with and without \
         the pixels that an edge crosses:\n"
    );
    let rows: Vec<Vec<String>> = COUNTS
        .iter()
        .map(|n| {
            let [lk, e, naive] = runs(table, *n);
            let mut row = vec![n.to_string(), plain(lk.covered.rmse), plain(e.covered.rmse)];
            row.push(plain_srgb(lk));
            row.push(plain_srgb(e));
            let regions =
                [(&lk.covered, &e.covered), (&lk.interior, &e.interior), (&lk.edges, &e.edges)];
            row.extend(regions.map(|(lk, e)| {
                if lk.pixels < LEAST_PIXELS {
                    format!("— ({} pixels)", lk.pixels)
                } else {
                    ratio(lk.rmse, e.rmse)
                }
            }));
            row.push(ratio(lk.edges.rmse, naive.edges.rmse));
            row
        })
        .collect();
    let header = [
        "samples",
        "lk",
        "enderton",
        "lk, sRGB",
        "enderton, sRGB",
        "lk ÷ enderton",
        "… without edges",
        "… edges alone",
        "lk ÷ naive, edges",
    ];
    text.push_str(&markdown_table(&header, &rows));
    if index == 0 {
        let _ = writeln!(
            text,
            "\n(RMSE on sRGB-encoded values are those of the numbers that an 8-bit display is sent.)"
        );
    }
    text.push('\n');
}

/// Regions with fewer pixels say nothing.
const LEAST_PIXELS: u64 = 1000;

/// The runs of [`DESIGNS`] at a sample count.
fn runs(table: &Table1, samples: u32) -> [&Run; 3] {
    DESIGNS.map(|design| {
        let found = table.runs.iter().find(|r| r.design == design && r.samples == samples);
        found.expect("every design was run at every count")
    })
}

fn plain(e: Estimate) -> String {
    format!("{:.2} ± {:.2}", e.value, e.half_width())
}

fn plain_srgb(r: &Run) -> String {
    format!("{:.2}", r.covered.rmse_srgb.value)
}

fn ratio(a: Estimate, b: Estimate) -> String {
    let r = a.ratio(b);
    if !r.high.is_finite() {
        // The runs scatter so much that the interval reaches 0.
        return format!("{:.3} [?]", r.value);
    }
    format!("{:.3} [{:.3}, {:.3}]", r.value, r.low, r.high)
}

fn account(text: &mut String, p: &Publications) {
    let published: Vec<String> = [Published::Motor, Published::Cloth]
        .iter()
        .map(|column| {
            let rmse = column.rmse();
            let fall = |i: usize| rmse[0][i] / rmse[4][i];
            format!("{:.1} and {:.1}", fall(0), fall(1))
        })
        .collect();
    let _ = writeln!(
        text,
        "### Where this differs from the paper, and why\n\n\
         1. **LK's own figures behave as published.** From 4 to 64 samples the paper's error \
         falls by {} (LK and its comparison, MOTOR), {} (CLOTH). Ours:\n",
        published[0], published[1]
    );
    let rows: Vec<Vec<String>> =
        p.table_1
            .iter()
            .map(|table| {
                let (few, many) = (runs(table, 4), runs(table, 64));
                let mut row = vec![table.name.to_string()];
                row.extend((0..3).map(|i| {
                    format!("{:.1}", few[i].covered.rmse.value / many[i].covered.rmse.value)
                }));
                row
            })
            .collect();
    text.push_str(&markdown_table(&["error at 4 ÷ at 64", "lk", "enderton", "naive"], &rows));
    let _ = writeln!(
        text,
        "\n2. **The paper's comparison method behaves like sampling without stratification.** Its \
         error falls by a factor of about 4 from 4 to 64 samples, which is N^−½: what `naive` \
         does. `enderton` as the paper describes it (depth test first, then ⌊αn+ξ⌋ of the n \
         survivors) stratifies whole fragments, and falls faster. So the published ratios lie \
         near our `lk ÷ naive`, and our `lk ÷ enderton` is closer to 1. \
         The largest difference between the published ratio and ours over all counts:\n"
    );
    let rows: Vec<Vec<String>> = p
        .table_1
        .iter()
        .map(|table| {
            let mut worst = [0.0_f64; 2];
            for (n, [a, b]) in COUNTS.iter().zip(table.stands_for.rmse()) {
                let [lk, e, naive] = runs(table, *n).map(|r| r.rmse_fine.value);
                for (worst, other) in worst.iter_mut().zip([e, naive]) {
                    *worst = worst.max((lk / other - a / b).abs());
                }
            }
            vec![table.name.to_string(), format!("{:.2}", worst[0]), format!("{:.2}", worst[1])]
        })
        .collect();
    text.push_str(&markdown_table(&["scene", "lk ÷ enderton", "lk ÷ naive"], &rows));
    let _ = writeln!(
        text,
        "\n3. **Edges.** A fragment that covers one or two samples leaves `enderton` nothing to \
         stratify; LK stratifies over the surface. The smaller the triangles in pixels, the \
         closer `enderton` comes to `naive`: see the frame sizes below, where the triangles stay \
         and the pixels grow. The paper does not state its frame size.\n\
         4. **Order.** Drawn near to far, the depth test alone does what LK sorts for, and \
         `enderton` is about as good; drawn far to near it is at its worst. The paper's CLOTH is \
         in random order, like ours; its MOTOR's order is not stated, ours is the file's.\n\
         5. **View and background.** Absolute errors depend on how far the layers' colours lie \
         apart, thus on shading and background; the ratios hardly do. Shading here is diffuse \
         with a key and a fill light; the paper does not describe its lights.\n\n\
         At 16 samples, against the exact picture of the same samples:\n"
    );
    let rows: Vec<Vec<String>> = p
        .variations
        .iter()
        .map(|v| {
            let [lk, e, naive] = v.rmse;
            vec![
                v.scene.to_string(),
                v.what.clone(),
                format!("{:.1}", v.fragments_per_pixel),
                format!("{:.0} %", 100.0 * v.edge_share),
                format!("{:.2}", lk.value),
                format!("{:.2}", e.value),
                format!("{:.2}", naive.value),
                ratio(lk, e),
                ratio(lk, naive),
            ]
        })
        .collect();
    let header = [
        "scene",
        "seen",
        "fragments/pixel",
        "edge pixels",
        "lk",
        "enderton",
        "naive",
        "lk ÷ enderton",
        "lk ÷ naive",
    ];
    text.push_str(&markdown_table(&header, &rows));
    text.push('\n');
}

fn expectations(text: &mut String, p: &Publications) {
    if p.means.is_empty() {
        return;
    }
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
         the conflict is seen and B gets a fresh value. On average B passes too rarely. The bias \
         falls as 1/N and is small beside the noise, yet far outside chance.\n\n\
         It vanishes when the tracking sees all covered samples, before the depth test \
         (`track=covered`: a counter of log2(N)+1 bits more per pixel, the same noise), and in \
         every other variant in which chance does not decide the surface.\n",
        p.effort.seeds_of_means
    );
    let rows: Vec<Vec<String>> = p
        .means
        .iter()
        .map(|m| {
            let outside = m.mean.low > 0.0 || m.mean.high < 0.0;
            let sigmas = m.mean.value.abs() / (m.mean.half_width() / 1.96);
            vec![
                format!("`{}`", m.design),
                m.samples.to_string(),
                format!("{:+.4} ± {:.4}", m.mean.value, m.mean.half_width()),
                if outside { format!("{sigmas:.1} σ") } else { "within".to_string() },
                plain(m.rmse),
                if m.unbiased { "unbiased" } else { "biased" }.to_string(),
            ]
        })
        .collect();
    let header = ["design", "samples", "mean error", "off 0", "RMSE", "declared"];
    text.push_str(&markdown_table(&header, &rows));
    let _ = writeln!(
        text,
        "\n('within' is within the 95 % interval; one of twenty is expected outside by chance.)\n"
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

fn pictures(text: &mut String, p: &Publications, folder: &str) {
    let scenes: Vec<&str> = p.gallery.iter().map(|(name, _)| name.as_str()).collect();
    let _ = writeln!(
        text,
        "## Pictures\n\n![{GALLERY}]({folder}/{GALLERY}.png)\n\n\
         The built-in scenes, composited exactly: {}.\n",
        scenes.join(", ")
    );
    let there: Vec<&str> = p.pictures.iter().map(|(name, _)| *name).collect();
    for figure in FIGURES.iter().filter(|f| f.panels.iter().all(|n| there.contains(n))) {
        let _ = writeln!(
            text,
            "![{file}]({folder}/{file}.png)\n\n{caption}\n",
            file = figure.file,
            caption = figure.caption
        );
    }
}
