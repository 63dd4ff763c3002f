//! What all sections are made of: figures, tables, tabs, commands.

use maud::{Markup, html};

use crate::chart::{Styles, key};
use crate::html::page::Extras;
use crate::html::words::{figures, fixed, quoted};
use screendoor_study::metrics::Estimate;
use screendoor_study::study::analysis::reference_count;
use screendoor_study::study::record::Record;
use screendoor_study::study::results::Results;

/// What sections draw from.
pub(super) struct Content<'a> {
    pub results: &'a Results,
    pub extras: &'a Extras,
    pub styles: Styles,
    /// The sample count at which designs are compared.
    pub count: u32,
}

impl<'a> Content<'a> {
    pub(super) fn new(results: &'a Results, extras: &'a Extras) -> Self {
        let family = |series: &String| {
            let own = results.records.iter().find(|r| r.series == *series);
            own.map_or("", |r| r.family.as_str())
        };
        let designs = results.study.designs.iter().map(|s| (s.as_str(), family(s)));
        let styles = Styles::new(designs);
        Content { results, extras, styles, count: reference_count(&results.study) }
    }

    /// The names of the study's scenes.
    pub(super) fn scenes(&self) -> impl Iterator<Item = &'a str> {
        self.results.study.scenes.iter().map(|s| s.name.as_str())
    }

    pub(super) fn designs(&self) -> &'a [String] {
        &self.results.study.designs
    }

    /// A design's record at the reference count.
    pub(super) fn at_count(&self, scene: &str, series: &str) -> Option<&'a Record> {
        self.results.record(scene, series, self.count)
    }

    /// A panel for each scene.
    pub(super) fn by_scene(&self, panel: impl Fn(&'a str) -> Markup) -> Markup {
        let panels: Vec<_> = self.scenes().map(|s| (s.to_string(), panel(s))).collect();
        tabs("Scene", &panels)
    }

    /// The command that measures the whole study.
    pub(super) fn study_command(&self) -> Markup {
        command(&self.extras.command)
    }

    /// The command that gives a run's errors and counts.
    pub(super) fn replay(&self, record: &Record) -> String {
        replay_command(self.results, record, record.seeds)
    }

    /// [`Content::replay`] of the baseline on the first scene that has it, as a pattern for all others.
    pub(super) fn replay_one(&self) -> Markup {
        let baseline = &self.results.study.baseline;
        let found = self.scenes().find_map(|s| self.at_count(s, baseline));
        html! { @if let Some(record) = found { (command(&self.replay(record))) } }
    }

    /// A design's marker and name.
    pub(super) fn named(&self, series: &str) -> Markup {
        html! { span class="design" { (key(&self.styles.of(series))) (name(series)) } }
    }

    /// All designs with their markers: what a chart's marks mean.
    pub(super) fn legend(&self, shown: impl Fn(&str) -> bool) -> Markup {
        html! {
            ul class="legend" aria-label="Designs" {
                @for series in self.designs().iter().filter(|s| shown(s)) {
                    li data-series=(series) { (self.named(series)) }
                }
            }
        }
    }
}

/// The command that replays a run with its first `seeds` seeds and holds it against the
/// exact picture. Traces are named as seen from the results' folder.
pub(crate) fn replay_command(results: &Results, record: &Record, seeds: u32) -> String {
    let trace = results.scenes.iter().find(|s| s.name == record.scene);
    let trace = trace.map_or("TRACE", |s| s.trace.as_str());
    let first = match results.study.first_seed {
        0 => String::new(),
        seed => format!(" --seed {seed}"),
    };
    let several = if seeds == 1 { String::new() } else { format!(" --seeds {seeds}") };
    format!(
        "screendoor replay {} --design {} --samples {}{several}{first} --exact",
        quoted(trace),
        quoted(&record.design),
        record.samples,
    )
}

/// A design's name, which may break where its parts do.
pub(super) fn name(design: &str) -> Markup {
    html! {
        code {
            @for part in design.split_inclusive([':', ',']) { (part) wbr; }
        }
    }
}

/// A command to copy.
pub(super) fn command(text: &str) -> Markup {
    html! { p class="command" { code { (text) } } }
}

