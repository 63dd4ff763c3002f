//! Costs as the papers print them.

use crate::document::{Against, Agreement, Section};
use crate::html::words::grouped;
use crate::results::ratios::yes;
use screendoor_study::study::publications::costs::{
    BASE, CostRow, Costs, FINAL, Growth, LAYERS, SAMPLES, SCENES, WymanTimes,
};

/// The mean of ratios.
fn geometric(values: &[f64]) -> f64 {
    (values.iter().map(|v| v.ln()).sum::<f64>() / values.len().max(1) as f64).exp()
}

fn ends(values: &[f64]) -> [f64; 2] {
    let of = |of: fn(f64, f64) -> f64| values.iter().copied().reduce(of).unwrap_or(f64::NAN);
    [of(f64::min), of(f64::max)]
}

/// A mean of ratios with the least and the greatest.
fn spread(values: &[f64]) -> String {
    let [low, high] = ends(values);
    format!("{:.2} [{low:.2}, {high:.2}]", geometric(values))
}

fn row<'a>(c: &'a Costs, design: &str) -> Option<&'a CostRow> {
    c.rows.iter().find(|row| row.design == design)
}

fn multiples_against(c: &Costs) -> Against {
    let own = row(c, FINAL);
    let [bytes, time] = [own.map(|row| &row.bytes), own.map(|row| &row.time)]
        .map(|v| v.cloned().unwrap_or_default());
    let within = |values: &[f64]| (3.0..=4.0).contains(&geometric(values));
    let statements = [within(&bytes), within(&time)];
    Against {
        section: "Costs as multiples of blending".to_string(),
        source: "Enderton et al. 2011, section 5, table 1".to_string(),
        printed: "The final algorithm takes three to four times as long as one alpha-blended pass over the \
                  same fragments."
            .to_string(),
        measured: format!(
            "`{FINAL}` ÷ `{BASE}` at {SAMPLES} samples, mean of {} scenes [least, greatest]: {} in bytes \
             of state moved, {} in time on this project's fast engines.",
            SCENES.len(),
            spread(&bytes),
            spread(&time)
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Three to four times in bytes: {}; in time: {}. Their times have the shading of one pass in \
             them, which is done before a trace is written: without it the passes weigh more.",
            yes(statements[0]),
            yes(statements[1])
        ),
    }
}

/// The section of table 1.
pub(super) fn multiples(c: &Costs) -> Option<Section> {
    let mut section = Section::answering(multiples_against(c));
    section.paragraph(format!(
        "Multiples of `{BASE}`: means of {} ({} × {} pixels, {SAMPLES} samples), with the least and the \
         greatest. Bytes are those of state that events count, over all passes; times are medians of five \
         replays in turns, {} threads, from fragments that lie sorted in memory.",
        SCENES.map(|scene| format!("`builtin:{scene}`")).join(", "),
        c.side,
        c.side,
        c.threads
    ));
    let rows = c.rows.iter().map(|row| {
        [format!("`{}`", row.design), row.passes.to_string(), spread(&row.bytes), spread(&row.time)]
    });
    let header = ["design", "passes", "bytes ÷ blend", "time ÷ blend"];
    section.table(header, rows.collect::<Vec<_>>());
    Some(section)
}

fn peeling_against(c: &Costs) -> Against {
    let [own, peeling] = &c.growth;
    let shallow: Vec<bool> = c.equal.iter().map(|e| e.layers < e.deepest).collect();
    let linear = (own.exponent - 1.0).abs() < 0.1;
    let square = (peeling.exponent - 2.0).abs() < 0.2;
    let statements = [shallow.iter().all(|s| *s), linear, square];
    let layers: Vec<String> =
        c.equal.iter().map(|e| format!("{} of {} ({})", e.layers, e.deepest, e.scene)).collect();
    let better = c.equal.iter().filter(|e| e.rmse[1] < e.rmse[0]).count();
    Against {
        section: "Depth peeling at equal cost".to_string(),
        source: "Enderton et al. 2011, section 5, figure 6".to_string(),
        printed: "In the time of stochastic transparency depth peeling draws five layers of a complex scene; \
                  its cost grows with the square of the primitives, that of stochastic transparency linearly."
            .to_string(),
        measured: format!(
            "For the bytes that `{FINAL}` moves, layers peeled of those in the deepest pixel: {}. Bytes grow \
             as layers to the power of {:.2}, with peeling of {:.2}.",
            layers.join(", "),
            own.exponent,
            peeling.exponent
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Peeling leaves layers undrawn on every scene: {}; linear: {}; square: {}. What is peeled for \
             these bytes has the greater error on {better} of {} scenes.",
            yes(statements[0]),
            yes(linear),
            yes(square),
            c.equal.len()
        ),
    }
}

