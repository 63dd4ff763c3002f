//! What designs and engines make of hard cases.

use std::collections::BTreeSet;

use crate::document::Section;
use crate::stability::short;
use screendoor_study::study::record::Promise;
use screendoor_study::study::stress::{
    DECIDED, Facts, Finding, Group, HEAVY_SEEDS, Outcome, SIGNIFICANCE, Series, Stability, Tally,
};
use screendoor_trace::param::Options;

pub(super) fn section(found: &Stability) -> Section {
    let [exact, within, undecided, degraded, not_finite, refused] =
        Outcome::count(found.findings.iter().map(|f| &f.outcome));
    let names = found.series.iter().map(|s| s.name.split(':').next().unwrap_or(&s.name));
    let names: BTreeSet<&str> = names.collect();
    let mut section = Section::new("Hard cases");
    section.paragraph(format!(
        "{} designs with {} sets of parameters on {} cases, {} results: {exact} exact, {within} within the \
         stated bound, {undecided} undecided, {degraded} degraded, {refused} refused, {not_finite} with \
         pixels that are not finite.",
        names.len(),
        found.series.len(),
        found.cases.len(),
        found.findings.len(),
    ));
    let tied = found.cases.iter().filter(|c| c.tied_fragments > 0).count();
    let conditional: Vec<String> = found
        .series
        .iter()
        .filter(|s| s.unbiased == Promise::DistinctDepths)
        .map(|s| format!("`{}`", s.name))
        .collect();
    section.paragraph(
        "The truth is composited sample by sample in double precision with compensated sums. An \
         error is a share of what the pixel's contributions come to without their signs, the worst \
         channel of the worst kind of pixel.",
    );
    let chance = format!(
        "the mean over pixels and seeds is within what chance and rounding allow, at most {DECIDED}; \
         n is the noise, the root mean square of single pixels' deviations from that mean"
    );
    let meanings = [
        ["=", "every pixel of every seed is off by 2^-23 of that at most"],
        ["≤ e", "off by e, within what rounding to single precision may come to there"],
        ["± n", &chance],
        ["± n ?", "the same with a wider bound, which decides little"],
        ["off e, off e ± n", "degraded: the mean is off by e, beyond that bound"],
        ["**not finite**", "sums overflow; the replay warns, a study puts the run down as missing"],
        ["refused (i)", "the design says why it cannot: message i"],
    ];
    section.table(["cell", "meaning"], meanings);
    section.paragraph(format!(
        "Designs that are random are measured over {} seeds ({} at most where a case has more than \
         2^17 fragments); their bounds are crossed by chance alone anywhere in the table with a \
         probability of {} (Student's t, Bonferroni). What is promised to be unbiased and is off is \
         a broken promise, and so is an engine that differs. {tied} cases have fragments that share \
         a depth at a sample: what is promised where depths differ ({}) may be off there. All is \
         promised of colours of single precision: where sums of half floats are off, the same \
         design with `colour=32` is held to it.",
        found.seeds,
        HEAVY_SEEDS,
        SIGNIFICANCE,
        if conditional.is_empty() { "of none here".to_string() } else { conditional.join(", ") },
    ));
    section.paragraph(engines(found));
    summary(&mut section, found);
    let mut messages = Vec::new();
    for (group, choice) in Group::ALL.iter().zip(Group::CHOICES) {
        let cases: Vec<&Facts> = found.cases.iter().filter(|c| c.group == *group).collect();
        if cases.is_empty() {
            continue;
        }
        let mut part = Section::new(sentence(choice.name));
        part.paragraph(format!("{}:", sentence(choice.help)));
        part.list(cases.iter().map(|case| format!("**{}**: {}", case.name, case.what)));
        let rows = found.series.iter().map(|s| row(found, s, &cases, &mut messages));
        part.table(head(cases.iter().map(|c| c.name.as_str())), rows);
        match group {
            Group::Opacity => fixed_point(&mut part, found),
            Group::Order => cost(&mut part, found, &cases),
            _ => {}
        }
        section.parts.push(part);
    }
    if !messages.is_empty() {
        section.end().numbered(1, messages);
    }
    section
}

