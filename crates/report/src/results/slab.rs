//! Wyman's claim for SLAB.

use crate::document::{Against, Agreement, Section};
use screendoor_study::study::comparison::{
    Comparison, Contender, SLAB_CLAIM, SLAB_LAYERS, SLAB_LIMIT, SLAB_RIVALS,
};
use screendoor_study::study::publications::experiment::MeasuredScene;
use screendoor_study::study::record::Record;

/// Samples of stochastic transparency that SLAB is claimed to be better than.
const CLAIMED: u32 = 32;

/// SLAB with one normalisation against stochastic transparency with the same.
struct Duel<'a> {
    antialiased: bool,
    slab: &'static str,
    rival: &'static str,
    scenes: &'a [MeasuredScene],
    places: [&'a Contender; 2],
}

impl Duel<'_> {
    /// On how many scenes SLAB has the smaller error than its rival at `count` samples.
    fn won(&self, count: u32) -> usize {
        let better = |s: &&MeasuredScene| {
            let error =
                |i: usize, n| s.record(&self.places[i].series, n).map(|r| r.covered.rmse.value);
            error(0, SLAB_LAYERS).zip(error(1, count)).is_some_and(|(slab, rival)| slab < rival)
        };
        self.scenes.iter().filter(better).count()
    }

    /// SLAB's bytes of state ÷ its rival's with as many samples as SLAB has layers.
    fn state(&self) -> Option<f64> {
        let scene = self.scenes.first()?;
        let bytes = |i: usize| scene.record(&self.places[i].series, SLAB_LAYERS)?.state_bytes();
        Some(bytes(0)? / bytes(1)?)
    }

    fn verdict(&self) -> String {
        match self.won(CLAIMED) {
            n if n == self.scenes.len() => "confirmed".to_string(),
            0 => "refuted".to_string(),
            n => format!("on {n} of {}", self.scenes.len()),
        }
    }
}

fn duels(c: &Comparison) -> Vec<Duel<'_>> {
    let sets = [(true, &c.scenes), (false, &c.without_antialiasing)];
    sets.into_iter()
        .flat_map(|(antialiased, scenes)| {
            SLAB_CLAIM.into_iter().filter_map(move |[slab, rival]| {
                let places = [c.contender(slab)?, c.contender(rival)?];
                Some(Duel { antialiased, slab, rival, scenes, places })
            })
        })
        .collect()
}

/// Fewest and most in words.
fn range(values: impl Iterator<Item = usize> + Clone) -> String {
    match (values.clone().min(), values.max()) {
        (Some(a), Some(b)) if a == b => a.to_string(),
        (Some(a), Some(b)) => format!("{a} to {b}"),
        _ => "—".to_string(),
    }
}

/// The claim beside what is measured.
fn against(c: &Comparison) -> Against {
    let duels = duels(c);
    let won = |antialiased: bool| {
        range(duels.iter().filter(|d| d.antialiased == antialiased).map(|d| d.won(CLAIMED)))
    };
    // As Enderton et al. show figures 2 and 4: without antialiasing.
    let shown = duels.iter().filter(|d| !d.antialiased);
    let statements: Vec<bool> = shown
        .flat_map(|d| {
            let won = d.won(CLAIMED);
            (0..d.scenes.len()).map(move |i| i < won)
        })
        .collect();
    let states: Vec<f64> = duels.iter().filter_map(Duel::state).collect();
    let least = states.iter().copied().fold(f64::INFINITY, f64::min);
    let most = states.iter().copied().fold(0.0, f64::max);
    let total = c.scenes.len();
    Against {
        section: "Wyman's claim".to_string(),
        source: "Wyman 2016, abstract".to_string(),
        printed: "SLAB is better than 32 samples of stochastic transparency for roughly the cost \
                  and memory of 8."
            .to_string(),
        measured: format!(
            "With {SLAB_LAYERS} layers, by normalisation, SLAB beats {CLAIMED} samples on {} of \
             {total} scenes without antialiasing and on {} with it, for {least:.1} to {most:.1} \
             times the state of {SLAB_LAYERS} samples.",
            won(false),
            won(true)
        ),
        agreement: Agreement::of(&statements),
        remark: format!(
            "It holds in {} of {} pairs of normalisation and scene without antialiasing, which is \
             how Enderton et al. show figures 2 and 4.",
            statements.iter().filter(|holds| **holds).count(),
            statements.len()
        ),
    }
}

/// The section.
pub(super) fn section(c: &Comparison) -> Section {
    let mut section = Section::answering(against(c));
    section.paragraph(format!(
        "On how many of {} scenes `slab` with {SLAB_LAYERS} layers has a smaller RMSE than `enderton` \
         with the same normalisation at {} samples, {} × {} pixels, {} seeds: with antialiasing, \
         where each of the pieces of a surface that share a pixel takes a layer, and without, all \
         samples at the pixel's centre.",
        c.scenes.len(),
        SLAB_RIVALS.map(|n| n.to_string()).join(", "),
        c.side,
        c.side,
        c.seeds
    ));
    let row = |duel: Duel<'_>| {
        let antialiasing = if duel.antialiased { "with" } else { "without" };
        let names = [duel.slab, duel.rival].map(|name| format!("`{name}`"));
        let mut row = vec![antialiasing.to_string()];
        row.extend(names);
        row.extend(SLAB_RIVALS.map(|count| duel.won(count).to_string()));
        row.push(duel.verdict());
        row.push(duel.state().map(|s| format!("{s:.1}")).unwrap_or_default());
        row
    };
    let mut header = ["antialiasing", "design", "against"].map(str::to_string).to_vec();
    header.extend(SLAB_RIVALS.map(|n| n.to_string()));
    header.extend([format!("better than {CLAIMED}"), "state ÷ that of 8 samples".to_string()]);
    section.table(header, duels(c).into_iter().map(row));
    errors(&mut section, c);
    section
}

/// The errors that the claim rests on.
fn errors(section: &mut Section, c: &Comparison) {
    section.paragraph(format!(
        "The errors, without antialiasing (bytes of state per pixel in brackets; `{SLAB_LIMIT}` is \
         what `slab` becomes with ever more bits):"
    ));
    let columns = [
        ("slab", SLAB_LAYERS),
        ("enderton:method=depth-correction", 8),
        ("enderton:method=depth-correction", CLAIMED),
        ("slab:normalise=none", SLAB_LAYERS),
        ("enderton", 8),
        ("enderton", CLAIMED),
        (SLAB_LIMIT, SLAB_LAYERS),
    ];
    let row = |scene: &MeasuredScene| {
        let layers = scene.statistics.depth_complexity.mean;
        let mut row = vec![scene.name.clone(), format!("{layers:.1}")];
        row.extend(columns.iter().map(|(label, count)| {
            let found = c.contender(label).and_then(|i| scene.record(&i.series, *count));
            found.map_or("—".to_string(), cell)
        }));
        row
    };
    let mut header = vec!["scene".to_string(), "layers".to_string()];
    header.extend(columns.map(|(label, n)| format!("`{label}`, {n}")));
    section.table(header, c.without_antialiasing.iter().map(row));
}

/// An error with its interval, where there is one, and the state.
fn cell(r: &Record) -> String {
    let e = r.covered.rmse;
    let interval =
        if e.low == e.high { String::new() } else { format!(" ± {:.2}", e.half_width()) };
    let bytes = r.state_bytes().unwrap_or(f64::INFINITY);
    format!("{:.2}{interval} ({bytes:.0})", e.value)
}