/// A figure or table with its caption and how to make it again.
pub(super) fn figure(id: &str, body: &Markup, caption: &Markup, again: &Markup) -> Markup {
    html! {
        figure id=(id) {
            (body)
            figcaption { (caption) }
            (again)
        }
    }
}

/// Panels of which one is shown at a time. Without a script all are.
pub(super) fn tabs(label: &str, panels: &[(String, Markup)]) -> Markup {
    html! {
        div class="tabs" data-label=(label) {
            @for (i, (name, body)) in panels.iter().enumerate() {
                div class=(if i == 0 { "panel on" } else { "panel" }) data-name=(name) {
                    @if panels.len() > 1 { h4 class="panel-name" { (name) } }
                    (body)
                }
            }
        }
    }
}

/// A table's cell.
#[derive(Clone, Debug)]
pub(super) enum Cell {
    /// Words.
    Text(Markup),
    /// A number: its value to sort by, and how it is shown.
    Number(f64, String),
    /// An estimate with this many decimals.
    Estimate(Estimate, usize),
    /// Nothing, and why.
    Missing(String),
}

impl Cell {
    /// A number with three digits that count.
    pub(super) fn number(v: f64) -> Self {
        Cell::Number(v, figures(v))
    }

    /// Words.
    pub(super) fn text(text: impl Into<String>) -> Self {
        let text = text.into();
        Cell::Text(html! { (text) })
    }

    /// An estimate, or why there is none.
    pub(super) fn estimate(e: Option<Estimate>, decimals: usize, why: &str) -> Self {
        e.map_or(Cell::Missing(why.to_string()), |e| Cell::Estimate(e, decimals))
    }

    fn draw(&self) -> Markup {
        match self {
            Cell::Text(text) => html! { td { (text) } },
            Cell::Number(v, shown) => html! { td class="n" data-v=(v) { (shown) } },
            Cell::Estimate(e, decimals) => html! {
                td class="n" data-v=(e.value) data-low=(e.low) data-high=(e.high) {
                    (shown(*e, *decimals))
                    @if e.low != e.high {
                        " " span class="pm" { "±" (half_width(*e, *decimals)) }
                    }
                }
            },
            Cell::Missing(why) => html! { td class="n none" title=(why) { "—" } },
        }
    }
}

/// Half of an interval's width, as finely as the value; too few runs bound nothing.
fn half_width(e: Estimate, decimals: usize) -> String {
    match e.half_width() {
        half if !half.is_finite() => "∞".into(),
        half if vanishes(e.value, decimals) && !may_be_none(e) => figures(half),
        half => fixed(half, decimals),
    }
}

/// An estimate's value; one that cannot be told from 0 has no more decimals than others.
fn shown(e: Estimate, decimals: usize) -> String {
    if may_be_none(e) { fixed(e.value, decimals) } else { rounded(e.value, decimals) }
}

fn may_be_none(e: Estimate) -> bool {
    e.low < 0.0 && e.high > 0.0
}

/// A value with so many decimals; with more where it would round to 0 and is not.
pub(super) fn rounded(v: f64, decimals: usize) -> String {
    if vanishes(v, decimals) { figures(v) } else { fixed(v, decimals) }
}

fn vanishes(v: f64, decimals: usize) -> bool {
    v.abs() < 0.5 * 0.1_f64.powi(decimals as i32)
}

/// A table that can be sorted by its columns and scrolls in its own box. A column's head
/// stands over numbers where any of its cells is one.
pub(super) fn table(header: &[&str], rows: &[Vec<Cell>]) -> Markup {
    let numeric =
        |column: usize| rows.iter().any(|r| !matches!(r.get(column), Some(Cell::Text(_)) | None));
    html! {
        div class="scroll" tabindex="0" role="region" aria-label="Table" {
            table class="sortable" {
                thead { tr {
                    @for (i, name) in header.iter().enumerate() {
                        th scope="col" class=[numeric(i).then_some("n")] { (name) }
                    }
                } }
                tbody { @for row in rows { tr { @for cell in row { (cell.draw()) } } } }
            }
        }
    }
}

/// What says that nothing is there to be drawn.
pub(super) fn nothing(why: &str) -> Markup {
    html! { p class="nothing" { (why) } }
}
