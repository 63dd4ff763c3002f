//! LK table 1.

use crate::document::{Against, Agreement, Section, code};
use crate::results::ratios::{OnScenes, above, below};
use crate::results::{account, plain, ratio};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::publications::{COUNTS, DESIGNS, Publications, Published, Table1};
use screendoor_study::study::record::Record;

/// The table beside the paper's.
fn against(p: &Publications) -> Against {
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
                "on {} {:.2} to {:.2} against `enderton`, {:.2} to {:.2} against `naive`",
                code(&table.scene.name),
                e.value,
                last_e.value,
                naive.value,
                last_naive.value
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
        let [lk, e, naive] = runs(table, *n).map(|r| r.fine);
        (paper_lk / paper_other, lk.ratio(e), lk.ratio(naive))
    };
    COUNTS.iter().zip(table.stands_for.rmse()).map(at).collect()
}

/// Samples that LK say do the work of [`MANY`].
const FEW: u32 = 16;
const MANY: u32 = 64;

/// `lk` with few samples ÷ a comparison with many, on every scene, and the greatest such
/// ratio that the paper prints, which it calls quite close.
fn few_to_many(p: &Publications, other: usize) -> OnScenes {
    let scenes = p.table_1.iter().map(|table| {
        let (few, many) = (runs(table, FEW)[0], runs(table, MANY)[other]);
        (table.scene.name.to_string(), few.fine.ratio(many.fine))
    });
    OnScenes(scenes.collect())
}

/// The ratios that the paper's own table prints, of MOTOR and CLOTH.
fn printed_few_to_many() -> [f64; 2] {
    let at = |samples| COUNTS.iter().position(|n| *n == samples).expect("the table has it");
    [Published::Motor, Published::Cloth]
        .map(|column| column.rmse()[at(FEW)][0] / column.rmse()[at(MANY)][1])
}

/// Whether LK with few samples is as close to another design with many as the paper's own
/// table has it.
fn close(ratio: Estimate) -> bool {
    let [motor, cloth] = printed_few_to_many();
    !above(ratio, motor.max(cloth))
}

/// LK's 16 samples beside 64 of the comparison's.
fn fewer_samples(p: &Publications) -> Against {
    let [to_enderton, to_naive] = [1, 2].map(|other| few_to_many(p, other));
    let [motor, cloth] = printed_few_to_many();
    let holds = [&to_enderton, &to_naive].map(|list| list.holding(close));
    let statements: Vec<bool> = holds.iter().flat_map(|h| h.each.iter().copied()).collect();
    Against {
        section: format!("LK's {FEW} samples and {MANY}"),
        source: "Laine and Karras 2011, section 5, table 1".to_string(),
        printed: format!(
            "LK with {FEW} samples is quite close to the comparison method with {MANY} (RMSE \
             {motor:.2} times on MOTOR, {cloth:.2} times on CLOTH)."
        ),
        measured: format!(
            "RMSE of `lk` at {FEW} samples ÷ that of `enderton` at {MANY}: {}; ÷ that of `naive` at \
             {MANY}: {}.",
            to_enderton.range(),
            to_naive.range()
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "As close as in the paper's table against `enderton` {}, against `naive`, which does \
             not stratify, {}.",
            holds[0].words(),
            holds[1].words()
        ),
    }
}

/// The section on that, with the account of where table 1 differs.
pub(super) fn fewer_samples_section(p: &Publications) -> Option<Section> {
    let mut section = Section::answering(fewer_samples(p));
    section.paragraph(format!(
        "RMSE as in the table above, {} × {} pixels, {} seeds.",
        p.effort.side, p.effort.side, p.effort.seeds
    ));
    let row = |table: &Table1| {
        let lk = runs(table, FEW)[0].fine;
        let [_, e, naive] = runs(table, MANY).map(|r| r.fine);
        [
            table.scene.name.to_string(),
            plain(lk),
            plain(e),
            plain(naive),
            ratio(lk, e),
            ratio(lk, naive),
        ]
    };
    let named = |design: &str, n: u32| format!("`{design}`, {n}");
    let header = [
        "scene".to_string(),
        named("lk", FEW),
        named("enderton", MANY),
        named("naive", MANY),
        "lk ÷ enderton".to_string(),
        "lk ÷ naive".to_string(),
    ];
    section.table(header, p.table_1.iter().map(row));
    section.parts.push(account::part(p));
    Some(section)
}

/// The table's section, without the account of where it differs.
pub(super) fn section(p: &Publications) -> Option<Section> {
    let mut section = Section::answering(against(p));
    section.paragraph(format!(
        "RMSE over the covered pixels against the exact picture of all 64 samples, so that \
         missing antialiasing counts as it does against the paper's reference of thousands of \
         samples; {} × {} pixels, {} seeds. `naive` is `enderton:mask=naive`, which tests every \
         sample on its own. The paper's models are not public: ours stand in for them.",
        p.effort.side, p.effort.side, p.effort.seeds
    ));
    section.parts = p.table_1.iter().enumerate().map(|(i, table)| table_1(i, table)).collect();
    for missing in &p.missing {
        let missing = code(missing);
        section
            .end()
            .paragraph(format!("{missing}: the model was not given, so there is no table."));
    }
    Some(section)
}

fn table_1(index: usize, table: &Table1) -> Section {
    let s = &table.scene.statistics;
    let paper = match table.stands_for {
        Published::Motor => "MOTOR",
        Published::Cloth => "CLOTH",
    };
    let mut part = Section::new(format!("{}, beside {paper}", code(&table.scene.name)));
    part.paragraph(format!(
        "{}. {:.2} million fragments, {:.1} per covered pixel (95 % of them have \
         at most {}), an edge in {:.0} % of the covered pixels.",
        table.origin,
        s.fragments as f64 / 1e6,
        s.depth_complexity.mean,
        s.depth_complexity.p95,
        100.0 * (1.0 - s.interior_pixels as f64 / s.covered_pixels.max(1) as f64),
    ));
    let rows = COUNTS.iter().zip(table.stands_for.rmse()).map(|(n, [paper_lk, paper_e])| {
        let [lk, e, naive] = runs(table, *n).map(|r| r.fine);
        [
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
    });
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
    part.table(header, rows);
    part.paragraph(
        "The same against the exact picture of the same samples (noise alone), with and without \
         the pixels that an edge crosses:",
    );
    let rows = COUNTS.iter().map(|n| {
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
    });
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
    part.table(header, rows);
    if index == 0 {
        part.paragraph(
            "(RMSE on sRGB-encoded values are those of the numbers that an 8-bit display is sent.)",
        );
    }
    part
}

/// Regions with fewer pixels say nothing.
const LEAST_PIXELS: u64 = 1000;

/// The runs of [`DESIGNS`] at a sample count.
pub(super) fn runs(table: &Table1, samples: u32) -> [&Record; 3] {
    DESIGNS.map(|design| {
        let found = table.scene.record(design, samples);
        found.expect("every design was run at every count")
    })
}

fn plain_srgb(r: &Record) -> String {
    format!("{:.2}", r.covered.rmse_srgb.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(value: f64) -> Estimate {
        Estimate::around(value, 0.01)
    }

    #[test]
    fn few_samples_are_close_to_many_as_far_as_the_paper_prints() {
        let [motor, cloth] = printed_few_to_many();
        assert!((motor - 10.3 / 8.7).abs() < 1e-12 && (cloth - 5.6 / 4.1).abs() < 1e-12);
        assert!(close(known(6.5 / 6.3)) && close(known(cloth)));
        assert!(!close(known(6.5 / 3.0)) && !close(known(cloth + 0.02)));
    }
}
