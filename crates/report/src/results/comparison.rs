//! The results' part on all designs over the same fragments.

use crate::document::{Section, Text, code};
use crate::results::front;
use crate::results::ratios::{OnScenes, below};
use screendoor_study::study::comparison::{Comparison, Contender, Duel};
use screendoor_study::study::publications::experiment::MeasuredScene;
use screendoor_study::study::record::Record;

/// Counts of the printed tables.
const SHOWN: [u32; 3] = [4, 8, 16];
/// Budgets of state in bytes per pixel of the table of winners.
const BUDGETS: [f64; 5] = [48.0, 96.0, 192.0, 384.0, 768.0];

/// The section.
pub(super) fn section(c: &Comparison) -> Section {
    let mut section = Section::new("All designs over the same fragments");
    preamble(&mut section, c);
    section.parts.extend(SHOWN.map(|count| table(c, count)));
    section.parts.extend([methods(c), winners(c), front::section(c), duels(c)]);
    section
}

fn preamble(section: &mut Section, c: &Comparison) {
    section.paragraph(format!(
        "Every design of the registry with its defaults, and with each of its methods, at n \
         samples per pixel and, where it keeps layers, n layers (`slab`: 2n coverage bits, as in \
         Wyman's figure 1); {} × {} pixels, {} seeds of what is random. RMSE over the covered \
         pixels against the exact picture of the same samples, in 8-bit units, and in brackets the \
         mean error: picture minus exact picture over the covered pixels, with its sign, ± half of \
         its 95 % interval over the seeds where seeds change anything. An interval without 0 shows \
         a bias; errors of both signs cancel in the mean. *At equal depths*: the share of the \
         fragments that meet another one of their depth at a sample, where promises for differing \
         depths are not kept. *State*: bytes per pixel in hardware, without a z-buffer for opaque geometry \
         where the scene has none. *Passes* over the trace.",
        c.side, c.side, c.seeds
    ));
    let row = |s: &MeasuredScene| {
        let t = &s.statistics;
        let percent = |n: u64| format!("{:.0} %", 100.0 * n as f64 / t.fragments.max(1) as f64);
        [
            s.name.to_string(),
            format!("{:.2} M", t.fragments as f64 / 1e6),
            format!("{:.1}", t.depth_complexity.mean),
            t.depth_complexity.p95.to_string(),
            t.depth_complexity.max.to_string(),
            format!("{:.2}", t.alpha.mean),
            percent(t.alpha.opaque),
            percent(t.tied_fragments),
        ]
    };
    let header = [
        "scene",
        "fragments",
        "per covered pixel",
        "95 %",
        "most",
        "mean alpha",
        "opaque",
        "at equal depths",
    ];
    section.table(header, c.scenes.iter().map(row));
    for missing in &c.missing {
        section.paragraph(format!("{} was not given and is left out.", code(missing)));
    }
}

fn bytes(r: &Record) -> String {
    r.state_bytes().map_or("grows".to_string(), |bytes| format!("{bytes:.0}"))
}

/// Smallest and largest of what differs from scene to scene.
fn range(values: impl Iterator<Item = String>) -> String {
    let mut values: Vec<String> = values.collect();
    values.dedup();
    let least = values.iter().min_by_key(|v| v.parse::<u64>().unwrap_or(u64::MAX));
    let most = values.iter().max_by_key(|v| v.parse::<u64>().unwrap_or(u64::MAX));
    match (least, most) {
        (Some(a), Some(b)) if a == b => a.clone(),
        (Some(a), Some(b)) => format!("{a} to {b}"),
        _ => String::new(),
    }
}

fn table(c: &Comparison, count: u32) -> Section {
    let mut part = Section::new(format!("{count} samples or layers"));
    let rows = c.contenders.iter().map(|contender| {
        let records: Vec<_> = c.scenes.iter().map(|s| s.record(&contender.series, count)).collect();
        let there = || records.iter().copied().flatten();
        let mut row = vec![
            format!("`{}`", contender.label),
            range(there().map(bytes)),
            range(there().map(|r| r.passes.to_string())),
        ];
        row.extend(records.iter().map(|r| r.map_or("—".into(), cell)));
        row
    });
    let scenes = c.scenes.iter().map(|s| s.name.as_str());
    part.table(["design", "state", "passes"].into_iter().chain(scenes), rows);
    part
}

