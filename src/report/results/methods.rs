//! The results' part on the methods.

use std::fmt::Write;

use crate::metrics::Estimate;
use crate::report::markdown_table;
use crate::report::results::{plain, ratio};
use crate::study::publications::examples::{ExampleRow, Moments};
use crate::study::publications::hashes::TRIES;
use crate::study::publications::methods::{MOST_BITS, Methods, TABLE_BITS};

/// The text of the part.
pub(super) fn text(m: &Methods) -> String {
    let mut text = String::new();
    examples(&mut text, m);
    probabilities(&mut text, m);
    hashes(&mut text, m);
    figure_8(&mut text, m);
    text
}

fn deviations(values: [f64; 3]) -> String {
    let [r, g, b] = values;
    if r == g && g == b {
        return format!("{r:.3}");
    }
    format!("{r:.3} {g:.3} {b:.3}")
}

fn examples(text: &mut String, m: &Methods) {
    let _ = writeln!(
        text,
        "## Enderton's examples\n\n\
         Standard deviation of a pixel of 4 samples, for red, green and blue where they differ: as \
         printed by Enderton et al. (TVCG 2011, section 3), by enumeration of every mask, and as \
         `enderton` gives it with masks drawn among all covered samples, over 65 536 pixels and \
         seeds; beside it the same method with the samples that `lk` and `systematic` choose, \
         which the paper could not have.\n"
    );
    let rows: Vec<Vec<String>> = m.examples.iter().map(example_row).collect();
    let header = ["example", "method", "printed", "enumerated", "enderton", "lk", "systematic"];
    text.push_str(&markdown_table(&header, &rows));
    let differ: Vec<String> = m
        .examples
        .iter()
        .filter(|row| row.printed.is_some_and(|p| off(p, row.exact.deviation)))
        .map(|row| format!("{} of {}", row.method, &row.example[..5]))
        .collect();
    let _ = writeln!(
        text,
        "\nPrinted and enumerated differ by more than 0.01 for: {}. Naive sampling in example 2 is \
         printed for a single sample, which has {:.3}. What is printed for the corrected depth-based \
         method in example 1 is not what its formula gives: the correction does no harm there.\n\n\
         What the paper says of bias (sections 4 and 6):\n",
        differ.join("; "),
        // One sample of a white or 0.25 gray pixel.
        single_sample_deviation(),
    );
    let rows: Vec<Vec<String>> = m
        .bias_cases
        .iter()
        .map(|c| vec![c.name.clone(), c.printed.to_string(), c.exact.clone(), c.measured.clone()])
        .collect();
    text.push_str(&markdown_table(&["case", "printed", "enumerated", "measured"], &rows));
    text.push('\n');
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

fn example_row(row: &ExampleRow) -> Vec<String> {
    let other = |name: &str| {
        let found: Option<&(&str, Moments)> = row.others.iter().find(|(n, _)| *n == name);
        found.map_or("—".to_string(), |(_, m)| deviations(m.deviation))
    };
    vec![
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

fn probabilities(text: &mut String, m: &Methods) {
    let p = &m.probabilities;
    let _ = writeln!(
        text,
        "## Wyman's probabilities\n\n\
         `P_b(s, t)` (Wyman 2016, equation 1): the probability that a mask of t of b bits is not \
         wholly hidden behind one of s bits. Over every b up to {MOST_BITS}, s and t the equation \
         differs from enumeration of every mask by at most {:.1e}, and the probability without \
         stratification, 1 − ((b−t)/b)^(b−s), by at most {:.1e} from that of bits drawn on their \
         own. For b = {TABLE_BITS}, with stratification (enumerated) and without:\n",
        p.worst_stratified, p.worst_independent
    );
    let columns: Vec<String> = (0..=TABLE_BITS).map(|t| format!("t = {t}")).collect();
    let mut header = vec!["s"];
    header.extend(columns.iter().map(String::as_str));
    let rows: Vec<Vec<String>> = p
        .table
        .iter()
        .enumerate()
        .map(|(s, row)| {
            let mut cells = vec![s.to_string()];
            cells.extend(row.iter().map(|[a, b, c]| format!("{a:.4} ({b:.4}), {c:.4}")));
            cells
        })
        .collect();
    text.push_str(&markdown_table(&header, &rows));
    text.push('\n');
}

fn hashes(text: &mut String, m: &Methods) {
    let rows: Vec<Vec<String>> = m
        .hashes
        .iter()
        .map(|h| {
            vec![
                format!("`{}`", h.reference),
                if h.prehash { "yes" } else { "no" }.to_string(),
                orders(h.orders),
                orders(h.low_orders),
                format!("{:.3}", h.between_surfaces),
                format!("{:.3}", h.between_seeds),
                format!("{:.4}", h.transmittance),
                plain(h.rmse),
                plain(h.rmse_blocks),
                format!("{:+.3} ± {:.3}", h.mean.value, h.mean.half_width()),
            ]
        })
        .collect();
    let good = |h: &&crate::study::publications::hashes::HashRow| {
        !["radical-inverse", "sobol", "white"].contains(&h.reference)
    };
    let errors: Vec<f64> = m.hashes.iter().filter(good).map(|h| h.rmse.value).collect();
    let low = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let high = errors.iter().copied().fold(0.0, f64::max);
    let _ = writeln!(
        text,
        "## Reference-value hashes\n\n\
         What the hashes reach, and whether it matters. *Orders*: different orders of 16 \
         consecutive reference values among {TRIES} surfaces and pixels, in LK's use, where the \
         highest bits are scrambled by all below; 32 768 exist. *Low*: different permutations of \
         the lowest 4 bits over as many seeds, in Burley's use. *Correlation*: the largest over \
         lags 1 to 8, between neighbouring surfaces' and neighbouring seeds' values, 65 536 pairs \
         each: chance stays below 0.016 in 99.99 %. *Transmittance*: four layers of alpha 0.3 in one \
         pixel of 8 samples without a spatial index, over 4096 runs of consecutive surface \
         numbers; 0.2401 is right. *RMSE*, also of means of 4 × 4 pixels, and *mean* error of `lk` on eight \
         layers of alpha 0.3 at 8 samples.\n"
    );
    let header = [
        "hash",
        "prehash",
        "orders",
        "low",
        "corr. surfaces",
        "corr. seeds",
        "transmittance",
        "RMSE",
        "RMSE 4×4",
        "mean",
    ];
    text.push_str(&markdown_table(&header, &rows));
    let _ = writeln!(
        text,
        "\nAmong the scrambles that tell surfaces apart the RMSE lies between {low:.2} and {high:.2}: \
         the choice of the hash changes the picture's error by at most {:.1} %.\n",
        100.0 * (high / low - 1.0)
    );
}

/// A number of permutations; independent numbers form none.
fn orders(count: usize) -> String {
    if count > 1 << 15 { "—".to_string() } else { count.to_string() }
}

fn figure_8(text: &mut String, m: &Methods) {
    let f = &m.figure_8;
    let s = &f.statistics;
    let find = |name: &str| -> Option<Estimate> {
        f.rmse.iter().find(|(n, _)| *n == name).map(|(_, e)| *e)
    };
    let _ = writeln!(
        text,
        "## LK figure 8\n\n\
         `{}` as billboards of alpha 0.05 at 16 samples, {} seeds: {:.2} million fragments, {:.0} \
         per covered pixel (95 % have at most {}). LK: the method loses most of its advantage, and \
         is never worse than the comparison.\n",
        f.source,
        m.effort.seeds,
        s.fragments as f64 / 1e6,
        s.depth_complexity.mean,
        s.depth_complexity.p95
    );
    let rows: Vec<Vec<String>> = f
        .rmse
        .iter()
        .map(|(name, e)| {
            let of = |other| find(other).map_or("—".to_string(), |o| ratio(*e, o));
            vec![format!("`{name}`"), plain(*e), of("enderton"), of("enderton:mask=naive")]
        })
        .collect();
    text.push_str(&markdown_table(&["design", "RMSE", "÷ enderton", "÷ naive"], &rows));
    text.push('\n');
}
