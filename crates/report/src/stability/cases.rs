//! What designs and engines make of hard cases.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::markdown_table;
use crate::stability::{in_cell, short};
use screendoor_study::study::record::Promise;
use screendoor_study::study::stress::{
    DECIDED, Facts, Finding, Group, HEAVY_SEEDS, Outcome, SIGNIFICANCE, Series, Stability, Tally,
};
use screendoor_trace::param::Options;

pub(super) fn text(text: &mut String, found: &Stability) {
    let [exact, within, undecided, degraded, not_finite, refused] =
        Outcome::count(found.findings.iter().map(|f| &f.outcome));
    let names = found.series.iter().map(|s| s.name.split(':').next().unwrap_or(&s.name));
    let names: BTreeSet<&str> = names.collect();
    let _ = writeln!(
        text,
        "## Hard cases\n\n\
         {} designs with {} sets of parameters on {} cases, {} results: {exact} exact, {within} within the \
         stated bound, {undecided} undecided, {degraded} degraded, {refused} refused, {not_finite} with \
         pixels that are not finite.\n",
        names.len(),
        found.series.len(),
        found.cases.len(),
        found.findings.len(),
    );
    let tied = found.cases.iter().filter(|c| c.tied_fragments > 0).count();
    let conditional: Vec<String> = found
        .series
        .iter()
        .filter(|s| s.unbiased == Promise::DistinctDepths)
        .map(|s| format!("`{}`", s.name))
        .collect();
    let _ = writeln!(
        text,
        "The truth is composited sample by sample in double precision with compensated sums. An \
         error is a share of what the pixel's contributions come to without their signs, the worst \
         channel of the worst kind of pixel.\n\n\
         | cell | meaning |\n|---|---|\n\
         | = | every pixel of every seed is off by 2^-23 of that at most |\n\
         | ≤ e | off by e, within what rounding to single precision may come to there |\n\
         | ± n | the mean over pixels and seeds is within what chance and rounding allow, at most {}; \
         n is the noise, the root mean square of single pixels' deviations from that mean |\n\
         | ± n ? | the same with a wider bound, which decides little |\n\
         | off e, off e ± n | degraded: the mean is off by e, beyond that bound |\n\
         | **not finite** | sums overflow; the replay warns, a study puts the run down as missing |\n\
         | refused (i) | the design says why it cannot: message i |\n\n\
         Designs that are random are measured over {} seeds ({} at most where a case has more than \
         2^17 fragments); their bounds are crossed by chance alone anywhere in the table with a \
         probability of {} (Student's t, Bonferroni). What is promised to be unbiased and is off is \
         a broken promise, and so is an engine that differs. {tied} cases have fragments that share \
         a depth at a sample: what is promised where depths differ ({}) may be off there. All is \
         promised of colours of single precision: where sums of half floats are off, the same \
         design with `colour=32` is held to it.\n",
        DECIDED,
        found.seeds,
        HEAVY_SEEDS,
        SIGNIFICANCE,
        if conditional.is_empty() { "of none here".to_string() } else { conditional.join(", ") },
    );
    engines(text, found);
    summary(text, found);
    let mut messages = Vec::new();
    for (group, choice) in Group::ALL.iter().zip(Group::CHOICES) {
        let cases: Vec<&Facts> = found.cases.iter().filter(|c| c.group == *group).collect();
        if cases.is_empty() {
            continue;
        }
        let _ = writeln!(text, "### {}\n\n{}:\n", sentence(choice.name), sentence(choice.help));
        for case in &cases {
            let _ = writeln!(text, "- **{}**: {}", case.name, case.what);
        }
        text.push('\n');
        let head: Vec<&str> =
            std::iter::once("design").chain(cases.iter().map(|c| c.name.as_str())).collect();
        let rows: Vec<Vec<String>> =
            found.series.iter().map(|s| row(found, s, &cases, &mut messages)).collect();
        text.push_str(&markdown_table(&head, &rows));
        text.push('\n');
        match group {
            Group::Opacity => fixed_point(text, found),
            Group::Order => cost(text, found, &cases),
            _ => {}
        }
    }
    for (i, message) in messages.iter().enumerate() {
        let _ = writeln!(text, "{}. {message}", i + 1);
    }
    if !messages.is_empty() {
        text.push('\n');
    }
}

/// How often each design is right.
fn summary(text: &mut String, found: &Stability) {
    let groups: Vec<Group> =
        Group::ALL.iter().copied().filter(|g| found.cases.iter().any(|c| c.group == *g)).collect();
    let right = |series: &Series, group: Group| {
        let cases = found.cases.iter().filter(|c| c.group == group);
        let findings = cases.filter_map(|c| found.finding(&c.name, &series.name));
        Tally::of(findings.map(|f| &f.outcome)).to_string()
    };
    let rows: Vec<Vec<String>> = found
        .series
        .iter()
        .map(|s| {
            let cells = groups.iter().map(|g| right(s, *g));
            std::iter::once(format!("`{}`", s.name)).chain(cells).collect()
        })
        .collect();
    let names = groups.iter().map(|g| Group::CHOICES[*g as usize].name);
    let head: Vec<&str> = std::iter::once("design").chain(names).collect();
    text.push_str(
        "Cases in which a design is exact or within its bound, by what is hard about them; undecided \
         ones count as neither right nor wrong:\n\n",
    );
    text.push_str(&markdown_table(&head, &rows));
    text.push('\n');
}

fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// How the engines agree.
fn engines(text: &mut String, found: &Stability) {
    let all = found.findings.iter().flat_map(|f| &f.engines);
    let on = |gpu: bool| all.clone().filter(move |a| a.is_gpu() == gpu);
    let same = |gpu: bool| on(gpu).filter(|a| a.difference == Some(0.0)).count();
    let _ = write!(
        text,
        "Engines on this machine: {}. Of {} pictures of the processor's engines {} are the plain \
         text's bit for bit.",
        found.engines.join(", "),
        on(false).count(),
        same(false)
    );
    if on(true).next().is_some() {
        let most = on(true).filter_map(|a| a.difference).fold(0.0, f64::max);
        let refused = on(true).filter(|a| a.refused.is_some()).count();
        let _ = write!(
            text,
            " Of {} on the GPU {} are, {} are refused, and the others differ by {} of one plus the \
             value at most.",
            on(true).count(),
            same(true),
            refused,
            short(most)
        );
    }
    text.push_str("\n\n");
}

fn row(
    found: &Stability,
    series: &Series,
    cases: &[&Facts],
    messages: &mut Vec<String>,
) -> Vec<String> {
    let mut row = vec![format!("`{}`", series.name)];
    for case in cases {
        let finding = found.finding(&case.name, &series.name);
        row.push(finding.map_or_else(String::new, |f| cell(f, series.seeded, messages)));
    }
    row
}

fn cell(finding: &Finding, seeded: bool, messages: &mut Vec<String>) -> String {
    match &finding.outcome {
        Outcome::Exact => "=".to_string(),
        Outcome::Within { noise, .. } if seeded => format!("± {}", short(*noise)),
        Outcome::Within { error, .. } => format!("≤ {}", short(*error)),
        Outcome::Undecided { noise, .. } => format!("± {} ?", short(*noise)),
        // Noise next to nothing says nothing.
        Outcome::Degraded { error, noise, .. } if seeded && noise > &(1e-3 * error) => {
            format!("off {} ± {}", short(*error), short(*noise))
        }
        Outcome::Degraded { error, .. } => format!("off {}", short(*error)),
        Outcome::NotFinite { .. } => "**not finite**".to_string(),
        Outcome::Refused { message } => {
            let known = messages.iter().position(|m| m == message);
            let number = known.unwrap_or_else(|| {
                messages.push(message.clone());
                messages.len() - 1
            });
            format!("refused ({})", number + 1)
        }
    }
}

/// Why `lk` has noise where nothing should show.
fn fixed_point(text: &mut String, found: &Stability) {
    let passes = |f: &Finding| f.outcome != Outcome::Exact;
    if found.finding("smallest denormal", "lk").is_some_and(passes) {
        text.push_str(
            "The noise of `lk` at the smallest alphas is one sample of one pixel of one seed: the hash \
             of LK figure 4 leaves 0 at 0, so with seed 0 the first sample of the first pixel has the \
             reference value 0, which any alpha above 0 exceeds.\n\n",
        );
    }
}

/// What misleading orders cost: noise as a multiple of that of the same fragments in the
/// order that is expected.
fn cost(text: &mut String, found: &Stability, cases: &[&Facts]) {
    let misled: Vec<(&&Facts, &str)> = cases.iter().filter_map(|c| Some((c, c.against?))).collect();
    let noise = |case: &str, design: &str| match found.finding(case, design)?.outcome {
        Outcome::Within { noise, .. }
        | Outcome::Undecided { noise, .. }
        | Outcome::Degraded { noise, .. }
            if noise > 1e-9 =>
        {
            Some(noise)
        }
        _ => None,
    };
    let mut rows = Vec::new();
    for series in found.series.iter().filter(|s| s.seeded) {
        let cells: Vec<String> = misled
            .iter()
            .map(|(case, against)| {
                let both = noise(&case.name, &series.name).zip(noise(against, &series.name));
                both.map_or("—".to_string(), |(misled, expected)| {
                    format!("{:.2}", misled / expected)
                })
            })
            .collect();
        rows.push([vec![format!("`{}`", series.name)], cells].concat());
    }
    if rows.is_empty() {
        return;
    }
    text.push_str(
        "What that costs: the noise of the misleading order, as a multiple of the noise of the same \
         fragments surface by surface (— where one of them has none).\n\n",
    );
    let head: Vec<&str> =
        std::iter::once("design").chain(misled.iter().map(|(c, _)| c.name.as_str())).collect();
    text.push_str(&markdown_table(&head, &rows));
    text.push('\n');
}

pub(super) fn unfit(text: &mut String, found: &Stability) {
    text.push_str(
        "## What no trace may hold\n\n\
         One rule: alpha is in [0, 1], colours are finite, a fragment covers at least one sample and \
         none that does not exist. Nothing is clamped in silence: a value outside is refused with \
         its row when it is written, and by the same check when another program's trace is read \
         (`nan-alpha.arrow`, `coverage.arrow` of `traces/hostile`).\n\n",
    );
    let rows: Vec<Vec<String>> = found
        .unfit
        .iter()
        .map(|u| {
            let said =
                u.written.as_deref().map_or("taken".to_string(), |m| format!("refused: {m}"));
            vec![u.what.to_string(), in_cell(&said)]
        })
        .collect();
    text.push_str(&markdown_table(&["value", "what happens"], &rows));
    text.push('\n');
}
