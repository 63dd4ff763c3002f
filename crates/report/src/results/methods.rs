//! The results' part on the methods: Wyman's probabilities, hashes, LK figure 8.

use crate::document::{Against, Agreement, Section};
use crate::results::figures::show;
use crate::results::ratios::above;
use crate::results::{plain, ratio};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::publications::hashes::{HashRow, TRIES};
use screendoor_study::study::publications::methods::{Figure8, MOST_BITS, Methods, TABLE_BITS};
use screendoor_study::study::publications::{COUNTS, Published};
use screendoor_study::study::record::Record;

/// Wyman's probabilities.
pub(super) fn probabilities(m: &Methods) -> Option<Section> {
    let p = &m.probabilities;
    let mut section = Section::new("Wyman's probabilities");
    section.paragraph(format!(
        "`P_b(s, t)` (Wyman 2016, equation 1): the probability that a mask of t of b bits is not \
         wholly hidden behind one of s bits. Over every b up to {MOST_BITS}, s and t the equation \
         differs from enumeration of every mask by at most {:.1e}, and the probability without \
         stratification, 1 − ((b−t)/b)^(b−s), by at most {:.1e} from that of bits drawn on their \
         own. For b = {TABLE_BITS}, with stratification (enumerated) and without:",
        p.worst_stratified, p.worst_independent
    ));
    let columns = (0..=TABLE_BITS).map(|t| format!("t = {t}"));
    let rows = p.table.iter().enumerate().map(|(s, row)| {
        let cells = row.iter().map(|[a, b, c]| format!("{a:.4} ({b:.4}), {c:.4}"));
        std::iter::once(s.to_string()).chain(cells)
    });
    section.table(std::iter::once("s".to_string()).chain(columns), rows);
    Some(section)
}

/// Hashes of reference values; nothing where none was measured.
pub(super) fn hashes(m: &Methods) -> Option<Section> {
    if m.hashes.is_empty() {
        return None;
    }
    let row = |h: &HashRow| {
        [
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
    };
    let good = m.hashes.iter().filter(|h| h.scrambles && h.reference != "white");
    let errors: Vec<f64> = good.map(|h| h.rmse.value).collect();
    let low = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let high = errors.iter().copied().fold(0.0, f64::max);
    let mut section = Section::new("Reference-value hashes");
    section.paragraph(format!(
        "What the hashes reach, and whether it matters. *Orders*: different orders of 16 \
         consecutive reference values among {TRIES} surfaces and pixels, in LK's use, where the \
         highest bits are scrambled by all below; 32 768 exist. *Low*: different permutations of \
         the lowest 4 bits over as many seeds, in Burley's use. *Correlation*: the largest over \
         lags 1 to 8, between neighbouring surfaces' and neighbouring seeds' values, 65 536 pairs \
         each: chance stays below 0.016 in 99.99 %. *Transmittance*: four layers of alpha 0.3 in one \
         pixel of 8 samples without a spatial index, over 4096 runs of consecutive surface \
         numbers; 0.2401 is right. *RMSE*, also of means of 4 × 4 pixels, and *mean* error of `lk` on eight \
         layers of alpha 0.3 at 8 samples."
    ));
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
    section.table(header, m.hashes.iter().map(row));
    section.paragraph(format!(
        "Among the scrambles that tell surfaces apart the RMSE lies between {low:.2} and {high:.2}: \
         on these eight layers the choice of the hash changes the picture's error by at most \
         {:.1} %.",
        100.0 * (high / low - 1.0)
    ));
    Some(section)
}

/// A number of permutations; independent numbers form none.
fn orders(count: usize) -> String {
    if count > 1 << 15 { "—".to_string() } else { count.to_string() }
}

fn rmse(f: &Figure8, design: &str) -> Option<Estimate> {
    f.scene.variant(design).map(|r| r.covered.rmse)
}

/// The samples of figure 8.
const SAMPLES: u32 = 16;

/// The advantage, 1 − LK ÷ comparison, that the paper prints at figure 8's sample count:
/// the smaller one of its two scenes.
fn printed_advantage() -> f64 {
    let advantages = [Published::Motor, Published::Cloth].into_iter().flat_map(|column| {
        let rows = COUNTS.iter().zip(column.rmse());
        rows.filter(|(n, _)| **n == SAMPLES).map(|(_, [lk, other])| 1.0 - lk / other)
    });
    advantages.fold(1.0, f64::min)
}

/// Figure 8 beside the paper's.
fn figure_8_against(m: &Methods) -> Against {
    let f = &m.figure_8;
    let pair = rmse(f, "lk").zip(rmse(f, "enderton"));
    let found = pair.map(|(lk, e)| lk.ratio(e));
    let never_worse = found.is_some_and(|ratio| !above(ratio, 1.0));
    let printed = printed_advantage();
    // Most of it is lost where less than half is left.
    let lost = found.is_some_and(|ratio| 1.0 - ratio.value < printed / 2.0);
    let shown = |design: &str| rmse(f, design).map_or("—".to_string(), plain);
    let advantage = found.map_or(0.0, |ratio| 100.0 * (1.0 - ratio.value));
    Against {
        section: "LK figure 8".to_string(),
        source: "Laine and Karras 2011, section 5, figure 8".to_string(),
        printed: "With an extreme number of layers LK loses most of its effectiveness, and never \
                  performs worse than the comparison method."
            .to_string(),
        measured: format!(
            "RMSE {} of `lk`, {} of `enderton`: {} times.",
            shown("lk"),
            shown("enderton"),
            pair.map_or("—".to_string(), |(lk, e)| ratio(lk, e))
        ),
        agreement: Agreement::of(&[never_worse, lost]),
        remark: format!(
            "`lk` is {} than `enderton`; its advantage is {advantage:.0} %, where table 1 prints \
             {:.0} % or more at {SAMPLES} samples.",
            if never_worse { "not worse" } else { "worse" },
            100.0 * printed
        ),
    }
}

/// Figure 8's section.
pub(super) fn figure_8(m: &Methods) -> Option<Section> {
    let f = &m.figure_8;
    let s = &f.scene.statistics;
    let mut section = Section::answering(figure_8_against(m));
    section.paragraph(format!(
        "`{}` as billboards of alpha 0.05 at 16 samples, {} seeds: {:.2} million fragments, {:.0} \
         per covered pixel (95 % have at most {}).",
        f.source,
        m.effort.seeds,
        s.fragments as f64 / 1e6,
        s.depth_complexity.mean,
        s.depth_complexity.p95
    ));
    let row = |r: &Record| {
        let e = r.covered.rmse;
        let of = |other| rmse(f, other).map_or("—".to_string(), |o| ratio(e, o));
        [format!("`{}`", r.series), plain(e), of("enderton"), of("enderton:mask=naive")]
    };
    section.table(["design", "RMSE", "÷ enderton", "÷ naive"], f.scene.records.iter().map(row));
    show(&mut section, &m.pictures, &["figure-8"]);
    Some(section)
}
