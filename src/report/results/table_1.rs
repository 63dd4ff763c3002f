//! LK table 1.

use std::fmt::Write;

use crate::metrics::Estimate;
use crate::report::markdown_table;
use crate::report::results::against::{Against, Agreement, below};
use crate::report::results::{plain, ratio};
use crate::study::Run;
use crate::study::publications::{COUNTS, DESIGNS, Publications, Published, Table1};

/// The table beside the paper's.
pub(super) fn against(p: &Publications) -> Against {
    let [motor, cloth] = [Published::Motor, Published::Cloth].map(|column| {
        let [first, .., last] = column.rmse().map(|[lk, comparison]| lk / comparison);
        format!("{first:.2} to {last:.2}")
    });
    // By scene and count: the published ratio, `lk` ÷ `enderton`, `lk` ÷ `naive`.
    let scenes: Vec<Vec<(f64, Estimate, Estimate)>> = p.table_1.iter().map(ratios).collect();
    let all = || scenes.iter().flatten();
    let measured: Vec<String> = p
        .table_1
        .iter()
        .zip(&scenes)
        .filter_map(|(table, ratios)| {
            let ((_, e, naive), (_, last_e, last_naive)) = (ratios.first()?, ratios.last()?);
            Some(format!(
                "on `{}` {:.2} to {:.2} against `enderton`, {:.2} to {:.2} against `naive`",
                table.name, e.value, last_e.value, naive.value, last_naive.value
            ))
        })
        .collect();
    let falls = |ratios: &&Vec<(f64, Estimate, Estimate)>| match ratios[..] {
        [(_, first, _), .., (_, last, _)] => below(last, first.low),
        _ => false,
    };
    let faster = scenes.iter().filter(falls).count();
    let smaller = all().filter(|(_, e, _)| below(*e, 1.0)).count();
    let off = |of: fn(&(f64, Estimate, Estimate)) -> f64| {
        all().map(|row| (of(row) - row.0).abs()).fold(0.0, f64::max)
    };
    let (off_enderton, off_naive) = (off(|row| row.1.value), off(|row| row.2.value));
    let statements = [faster == scenes.len(), smaller == all().count(), off_enderton < NEAR];
    Against {
        section: "LK table 1".to_string(),
        source: "Laine and Karras 2011, section 5, table 1".to_string(),
        printed: format!(
            "LK's RMSE ÷ that of the comparison method falls from 4 to 64 samples from {motor} on \
             MOTOR and from {cloth} on CLOTH."
        ),
        measured: format!("The same ratio: {}.", measured.join("; ")),
        agreement: Agreement::of(&statements),
        remark: format!(
            "From 4 to 64 samples LK gains on `enderton` on {faster} of {} scenes, and its error is \
             the smaller one in {smaller} of {} pairs of scene and sample count. The ratio itself \
             is off the printed one by up to {off_enderton:.2}; against `naive` by up to \
             {off_naive:.2}.",
            scenes.len(),
            all().count()
        ),
    }
}

/// Ratios of RMSE that differ by less are called the same: the scenes are others.
const NEAR: f64 = 0.1;

/// At each count the published ratio, `lk` ÷ `enderton` and `lk` ÷ `naive`.
fn ratios(table: &Table1) -> Vec<(f64, Estimate, Estimate)> {
    let at = |(n, [paper_lk, paper_other]): (&u32, [f64; 2])| {
        let [lk, e, naive] = runs(table, *n).map(|r| r.rmse_fine);
        (paper_lk / paper_other, lk.ratio(e), lk.ratio(naive))
    };
    COUNTS.iter().zip(table.stands_for.rmse()).map(at).collect()
}

/// The table's section, without the account of where it differs.
pub(super) fn text(text: &mut String, p: &Publications) {
    against(p).open(text);
    let _ = writeln!(
        text,
        "RMSE over the covered pixels against the exact picture of all 64 samples, so that \
         missing antialiasing counts as it does against the paper's reference of thousands of \
         samples; {} × {} pixels, {} seeds. `naive` is `enderton:mask=naive`, which tests every \
         sample on its own. The paper's models are not public: ours stand in for them.\n",
        p.effort.side, p.effort.side, p.effort.seeds
    );
    for (i, table) in p.table_1.iter().enumerate() {
        table_1(text, i, table);
    }
    for missing in &p.missing {
        let _ = writeln!(text, "`{missing}`: the model was not given, so there is no table.\n");
    }
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
pub(super) fn runs(table: &Table1, samples: u32) -> [&Run; 3] {
    DESIGNS.map(|design| {
        let found = table.runs.iter().find(|r| r.design == design && r.samples == samples);
        found.expect("every design was run at every count")
    })
}

fn plain_srgb(r: &Run) -> String {
    format!("{:.2}", r.covered.rmse_srgb.value)
}