/// The section of figure 6.
pub(super) fn peeling(c: &Costs) -> Option<Section> {
    let mut section = Section::answering(peeling_against(c));
    let rows = c.equal.iter().map(|e| {
        [
            format!("`builtin:{}`", e.scene),
            e.deepest.to_string(),
            e.layers.to_string(),
            format!("{:.2}", e.rmse[0]),
            format!("{:.2}", e.rmse[1]),
        ]
    });
    let rmse = format!("RMSE of `{FINAL}`");
    let header = ["scene", "deepest pixel", "layers peeled", "RMSE of these", rmse.as_str()];
    section.table(header, rows.collect::<Vec<_>>());
    section.paragraph("Bytes of state for each pixel of so many whole layers, all of them peeled:");
    let first = ["design".to_string()].into_iter();
    let header: Vec<String> =
        first.chain(LAYERS.iter().map(u32::to_string)).chain(["power".to_string()]).collect();
    let row = |g: &Growth| -> Vec<String> {
        let bytes = g.bytes.iter().map(|b| grouped(b.round() as u64));
        std::iter::once(format!("`{}`", g.design))
            .chain(bytes)
            .chain([format!("{:.2}", g.exponent)])
            .collect()
    };
    section.table(header, c.growth.iter().map(row).collect::<Vec<_>>());
    Some(section)
}

fn views_against(c: &Costs) -> Against {
    let ratio = |values: Vec<f64>| {
        let [low, high] = ends(&values);
        high / low
    };
    let bytes = ratio(c.views.iter().map(|v| v.bytes).collect());
    let deepest = ratio(c.views.iter().map(|v| f64::from(v.deepest)).collect());
    let fragments = ratio(c.views.iter().map(|v| v.fragments as f64).collect());
    let statements = [bytes < 1.1, deepest > bytes];
    Against {
        section: "Cost over views".to_string(),
        source: "Enderton et al. 2011, section 5".to_string(),
        printed:
            "Stability of run time is a major strength: the depth complexity varies with the view, \
                  with strong influence on depth peeling."
                .to_string(),
        measured: format!(
            "Over {} views of `builtin:engine`, greatest ÷ least: bytes a fragment of `{FINAL}` {bytes:.3}, \
             fragments {fragments:.2}, fragments of the deepest pixel (peels) {deepest:.2}.",
            c.views.len()
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "Bytes a fragment vary by less than a tenth: {}; peels vary more: {}.",
            yes(statements[0]),
            yes(statements[1])
        ),
    }
}

/// The section of views.
pub(super) fn views(c: &Costs) -> Option<Section> {
    let mut section = Section::answering(views_against(c));
    let rows = c.views.iter().map(|v| {
        [
            format!("{:.0}°", v.yaw),
            grouped(v.fragments),
            v.deepest.to_string(),
            format!("{:.1}", v.bytes),
        ]
    });
    let header = ["from", "fragments", "deepest pixel", "bytes a fragment"];
    section.table(header, rows.collect::<Vec<_>>());
    Some(section)
}

/// Printed times: SLAB ÷ stochastic transparency, and ÷ MLAB, by layers.
const PRINTED: [(u32, f64, f64); 2] = [(4, 3.1 / 2.1, 3.1 / 5.5), (8, 4.3 / 2.5, 4.3 / 8.0)];

/// Ratios of times that differ by no more than this factor are the same.
const LIKE: f64 = 1.25;

fn wyman_against(c: &Costs) -> Against {
    let like = |found: f64, printed: f64| (1.0 / LIKE..=LIKE).contains(&(found / printed));
    let printed = |own: &WymanTimes| PRINTED.into_iter().find(|(layers, ..)| *layers == own.layers);
    let mut statements = Vec::new();
    for own in &c.wyman {
        let Some((_, stochastic, mlab)) = printed(own) else { continue };
        statements.push(like(geometric(&own.to_stochastic), stochastic));
        statements.push(like(geometric(&own.to_mlab), mlab));
    }
    let said = c.wyman.iter().map(|own| {
        format!(
            "with {} layers {} and {}",
            own.layers,
            spread(&own.to_stochastic),
            spread(&own.to_mlab)
        )
    });
    let speeds = c.wyman.iter().map(|own| format!("{:.2}", geometric(&own.kbuffer)));
    Against {
        section: "Wyman's run times".to_string(),
        source: "Wyman 2016, section 3".to_string(),
        printed: "SLAB takes 1.48 and 1.72 times as long as stochastic transparency with 4 and 8 samples or \
                  layers, 0.56 and 0.54 times as long as multi-layer alpha blending, and as long as a k-buffer."
            .to_string(),
        measured: format!(
            "Time of `slab` ÷ that of `{FINAL}` and of `mlab`, means of {} scenes [least, greatest]: {}.",
            SCENES.len(),
            said.collect::<Vec<_>>().join("; ")
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "{} of {} ratios are as printed within a factor of {LIKE}. The k-buffer takes {} of SLAB's time: it \
             has an engine of sixteen pixels at a time here, SLAB has its plain text alone, so that these times say \
             little of the designs.",
            statements.iter().filter(|holds| **holds).count(),
            statements.len(),
            speeds.collect::<Vec<_>>().join(" and ")
        ),
    }
}

/// The section of Wyman's run times.
pub(super) fn wyman(c: &Costs) -> Option<Section> {
    Some(Section::answering(wyman_against(c)))
}