/// The columns of a table of designs.
fn head<'a>(others: impl Iterator<Item = &'a str>) -> impl Iterator<Item = &'a str> {
    std::iter::once("design").chain(others)
}

/// How often each design is right.
fn summary(section: &mut Section, found: &Stability) {
    let groups: Vec<Group> =
        Group::ALL.iter().copied().filter(|g| found.cases.iter().any(|c| c.group == *g)).collect();
    let right = |series: &Series, group: Group| {
        let cases = found.cases.iter().filter(|c| c.group == group);
        let findings = cases.filter_map(|c| found.finding(&c.name, &series.name));
        Tally::of(findings.map(|f| &f.outcome)).to_string()
    };
    let rows = found.series.iter().map(|s| {
        let cells = groups.iter().map(|g| right(s, *g));
        std::iter::once(format!("`{}`", s.name)).chain(cells)
    });
    section.paragraph(
        "Cases in which a design is exact or within its bound, by what is hard about them; undecided \
         ones count as neither right nor wrong:",
    );
    section.table(head(groups.iter().map(|g| Group::CHOICES[*g as usize].name)), rows);
}

fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// How the engines agree.
fn engines(found: &Stability) -> String {
    let all = found.findings.iter().flat_map(|f| &f.engines);
    let on = |gpu: bool| all.clone().filter(move |a| a.is_gpu() == gpu);
    let same = |gpu: bool| on(gpu).filter(|a| a.difference == Some(0.0)).count();
    let mut text = format!(
        "Engines on this machine: {}. Of {} pictures of the processor's engines {} are the plain \
         text's bit for bit.",
        found.engines.join(", "),
        on(false).count(),
        same(false)
    );
    if on(true).next().is_some() {
        let most = on(true).filter_map(|a| a.difference).fold(0.0, f64::max);
        let refused = on(true).filter(|a| a.refused.is_some()).count();
        text += &format!(
            " Of {} on the GPU {} are, {} are refused, and the others differ by {} of one plus the \
             value at most.",
            on(true).count(),
            same(true),
            refused,
            short(most)
        );
    }
    text
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
fn fixed_point(part: &mut Section, found: &Stability) {
    let passes = |f: &Finding| f.outcome != Outcome::Exact;
    if found.finding("smallest denormal", "lk").is_some_and(passes) {
        part.paragraph(
            "The noise of `lk` at the smallest alphas is one sample of one pixel of one seed: the hash \
             of LK figure 4 leaves 0 at 0, so with seed 0 the first sample of the first pixel has the \
             reference value 0, which any alpha above 0 exceeds.",
        );
    }
}

/// What misleading orders cost: noise as a multiple of that of the same fragments in the
/// order that is expected.
fn cost(part: &mut Section, found: &Stability, cases: &[&Facts]) {
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
    part.paragraph(
        "What that costs: the noise of the misleading order, as a multiple of the noise of the same \
         fragments surface by surface (— where one of them has none).",
    );
    part.table(head(misled.iter().map(|(c, _)| c.name.as_str())), rows);
}

pub(super) fn unfit(found: &Stability) -> Section {
    let mut section = Section::new("What no trace may hold");
    section.paragraph(
        "One rule: alpha is in [0, 1], colours are finite, a fragment covers at least one sample and \
         none that does not exist. Nothing is clamped in silence: a value outside is refused with \
         its row when it is written, and by the same check when another program's trace is read \
         (`nan-alpha.arrow`, `coverage.arrow` of `traces/hostile`).",
    );
    let rows = found.unfit.iter().map(|u| {
        let said = u.written.as_deref().map_or("taken".to_string(), |m| format!("refused: {m}"));
        [u.what.to_string(), said]
    });
    section.table(["value", "what happens"], rows);
    section
}