fn cell(r: &Record) -> String {
    let (rmse, mean) = (r.covered.rmse.value, r.covered.mean);
    let half = match mean.half_width() {
        0.0 => String::new(),
        half => format!(" ± {half:.2}"),
    };
    format!("{rmse:.1} ({:+.2}{half})", mean.value)
}

/// The ratio of two contenders' errors on every scene.
fn ratios(c: &Comparison, a: &Contender, b: &Contender, count: u32) -> OnScenes {
    let ratio = |s: &MeasuredScene| {
        let error = |i: &Contender| s.record(&i.series, count).map(|r| r.covered.rmse);
        Some((s.name.clone(), error(a)?.ratio(error(b)?)))
    };
    OnScenes(c.scenes.iter().filter_map(ratio).collect())
}

/// `lk` and `systematic` with each method, beside `enderton` with the same.
fn pairs(c: &Comparison) -> Vec<(String, &Contender, &Contender)> {
    let methods = ["", ":method=alpha-correction", ":method=depth", ":method=depth-correction"];
    let named = methods.into_iter().flat_map(|method| {
        ["lk", "systematic"]
            .map(|design| (format!("{design}{method}"), format!("enderton{method}")))
    });
    named.filter_map(|(a, b)| Some((a.clone(), c.contender(&a)?, c.contender(&b)?))).collect()
}

/// The samples at which the methods' ratios are summed up.
const SUMMED_UP: u32 = 8;

/// What LK's and systematic samples gain, in a sentence a design.
pub(super) fn in_short(c: &Comparison) -> Vec<Text> {
    let gains = |design: &str| {
        let own = |name: &str| name.split(':').next() == Some(design);
        let of = pairs(c).into_iter().filter(|(name, ..)| own(name)).map(|(name, a, b)| {
            let list = ratios(c, a, b, SUMMED_UP);
            format!(
                "`{name}` {:.2} (smaller {})",
                list.mean(),
                list.holding(|e| below(e, 1.0)).words()
            )
        });
        of.collect::<Vec<_>>().join("; ")
    };
    let names: Vec<&str> = c.scenes.iter().map(|s| s.name.as_str()).collect();
    let line = |design: &str| {
        format!(
            "**`{design}` in Enderton's methods** ({}; {} × {} pixels, {} seeds): RMSE at {SUMMED_UP} \
             samples relative to `enderton` with the same method, in the geometric mean: {}.",
            names.join(", "),
            c.side,
            c.side,
            c.seeds,
            gains(design)
        )
    };
    ["lk", "systematic"].map(|design| line(design).into()).to_vec()
}

/// What LK's and systematic sampling gain in Enderton's methods.
fn methods(c: &Comparison) -> Section {
    let mut part = Section::new("LK and systematic sampling in the methods of several passes");
    part.paragraph(format!(
        "LK leave it to future work to quantify what their samples gain in the methods of \
         Enderton et al. RMSE relative to `enderton` with the same method and samples, the \
         geometric mean over the {} scenes of the tables above; at {SUMMED_UP} samples the range, and \
         where it is below 1 by more than its interval.",
        c.scenes.len()
    ));
    let row = |(name, a, b): (String, &Contender, &Contender)| {
        let of = |count| ratios(c, a, b, count);
        let mut row = vec![format!("`{name}`")];
        row.extend(SHOWN.into_iter().chain([32]).map(|n| match of(n) {
            list if list.0.is_empty() => "—".to_string(),
            list => format!("{:.3}", list.mean()),
        }));
        let summed_up = of(SUMMED_UP);
        row.push(summed_up.range());
        row.push(summed_up.holding(|e| below(e, 1.0)).words());
        row
    };
    let header = ["design", "4", "8", "16", "32", "at 8", "smaller at 8"];
    part.table(header, pairs(c).into_iter().map(row));
    part
}

/// Designs that forget the order of fragments.
const FORGETFUL: [&str; 2] = ["blend", "wboit"];

/// Who has the least error within a budget of state.
fn winners(c: &Comparison) -> Section {
    let [.., most] = BUDGETS;
    let forgets = |s: &&MeasuredScene| {
        let winner = winner(c, s, most, false);
        FORGETFUL.iter().any(|name| winner.starts_with(&format!("`{name}`")))
    };
    let forgetful: Vec<&str> = c.scenes.iter().filter(forgets).map(|s| s.name.as_str()).collect();
    let mut part = Section::new("Who wins within a budget");
    part.paragraph(format!(
        "The design with the least RMSE among all whose state fits, at any of {} samples or \
         layers; then the best of those that read the trace once. `sorted-blend` is left out: its \
         application does the work. What forgets the order of fragments ({}) is best with the \
         most state on {} of {} scenes: {}.",
        screendoor_study::study::comparison::COUNTS.map(|n| n.to_string()).join(", "),
        FORGETFUL.map(|name| format!("`{name}`")).join(", "),
        forgetful.len(),
        c.scenes.len(),
        if forgetful.is_empty() { "none".to_string() } else { forgetful.join(", ") }
    ));
    let mut header = vec!["scene".to_string(), "passes".to_string()];
    header.extend(BUDGETS.iter().map(|b| format!("{b:.0} bytes")));
    let mut rows = Vec::new();
    for scene in &c.scenes {
        for single in [false, true] {
            let mut row =
                vec![scene.name.to_string(), if single { "one" } else { "any" }.to_string()];
            row.extend(BUDGETS.iter().map(|budget| winner(c, scene, *budget, single)));
            rows.push(row);
        }
    }
    part.table(header, rows);
    part
}

fn winner(c: &Comparison, scene: &MeasuredScene, budget: f64, single: bool) -> String {
    let fits = |(contender, r): &(&Contender, &Record)| {
        r.state_bytes().is_some_and(|bytes| bytes <= budget)
            && (!single || r.passes == 1)
            && !contender.sorted_by_application
    };
    let owned = scene.records.iter().filter_map(|r| Some((c.contender_of(r)?, r)));
    let rmse = |r: &Record| r.covered.rmse.value;
    let best = owned.filter(fits).min_by(|(_, a), (_, b)| rmse(a).total_cmp(&rmse(b)));
    best.map_or("—".to_string(), |(contender, r)| {
        format!("`{}` {}: {:.1}", contender.label, r.samples, rmse(r))
    })
}

/// Every pair at equal state.
fn duels(c: &Comparison) -> Section {
    let mut part = Section::new("Every pair at equal state");
    part.paragraph(
        "Scenes on which the row's design has the smaller error, and on which the column's has, with \
         the same bytes of state: the geometric mean of the ratio of their errors over the state \
         sizes of either that lie within the range of both, errors between two counts \
         interpolated; within 2 % neither wins. — where the ranges do not meet.",
    );
    let is_bounded = |contender: &Contender| {
        let mut all = c.scenes.iter().flat_map(|s| &s.records);
        all.any(|r| contender.owns(r) && !r.state_bits.unbounded)
    };
    let bounded: Vec<(usize, &Contender)> =
        (1..).zip(&c.contenders).filter(|(_, contender)| is_bounded(contender)).collect();
    let rows = bounded.iter().map(|(i, a)| {
        let duels: Vec<Duel> = bounded.iter().map(|(_, b)| c.duel(a, b)).collect();
        let sum = |of: fn(&Duel) -> u32| duels.iter().map(of).sum::<u32>().to_string();
        let mut row =
            vec![i.to_string(), format!("`{}`", a.label), sum(|d| d.won), sum(|d| d.lost)];
        row.extend(bounded.iter().zip(&duels).map(|((_, b), d)| match d {
            _ if a == b => String::new(),
            Duel { won: 0, lost: 0, even: 0 } => "—".to_string(),
            d => format!("{}:{}", d.won, d.lost),
        }));
        row
    });
    let mut header = ["", "design", "won", "lost"].map(str::to_string).to_vec();
    header.extend(bounded.iter().map(|(i, _)| i.to_string()));
    part.table(header, rows);
    part
}
